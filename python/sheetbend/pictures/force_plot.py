"""Measured and simulated forces of a sensor over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..doubts.force_comparison import UNITS, ForceComparison
from .drawing import ACCENT, GRAY, INK, PALE, clean, key, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = "xyz"


def plot_forces(compared: ForceComparison, *, title: str = "") -> Figure:
    """One panel for each component that counts: measured (dots) against simulated (line), in the sensor's axes.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    shown = [
        (f"{'force' if unit == 'N' else 'torque'} {AXES[k % 3]} [{unit}]", k)
        for unit, part in UNITS
        for k in range(part.start, part.stop)
        if np.isfinite(compared.measured[:, k]).any()
    ]
    figure = new_figure(7.2, 0.6 + 1.5 * len(shown), title or f"{compared.experiment}: {compared.sensor}")
    held = compared.times[compared.held_out]
    for panel, (label, k) in zip(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0], shown, strict=True):
        clean(panel)
        panel.plot(compared.times, compared.measured[:, k], ".", color=GRAY, markersize=3, markeredgewidth=0)
        panel.plot(compared.times, compared.simulated[:, k], color=ACCENT, linewidth=1.3)
        panel.margins(x=0)
        panel.set_ylabel(label)
        if len(held):
            panel.axvspan(held[0], held[-1], color=PALE, zorder=0, linewidth=0)
    panel.set_xlabel("time [s]")
    shaded = [("shaded: held out", INK)] if len(held) else []
    key(figure, [("measured", GRAY), ("simulated", ACCENT), *shaded])
    return figure
