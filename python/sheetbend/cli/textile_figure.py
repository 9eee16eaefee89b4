"""The figure of measured loops, their mean, and the law that follows it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..pictures import plotting
from ..pictures.drawing import ACCENT, GRAY, PALE, WARM, clean, key, new_figure
from ..textile import Curve, FabricFit, MeanCurve, strains_under

_AXES = {
    "tension": ("strain [%]", 100.0, "force per width [N/m]"),
    "shear": ("shear angle [deg]", 180.0 / np.pi, "force per width [N/m]"),
    "bending": ("curvature [1/cm]", 0.01, "moment per width [N]"),
}
_LOADS = 20


def write_figure(
    curves: Sequence[Curve],
    mean: MeanCurve,
    way: str,
    fit: FabricFit | None,
    along: str,
    form: str,
    folder: Path,
    name: str = "curves",
) -> list[str]:
    """Loops gray, their mean with its scatter warm, the fitted fabric in the accent; gives the file's name."""
    if form == "none":
        return []
    x_label, per, y_label = _AXES[curves[0].test]
    figure = new_figure(6.4, 4.4, "")
    panel = figure.subplots()
    for curve in curves:
        panel.plot(per * curve.deformation, curve.load, color=GRAY, lw=0.7)
    if mean.count > 1:
        low, high = mean.load - mean.scatter, mean.load + mean.scatter
        panel.fill_between(per * mean.deformation, low, high, color=PALE, zorder=0)
    panel.plot(per * mean.deformation, mean.load, color=WARM, lw=1.6)
    entries = [("specimens", GRAY), (f"mean {way} and scatter" if mean.count > 1 else way, WARM)]
    if fit is not None:
        load = np.geomspace(0.01, 1.0, _LOADS) * (mean.load.max() - curves[0].pretension) + curves[0].pretension
        panel.plot(per * strains_under(fit.fabric, curves, load, along), load, color=ACCENT, lw=1.6, ls=(0, (4, 2)))
        entries.append(("fitted fabric", ACCENT))
    clean(panel)
    panel.set(xlabel=x_label, ylabel=y_label)
    key(panel, entries)
    plotting.save(figure, folder / f"{name}.{form}")
    return [f"{name}.{form}"]
