"""A figure of estimates with their intervals, beside published values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays.checks import check_each, given_by_name
from ..arrays.types import Array
from ..optional import require
from ..quantities.wording import raised
from ..result.estimate import Estimate
from .drawing import ACCENT, GRAY, WARM, clean, key, panels_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_estimates(
    estimates: Sequence[Estimate],
    *,
    published: Mapping[str, float | tuple[float, float]] | None = None,
    title: str = "",
    ax: Axes | Sequence[Axes] | Array | None = None,
) -> Array:
    """Values with 95 % intervals, parameters of one unit on one axis, published values as marks.

    Args:
        estimates: of a `FitResult`, or of several.
        published: value, or (lowest, highest), by parameter.
        title: above the figure.
        ax: axes to draw in, one for each unit that occurs.

    Returns:
        (units,) axes.

    Raises:
        InputError: no estimate, or another number of axes than of units.
    """
    check_each("estimates", estimates, Estimate, "give those of a fit's result")
    published = given_by_name("published", published)
    groups: dict[str, list[Estimate]] = {}
    for estimate in estimates:
        groups.setdefault(estimate.unit, []).append(estimate)
    sizes = [len(group) for group in groups.values()]
    size = (7.2, 0.55 + 0.3 * sum(sizes) + 0.55 * len(groups))
    panels, whole = panels_in(ax, len(groups), size, title or " ", height_ratios=[size + 0.6 for size in sizes])
    for panel, (unit, group) in zip(panels, groups.items(), strict=True):
        _estimates_panel(panel, group, published)
        panel.set_xlabel(f"[{raised(unit) or '1'}]", labelpad=2)
    entries = [("value and 95 % interval", ACCENT)]
    if any(estimate.name in published for estimate in estimates):
        entries.append(("published", WARM))
    key(whole, entries)
    return np.array(panels)


def _estimates_panel(
    panel: Axes, group: Sequence[Estimate], published: Mapping[str, float | tuple[float, float]]
) -> None:
    clean(panel)
    panel.spines["left"].set_visible(False)
    ends = [end for e in group for end in (e.lower, e.upper, e.value) if end is not None]
    ends += [end for e in group if e.name in published for end in np.atleast_1d(published[e.name])]
    log = min(ends) > 0 and max(ends) > 20 * min(ends)
    if log:
        panel.set_xscale("log")
    else:
        panel.ticklabel_format(axis="x", useOffset=False)
        panel.locator_params(axis="x", nbins=6)
    low, high = (min(ends) / 1.5, max(ends) * 1.5) if log else _padded(min(ends), max(ends))
    panel.set_xlim(low, high)
    if log:
        _label_decades(panel, high / low)
    for row, estimate in enumerate(group):
        known = estimate.verdict == "identified"
        color = ACCENT if known else GRAY
        left = low if estimate.lower is None else estimate.lower
        right = high if estimate.upper is None else estimate.upper
        if estimate.lower is not None or estimate.upper is not None:
            panel.plot([left, right], [row, row], color=color, linewidth=2, solid_capstyle="butt")
        face = color if known else "white"
        panel.plot(estimate.value, row, "o", color=color, markersize=5, markerfacecolor=face)
        if not known:
            panel.text(1.01, row, estimate.verdict, transform=panel.get_yaxis_transform(), va="center", color=GRAY)
        if estimate.name in published:
            marks = np.atleast_1d(published[estimate.name])
            panel.plot(marks, np.full(len(marks), row), "|", color=WARM, markersize=11, markeredgewidth=1.6, zorder=3)
            panel.plot(marks, np.full(len(marks), row), color=WARM, linewidth=0.8, zorder=3)
    panel.set_yticks(range(len(group)), [estimate.name for estimate in group])
    panel.tick_params(axis="y", length=0)
    panel.set_ylim(len(group) - 0.4, -0.6)


def _label_decades(panel: Axes, span: float) -> None:
    """Numbers at 1, 2 and 5 of each decade, of more than three decades at 1 alone."""
    ticker = require("matplotlib.ticker", "plot")
    panel.xaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0) if span < 1e3 else (1.0,)))
    panel.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    panel.xaxis.set_minor_formatter(ticker.NullFormatter())


def _padded(low: float, high: float) -> tuple[float, float]:
    room = 0.08 * (high - low) or 0.1 * max(abs(high), 1e-12)
    return low - room, high + room
