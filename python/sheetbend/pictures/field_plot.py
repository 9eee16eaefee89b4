"""Pictures of cloth: its mesh in space or flat, colored by a number per triangle, and numbers at markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..errors import InputError
from ..mesh import Places, TriangleMesh
from ..optional import require
from .drawing import ACCENT, GRAY, INK, PALE, WARM, clean, key, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = np.ndarray
_DARK = "#063d4e"  # beyond the accent, for the upper end of what is never negative


@dataclass(frozen=True)
class Field:
    """One panel.

    Attributes:
        label: what is drawn, with its unit.
        values: (m,), a number per triangle, NaN where there is none; or (k,), one per place.
        positions: (n, 3) m, where the vertices are in space; None draws the flat fabric.
        places: of the (k,) values, drawn as disks on the flat fabric.
        measured: (k, 3) m, markers drawn as dots in space; NaN where not seen.
    """

    label: str
    values: Array
    positions: Array | None = None
    places: Places | None = None
    measured: Array | None = None


def plot_fields(
    mesh: TriangleMesh, fields: Sequence[Field], *, title: str = "", gravity: ArrayLike = (0.0, 0.0, -9.81)
) -> Figure:
    """Fields side by side, each with its own color bar: around zero where both signs occur, else from zero.

    Args:
        gravity: (3,), which points down in pictures of space.

    Raises:
        InputError: no field, or values that are neither one per triangle nor one per place.
    """
    if not fields:
        raise InputError("fields", "are empty", 0, "give at least one")
    figure = new_figure(3.3 * len(fields) + 0.4, 3.9, title or " ")
    figure.set_layout_engine("constrained", w_pad=0.12, wspace=0.03)
    first_flat = next((i for i, field in enumerate(fields, start=1) if field.positions is None), 0)
    for index, field in enumerate(fields, start=1):
        count = len(mesh.triangles) if field.places is None else len(field.places)
        values = np.asarray(field.values, dtype=float)
        if values.shape != (count,):
            raise InputError(f"fields[{index - 1}].values", "has the wrong shape", values.shape, f"give ({count},)")
        options = {} if field.positions is None else {"projection": "3d"}
        panel = figure.add_subplot(1, len(fields), index, **options)
        if field.positions is not None:
            drawn = _in_space(panel, mesh, field, values, gravity)
        elif field.places is not None:
            drawn = _at_places(panel, mesh, field.places, values)
        else:
            drawn = _flat(panel, mesh, values)
        if field.positions is None and index != first_flat:
            panel.set_ylabel("")
            panel.tick_params(labelleft=False)
        bar = figure.colorbar(drawn, ax=panel, orientation="horizontal", shrink=0.8, pad=0.03, aspect=28)
        bar.set_label(field.label, color=INK, fontsize=9)
        bar.ax.tick_params(colors=INK, labelsize=8)
        bar.ax.locator_params(nbins=5)
        bar.outline.set_visible(False)
    if any(field.measured is not None for field in fields):
        key(figure, [("measured markers", WARM)])
    return figure


def _flat(panel: Axes, mesh: TriangleMesh, values: Array) -> Any:
    collections = require("matplotlib.collections", "plot")
    drawn = panel.add_collection(
        collections.PolyCollection(mesh.corners, array=_masked(values), **field_colors(values))
    )
    _frame(panel, mesh)
    return drawn


def _at_places(panel: Axes, mesh: TriangleMesh, places: Places, values: Array) -> Any:
    collections = require("matplotlib.collections", "plot")
    panel.add_collection(collections.PolyCollection(mesh.corners, facecolor="none", edgecolor=PALE, linewidth=0.6))
    at = np.einsum("kc,kcx->kx", places.weights, mesh.corners[places.triangles])
    colors = {k: v for k, v in field_colors(values).items() if k in ("cmap", "norm")}
    x, y = at.T
    drawn = panel.scatter(x, y, s=42, c=_masked(values), edgecolors=GRAY, linewidths=0.4, zorder=3, **colors)
    _frame(panel, mesh)
    return drawn


def _frame(panel: Axes, mesh: TriangleMesh) -> None:
    clean(panel)
    panel.autoscale()
    panel.set_aspect("equal")
    panel.set_xlabel("along the warp [m]")
    panel.set_ylabel("along the weft [m]")
    panel.locator_params(nbins=5)


def _in_space(panel: Any, mesh: TriangleMesh, field: Field, values: Array, gravity: ArrayLike) -> Any:
    assert field.positions is not None  # what sent it here
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    x = finite("positions", field.positions, mesh.vertices.shape, InputError)
    drawn = panel.add_collection3d(
        art.Poly3DCollection(x[mesh.triangles], array=_masked(values), **field_colors(values, line=0.25))
    )
    shown = [x]
    if field.measured is not None:
        seen = np.asarray(field.measured)[np.isfinite(field.measured).all(axis=1)]
        panel.plot(*seen.T, "o", color=WARM, markersize=2.6, markeredgewidth=0, zorder=10)
        shown.append(seen)
    box_in_space(panel, np.vstack(shown), gravity)
    return drawn


def box_in_space(panel: Any, points: Array, gravity: ArrayLike) -> None:
    """Axes that hold the points, all to one scale, the one nearest to gravity (3,) upright; a thin direction keeps a
    fifth of the widest."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 0.2 * (high - low).max())
    middle = (low + high) / 2
    down = np.asarray(gravity, dtype=float)
    upright = int(np.abs(down).argmax()) if down.any() else 2
    for axis, name in enumerate("xyz"):
        half = 0.52 * size[axis]
        flip = -1.0 if axis == upright and down[axis] > 0.0 else 1.0
        getattr(panel, f"set_{name}lim")(middle[axis] - flip * half, middle[axis] + flip * half)
        getattr(panel, f"{name}axis").set_tick_params(labelsize=7, colors=INK, pad=-1)
        getattr(panel, f"{name}axis").set_pane_color((1, 1, 1, 0))
        getattr(panel, f"{name}axis").line.set_color(GRAY)
        getattr(panel, f"set_{name}label")(f"{name} [m]", color=INK, fontsize=8, labelpad=0)
    panel.view_init(elev=18, azim=-58, vertical_axis="xyz"[upright])
    panel.set_box_aspect(size, zoom=0.9)
    for axis, name in enumerate("xyz"):
        panel.locator_params(axis=name, nbins=1 + round(3 * size[axis] / size.max()))
    panel.grid(visible=False)


def field_colors(values: Array, line: float = 0.0) -> dict[str, Any]:
    """Colors of a field; both ends alike far from zero where it has both signs."""
    colors = require("matplotlib.colors", "plot")
    seen = values[np.isfinite(values)]
    size = float(np.abs(seen).max(initial=0.0)) or 1.0
    both = seen.size > 0 and seen.min() < -1e-3 * size and seen.max() > 1e-3 * size
    if both:
        palette, low, high = [WARM, PALE, ACCENT], -size, size
    elif seen.min(initial=0.0) < -1e-3 * size:
        palette, low, high = [WARM, PALE], -size, 0.0
    else:
        palette, low, high = [PALE, ACCENT, _DARK], 0.0, size
    shades = colors.LinearSegmentedColormap.from_list("field", palette).with_extremes(bad="white")
    edges: dict[str, Any] = {"edgecolor": GRAY, "linewidth": line} if line else {"edgecolor": "face", "linewidth": 0.2}
    return {"cmap": shades, "norm": colors.Normalize(low, high), **edges}


def _masked(values: ArrayLike) -> Any:
    return np.ma.masked_invalid(values)
