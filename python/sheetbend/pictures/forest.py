"""Forest plots: every specimen's interval, and the mean and spread of the population below."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..optional import require
from ..report.collected import COUNTED, Collected, Trait
from .drawing import ACCENT, GRAY, INK, PALE, clean, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 60  # specimens


def plot_forest(found: Collected, title: str = "") -> Figure:
    """One panel for each parameter with a population; the first `SHOWN` specimens."""
    traits = [trait for trait in found.traits if trait.found is not None]
    specimens = list(found.fits)[:SHOWN]
    figure = new_figure(max(4.0, 3.4 * len(traits)), 1.4 + 0.2 * (len(specimens) + 2), title)
    for column, trait in enumerate(traits):
        panel = figure.add_subplot(1, len(traits), column + 1)
        _panel(panel, found, trait, specimens, names=column == 0)
    return figure


def _panel(panel: Axes, found: Collected, trait: Trait, specimens: list[str], names: bool) -> None:
    p, inverse = trait.found, math.exp if trait.log else float
    assert p is not None
    last = len(specimens)
    panel.axvspan(inverse(p.mean - p.spread), inverse(p.mean + p.spread), color=PALE, linewidth=0, zorder=0)
    for row, specimen in enumerate(specimens):
        e = next((e for e in found.fits[specimen].estimates if e.name == trait.name), None)
        if e is None or e.lower is None or e.upper is None:
            continue
        color = INK if e.verdict in COUNTED else GRAY
        panel.plot([e.lower, e.upper], [row, row], color=color, linewidth=0.9)
        panel.plot([e.value], [row], "o", color=color, markersize=2.5)
    ends = [inverse(x) for x in p.mean_interval]
    panel.plot(ends, [last + 0.5] * 2, color=ACCENT, linewidth=2.0)
    panel.plot([inverse(p.mean)], [last + 0.5], "D", color=ACCENT, markersize=4.5)
    mean = "mean" if last == len(found.fits) else f"mean of all {len(found.fits):,}"
    panel.set_yticks([*range(last), last + 0.5], [*specimens, mean] if names else [""] * (last + 1))
    panel.set_ylim(last + 1.2, -0.8)
    panel.xaxis.set_major_locator(require("matplotlib.ticker", "plot").MaxNLocator(4))
    panel.set_xlabel(f"{trait.name} [{trait.unit}]" if trait.unit else trait.name)
    clean(panel)
