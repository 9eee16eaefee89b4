"""Pictures of cloth: its mesh in space or flat, colored by a number per triangle, and numbers at markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_each, check_kind, finite
from ..arrays.types import Array
from ..errors import InputError
from ..mesh import Places, TriangleMesh
from ..optional import require
from .drawing import ACCENT, GRAY, INK, PALE, WARM, clean, key, new_figure, panels_in, seen_points
from .moving_shapes import up_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DARK = "#063d4e"  # beyond the accent, for the upper end of what is never negative


@dataclass(frozen=True)
class Field:
    """One panel.

    Attributes:
        label: what is drawn, with its unit.
        values: (m,), a number per triangle, NaN where there is none; or (k,), one per place.
        positions: (n, 3) m, where the vertices are in space; None draws the flat fabric.
        places: of the (k,) values, drawn as disks on the fabric.
        measured: (k, 3) m, markers drawn as dots in space; NaN where not seen.
        scale: fields that name the same one have the same colors, and one color bar.
    """

    label: str
    values: Array
    positions: Array | None = None
    places: Places | None = None
    measured: Array | None = None
    scale: str = ""


def plot_fields(
    mesh: TriangleMesh,
    fields: Sequence[Field],
    *,
    title: str = "",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    ax: Axes | Sequence[Axes] | Array | None = None,
) -> Array:
    """Fields side by side with their color bars: around zero where both signs occur, else from zero. Fields of one
    `scale` stand next to each other and share a bar.

    Args:
        mesh: of the cloth.
        fields: at least one.
        title: above the figure.
        gravity: (3,), which points down in pictures of space.
        ax: axes to draw in, one for each field, with `projection="3d"` where a field has positions.

    Returns:
        (fields,) axes.

    Raises:
        InputError: no field, values that are neither one per triangle nor one per place, or another number of axes.
    """
    check_kind("mesh", mesh, TriangleMesh, "give the mesh of the cloth")
    check_each("fields", fields, Field, "give sb.plot.Field(...)")
    values = [_checked(f"fields[{k}].values", mesh, field) for k, field in enumerate(fields)]
    panels, whole = _panels(fields, title, ax)
    first_flat = next((k for k, field in enumerate(fields) if field.positions is None), -1)
    scales = [field.scale or f"{k}" for k, field in enumerate(fields)]
    drawn = []
    for k, (panel, field) in enumerate(zip(panels, fields, strict=True)):
        colors = field_colors(np.concatenate([v for v, s in zip(values, scales, strict=True) if s == scales[k]]))
        draw = _in_space if field.positions is not None else _on_fabric
        drawn.append(draw(panel, mesh, field, values[k], colors))
        if field.positions is not None:
            seen = [] if field.measured is None else [seen_points(np.asarray(field.measured))]
            box_in_space(panel, np.vstack([field.positions, *seen]), gravity)
        elif k != first_flat:
            panel.set_ylabel("")
            panel.tick_params(labelleft=False)
        if field.scale:
            panel.set_title(field.label, color=INK, fontsize=9)
    for s in dict.fromkeys(scales):
        own = [k for k, other in enumerate(scales) if other == s]
        _bar([panels[k] for k in own], drawn[own[0]], fields[own[0]].scale or fields[own[0]].label)
    if any(field.measured is not None for field in fields):
        key(whole, [("measured markers", WARM)])
    return np.array(panels)


def _checked(name: str, mesh: TriangleMesh, field: Field) -> Array:
    count = len(mesh.triangles) if field.places is None else len(field.places)
    values = np.asarray(field.values, dtype=float)
    if values.shape != (count,):
        raise InputError(name, "has the wrong shape", values.shape, f"give ({count},)")
    return values


def _panels(fields: Sequence[Field], title: str, ax: Any) -> tuple[list[Axes], Axes | Figure]:
    """Panels as `panels_in` makes them; new ones are flat or in space, side by side."""
    if ax is not None:
        return panels_in(ax, len(fields), (0.0, 0.0), title)
    figure = new_figure(3.3 * len(fields) + 0.4, 3.9, title or " ")
    figure.set_layout_engine("constrained", w_pad=0.12, wspace=0.03)
    kinds = [{} if field.positions is None else {"projection": "3d"} for field in fields]
    return [figure.add_subplot(1, len(fields), k, **kind) for k, kind in enumerate(kinds, start=1)], figure


def _bar(panels: list[Axes], drawn: Any, label: str) -> None:
    """Below all of the panels, as thick as one below a single panel."""
    figure: Any = panels[0].figure
    shrink = 0.8 if len(panels) == 1 else 0.5
    aspect = 35.0 * len(panels) * shrink
    bar = figure.colorbar(drawn, ax=panels, orientation="horizontal", shrink=shrink, pad=0.03, aspect=aspect)
    bar.set_label(label, color=INK, fontsize=9)
    bar.ax.tick_params(colors=INK, labelsize=8)
    bar.ax.locator_params(nbins=5)
    bar.outline.set_visible(False)


def _on_fabric(panel: Axes, mesh: TriangleMesh, field: Field, values: Array, colors: dict[str, Any]) -> Any:
    if field.places is not None:
        return _at_places(panel, mesh, field.places, values, colors)
    collections = require("matplotlib.collections", "plot")
    edges = {"edgecolor": "face", "linewidth": 0.2}
    drawn = panel.add_collection(collections.PolyCollection(mesh.corners, array=_masked(values), **edges, **colors))
    _frame(panel, mesh)
    return drawn


def _at_places(panel: Axes, mesh: TriangleMesh, places: Places, values: Array, colors: dict[str, Any]) -> Any:
    collections = require("matplotlib.collections", "plot")
    panel.add_collection(collections.PolyCollection(mesh.corners, facecolor="none", edgecolor=PALE, linewidth=0.6))
    at = np.einsum("kc,kcx->kx", places.weights, mesh.corners[places.triangles])
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


def _in_space(panel: Any, mesh: TriangleMesh, field: Field, values: Array, colors: dict[str, Any]) -> Any:
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    assert field.positions is not None  # what sent it here
    x = finite("positions", field.positions, mesh.vertices.shape, InputError)
    edges = {"edgecolor": GRAY, "linewidth": 0.25}
    panel.computed_zorder = False  # dots stay in front
    if field.places is None:
        sheet = art.Poly3DCollection(x[mesh.triangles], array=_masked(values), **edges, **colors)
    else:
        sheet = art.Poly3DCollection(x[mesh.triangles], facecolor=PALE, **edges)
    drawn = panel.add_collection3d(sheet)
    if field.places is not None:
        at = field.places.positions(x)
        drawn = panel.scatter(*at.T, s=30, c=_masked(values), edgecolors=GRAY, depthshade=False, zorder=9, **colors)
    if field.measured is not None:
        seen = seen_points(np.asarray(field.measured))
        panel.plot(*seen.T, "o", color=WARM, markersize=2.6, markeredgewidth=0, zorder=10)
    return drawn


def box_in_space(panel: Any, points: Array, gravity: ArrayLike) -> None:
    """Axes that hold the points, all to one scale, the one nearest to gravity (3,) upright; a thin direction keeps a
    fifth of the widest."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 0.2 * (high - low).max())
    middle = (low + high) / 2
    up = up_of(gravity)
    for axis, name in enumerate("xyz"):
        half, flip = 0.52 * size[axis], float(up[axis]) or 1.0
        getattr(panel, f"set_{name}lim")(middle[axis] - flip * half, middle[axis] + flip * half)
        getattr(panel, f"{name}axis").set_tick_params(labelsize=7, colors=INK, pad=-1)
        getattr(panel, f"{name}axis").set_pane_color((1, 1, 1, 0))
        getattr(panel, f"{name}axis").line.set_color(GRAY)
        getattr(panel, f"set_{name}label")(f"{name} [m]", color=INK, fontsize=8, labelpad=0)
    panel.view_init(elev=18, azim=-58, vertical_axis="xyz"[int(np.abs(up).argmax())])
    panel.set_box_aspect(size, zoom=0.9)
    for axis, name in enumerate("xyz"):
        panel.locator_params(axis=name, nbins=1 + round(2 * size[axis] / size.max()))
    panel.grid(visible=False)


def field_colors(values: Array) -> dict[str, Any]:
    """Color map and scale of a field; both ends alike far from zero where it has both signs."""
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
    return {"cmap": shades, "norm": colors.Normalize(low, high)}


def _masked(values: ArrayLike) -> Any:
    return np.ma.masked_invalid(values)
