"""The figure that `sheetbend fit` writes of every cloth of a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..doubts.prediction import Comparison
from ..fitting.fit import Fit
from ..fitting.fitted_motion import fitted_positions
from ..mesh import Places
from ..objects.cloth import Cloth
from ..pictures.field_plot import Field, plot_fields
from ..pictures.strain import strain_fields
from ..quantities.wording import short
from ..result.field import FieldFit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STRAIN = "strain [%]"


def cloth_figures(found: Fit, c: Comparison) -> dict[str, Axes]:
    """The first panel of each cloth's figure, by name of the cloth. The figure shows the cloth with the measured
    markers, its strains, and the residual of each marker. A cloth that no flat chart covers, such as a tube, is drawn
    in space.

    A motion is shown where the markers are farthest from their start, in the fitted part.
    """
    e = c.experiment
    if not e.scene.cloths:
        return {}
    values = found.values_of(e)
    frame = 0 if e.static else _farthest(c)
    (positions,) = fitted_positions(found, c, [frame])
    when = "at rest" if e.static else f"at {c.recording.times[frame]:.3g} s"
    rms = _residuals(c)
    figures = {}
    for cloth in e.scene.cloths.values():
        mine, places = _markers(c, cloth)
        strain = strain_fields(e.scene, cloth, positions, values)
        where = positions[cloth.particles]
        seen = c.recording.positions[frame] if e.is_cloud else c.recording.positions[frame, mine]
        chart = where if cloth.mesh.material.ndim == 3 else None
        fields = [
            Field("along the warp", 1e2 * strain["strain_warp"], where, measured=seen, scale=_STRAIN),
            Field("along the weft", 1e2 * strain["strain_weft"], chart, scale=_STRAIN),
            Field("shear", 1e2 * strain["strain_shear"], chart, scale=_STRAIN),
        ]
        if mine:
            fields.append(Field("residual of each marker, rms [mm]", rms[mine], chart, places))
        title = f"{e.name}: {cloth.name} {when}"
        figures[cloth.name] = plot_fields(cloth.mesh, fields, title=title, gravity=e.scene.gravity)[0]
    return figures


def stiffness_figures(found: Fit) -> dict[str, Axes]:
    """Draw the stiffness of each cloth on which it varies, its intervals, and the share of the prior that is left.

    Returns:
        The first panel of each figure, by name of the field.
    """
    cloths = [cloth for c in found.comparisons for cloth in c.experiment.scene.cloths.values()]
    known = {cloth.field.name: cloth for cloth in cloths if cloth.field is not None}
    drawn = [(f, known[f.name]) for f in found.result.fields if f.name in known]
    return {f.name: plot_fields(cloth.mesh, stiffness_panels(f, cloth), title=f.name)[0] for f, cloth in drawn}


def stiffness_panels(f: FieldFit, cloth: Cloth) -> list[Field]:
    """What a fit found of the stiffness of each triangle; those that cannot move have none."""
    at = {tuple(x): k for k, x in enumerate(cloth.mesh.vertices[cloth.mesh.triangles].mean(axis=1).tolist())}
    own, E = [at[center] for center in f.centers], np.array(f.stiffness)
    mean = float(np.exp(np.log(E).mean()))
    from_mean = f"along the warp, from {short(mean, 3)} {f.unit} [%]"
    values = np.full((3, len(cloth.mesh.triangles)), np.nan)
    values[:, own] = 1e2 * (E / mean - 1.0), 1e2 * np.expm1(f.half_widths), 1e2 * np.array(f.left)
    labels = (f"stiffness {from_mean}", "95 % interval, +/- [%]", "share of the prior that is left [%]")
    space = cloth.mesh.vertices if cloth.mesh.material.ndim == 3 else None  # no flat chart covers it
    return [Field(label, each, space) for label, each in zip(labels, values, strict=True)]


def _farthest(c: Comparison) -> int:
    """The fitted frame in which the markers are farthest from their start."""
    x = np.where(c.held_out[:, None, None], np.nan, c.recording.positions)
    first = x[np.isfinite(x).any(axis=(1, 2)).argmax()]
    moved = np.nansum((x - first) ** 2, axis=(1, 2)) / np.maximum(np.isfinite(x).sum(axis=(1, 2)), 1)
    return int(moved.argmax())


def _residuals(c: Comparison) -> np.ndarray:
    """(markers,) mm, root mean square distance over the fitted frames; NaN for markers that are not seen there."""
    squares = ((c.simulated - c.recording.positions) ** 2).sum(axis=2)
    seen = np.isfinite(squares) & ~c.held_out[:, None]
    count = seen.sum(axis=0)
    mean = np.where(seen, squares, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > 0, 1e3 * np.sqrt(mean), np.nan)


def _markers(c: Comparison, cloth: Cloth) -> tuple[list[int], Places]:
    """The compared markers that sit on a cloth, and where."""
    own = {tuple(corners): k for k, corners in enumerate(cloth.particles[cloth.mesh.triangles].tolist())}
    mine, triangles, weights = [], [], []
    for k, place in enumerate(c.experiment.compared_places):
        if place.particles in own:
            mine.append(k)
            triangles.append(own[place.particles])
            weights.append(place.weights)
    at = np.array(triangles, dtype=int)
    return mine, Places(at, cloth.mesh.triangles[at], np.array(weights).reshape(-1, 3))
