"""An unknown force or wind over time, as a fit found it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays.checks import check_kind
from ..result.over_time import OverTimeFit
from .drawing import FOUND, GRAY, band, clean, key, panels_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = "xyz"


def plot_over_time(
    found: OverTimeFit, *, title: str = "", ax: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """One panel for each axis: the values (line) and their 95 % intervals (band).

    Args:
        found: of `FitResult.over_time`.
        title: above the figure; names of the recording and the input when left out.
        ax: axes to draw in, three.

    Returns:
        (3,) axes.

    Raises:
        InputError: another number of axes than three.
        MissingExtraError: matplotlib is not installed.
    """
    check_kind("found", found, OverTimeFit, "give one of a result's over_time")
    panels, whole = panels_in(ax, 3, (7.2, 5.6), title or f"{found.recording}: {found.name}")
    values, half = np.array(found.values), np.array(found.half_widths)
    for k, panel in enumerate(panels):
        clean(panel)
        panel.axhline(0.0, color=GRAY, linewidth=0.6)
        band(panel, np.array(found.times), values[:, k], values[:, k] - half[:, k], values[:, k] + half[:, k])
        panel.set_ylabel(f"{found.kind} {AXES[k]} [{found.unit}]")
    panels[-1].set_xlabel("time [s]")
    key(whole, FOUND)
    return np.array(panels)
