"""Measured and simulated forces of a sensor over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays.checks import check_kind
from ..doubts.force_comparison import UNITS, ForceComparison
from .drawing import ACCENT, GRAY, INK, PALE, WARM, clean, key, panels_in, strip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = "xyz"


def plot_forces(
    compared: ForceComparison, *, title: str = "", ax: Axes | Sequence[Axes] | np.ndarray | None = None
) -> np.ndarray:
    """One panel for each component that counts: measured (dots) against simulated (line), in the sensor's axes, and
    below each how far the simulated one is off.

    Args:
        compared: of a fit's comparison.
        title: above the figure; names of the experiment and the sensor when left out.
        ax: axes to draw in, one for each component that counts.

    Returns:
        (components,) axes.

    Raises:
        InputError: another number of axes than of components.
        MissingExtraError: matplotlib is not installed.
    """
    check_kind("compared", compared, ForceComparison, "give one of a comparison's forces")
    shown = [
        (f"{'force' if unit == 'N' else 'torque'} {AXES[k % 3]} [{unit}]", k)
        for unit, part in UNITS
        for k in range(part.start, part.stop)
        if np.isfinite(compared.measured[:, k]).any()
    ]
    title = title or f"{compared.experiment}: {compared.sensor}"
    panels, whole = panels_in(ax, len(shown), (7.2, 0.6 + 2.1 * len(shown)), title)
    held = compared.times[compared.held_out]
    for panel, (label, k) in zip(panels, shown, strict=True):
        clean(panel)
        panel.plot(compared.times, compared.measured[:, k], ".", color=GRAY, markersize=3, markeredgewidth=0)
        panel.plot(compared.times, compared.simulated[:, k], color=ACCENT, linewidth=1.3)
        panel.margins(x=0)
        panel.set_ylabel(label)
        below = strip(panel, "off")
        below.plot(compared.times, compared.simulated[:, k] - compared.measured[:, k], color=WARM, linewidth=0.8)
        for part in (panel, below) if len(held) else ():
            part.axvspan(held[0], held[-1], color=PALE, zorder=0, linewidth=0)
    below.set_xlabel("time [s]")
    shaded = [("shaded: held out", INK)] if len(held) else []
    key(whole, [("measured", GRAY), ("simulated", ACCENT), *shaded])
    return np.array(panels)
