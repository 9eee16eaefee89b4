"""A collider of any closed shape: the distances from a mesh, sampled on a grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..mesh.signed_distance import signed_distances
from .colliders import Collider
from .inertia import check_closed

CELLS = 32  # along the longest side of the mesh, where no spacing is given
MARGIN = 4  # cells of the grid around the mesh, where no margin is given
MOST_POINTS = 16_000_000  # of a grid: 128 MB
SAMPLES = 4000  # of the surface, that tell the error


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """A cubic spline through distances on a grid, as the core reads it.

    Attributes:
        origin: (3,) m, the grid's first point in the mesh's own coordinates.
        spacing: m.
        coefficients: of the B-splines, two more along each axis than the grid has points.
        deepest: m, the largest distance from the surface of a point inside.
        error: m, how far the field is from zero at most on the surface, at some thousands of points of its triangles
            and edges.
        outline: (lines, 2, 3) m, sections of the mesh that pictures show.
        extent: m, how far the mesh is from its coordinates' origin at most.
    """

    origin: Array
    spacing: float
    coefficients: Array
    deepest: float
    error: float
    outline: Array
    extent: float


@dataclass(frozen=True)
class DistanceField(Collider):
    """The inside of a closed triangle mesh: a hand, a mannequin, a tool.

    Its distances are exact at the points of a grid, and a cubic spline with two continuous derivatives (C2) between
    them. Edges and corners come out rounded by about a cell; `grid.error` says how far the field is from the surface.

    Args:
        mesh: closed, counterclockwise as seen from outside, such as `sb.read_mesh` reads.
        position: (3,) m, where the origin of the mesh's coordinates is.
        rotation: (3,) rad, a vector along the axis that the mesh is turned about there, as long as the angle.
        spacing: m, of the grid; a 32nd of the mesh's longest side by default. Details that are finer are lost.
        margin: m, how far around the mesh the grid goes: contact radii must be smaller. Four cells by default.

    Raises:
        SceneError: a mesh that is open or inside out, lengths that are not positive, a grid of more than 16 million
            points, or one too coarse for the mesh.
    """

    shape: ClassVar[str] = "distance_field"
    mesh: TriangleMesh = field(repr=False)
    position: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike = (0.0, 0.0, 0.0)
    spacing: float | None = None
    margin: float | None = None
    grid: DistanceGrid | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        label = self.name or self.shape
        if not isinstance(self.mesh, TriangleMesh):
            raise SceneError(
                f"{label}.mesh", "is not a mesh", self.mesh, "give a TriangleMesh, such as of sb.read_mesh"
            )
        given = {"spacing": self.spacing, "margin": self.margin}
        self._positive(**{key: value for key, value in given.items() if value is not None})
        self._placed()
        if self.grid is None:  # copies that move keep it
            object.__setattr__(self, "grid", _sampled(label, self.mesh, self.spacing, self.margin))

    @property
    def sizes(self) -> Mapping[str, float]:
        return {}

    @property
    def reach(self) -> float:
        """m, how far from its surface it knows distances."""
        assert self.grid is not None
        return MARGIN * self.grid.spacing if self.margin is None else self.margin

    @property
    def half_thickness(self) -> float:
        assert self.grid is not None
        return self.grid.deepest

    @property
    def extent(self) -> float:
        assert self.grid is not None
        return self.grid.extent

    @property
    def specification(self) -> dict[str, Any]:
        assert self.grid is not None
        own = (self.grid.origin.tolist(), self.grid.spacing, self.grid.coefficients)
        return {**super().specification, "grid": own}

    def _placed(self) -> tuple[Array, Array]:
        return self._vector("position", self.position), self._vector("rotation", self.rotation)


def _sampled(label: str, mesh: TriangleMesh, spacing: float | None, margin: float | None) -> DistanceGrid:
    vertices, triangles = mesh.vertices, mesh.triangles
    check_closed(f"{label}.mesh", triangles)
    if np.einsum("kx,kx->", vertices[triangles[:, 0]], np.cross(*np.moveaxis(vertices[triangles[:, 1:]], 1, 0))) < 0:
        fix = "turn its triangles round: triangles[:, ::-1]"
        raise SceneError(f"{label}.mesh", "is inside out", f"{len(triangles)} triangles", fix)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = float((high - low).max() / CELLS if spacing is None else spacing)
    around = MARGIN * step if margin is None else margin
    counts = np.ceil((high - low + 2.0 * around) / step) + 1.0
    if counts.prod() > MOST_POINTS:
        fix = "give a larger spacing, or a smaller margin"
        raise SceneError(f"{label}.spacing", f"needs {counts.prod():.3g} grid points", step, fix)
    counts = counts.astype(int)
    origin = 0.5 * (low + high) - 0.5 * step * (counts - 1)
    axes = [start + step * np.arange(n) for start, n in zip(origin, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distances = signed_distances(vertices, triangles, points).reshape(counts)
    coefficients = distances
    for axis in range(3):
        coefficients = np.moveaxis(_interpolating(np.moveaxis(coefficients, axis, 0)), 0, axis)
    coefficients = np.pad(coefficients, 1, mode="reflect")
    corners = vertices[triangles]
    surface = np.concatenate([vertices, _spread(corners, SAMPLES)])
    error, deepest = float(np.abs(spline(origin, step, coefficients, surface)).max()), float(-distances.min())
    if error >= deepest:
        problem = (
            f"is too coarse: the surface is off by {error:.3g} m, and the deepest grid point is {deepest:.3g} m inside"
        )
        raise SceneError(f"{label}.spacing", problem, step, "give a smaller spacing, m")
    return DistanceGrid(
        origin,
        step,
        np.ascontiguousarray(coefficients),
        deepest=deepest,
        error=error,
        outline=_sections(corners),
        extent=float(np.linalg.norm(vertices, axis=1).max()),
    )


def spline(origin: Array, spacing: float, coefficients: Array, points: Array) -> Array:
    """Values (k,) of a field at points (k, 3) within its grid."""
    u = (points - origin) / spacing
    cell = np.clip(np.floor(u).astype(int), 0, np.array(coefficients.shape) - 4)
    t = u - cell
    s = 1.0 - t
    weights = np.stack([s**3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - s**2 + s**3 / 2, t**3 / 6], axis=1)  # (k, 4, 3)
    values = np.zeros(len(points))
    for i, j, k in np.ndindex(4, 4, 4):
        own = coefficients[cell[:, 0] + i, cell[:, 1] + j, cell[:, 2] + k]
        values += weights[:, i, 0] * weights[:, j, 1] * weights[:, k, 2] * own
    return values


def _interpolating(values: Array) -> Array:
    """Coefficients c along the first axis with (c[i - 1] + 4 c[i] + c[i + 1])/6 = values[i], mirrored at both ends: the
    cubic B-spline that goes through the values (Thomas algorithm)."""
    last = len(values) - 1
    c = 6.0 * values
    above = np.empty(last)
    for i in range(last + 1):
        pivot = 4.0 if i == 0 else 4.0 - (2.0 if i == last else 1.0) * above[i - 1]
        if i > 0:
            c[i] -= (2.0 if i == last else 1.0) * c[i - 1]
        c[i] /= pivot
        if i < last:
            above[i] = (2.0 if i == 0 else 1.0) / pivot
    for i in range(last - 1, -1, -1):
        c[i] -= above[i] * c[i + 1]
    return c


def _spread(corners: Array, count: int) -> Array:
    """(count, 3) points of triangles (m, 3, 3), as many as their areas ask for, half of them on edges."""
    rng = np.random.default_rng(0)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = rng.dirichlet(np.ones(3), count)
    weights[::2, 2] = 0.0
    turned = (np.arange(3) + rng.integers(0, 3, (count, 1))) % 3
    weights = np.take_along_axis(weights / weights.sum(axis=1, keepdims=True), turned, axis=1)
    own = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    return np.asarray(np.einsum("kc,kcx->kx", weights, own))


def _sections(corners: Array) -> Array:
    """(lines, 2, 3) where planes across the three axes cut triangles (m, 3, 3), three planes for each axis."""
    lines = []
    for axis in range(3):
        low, high = corners[..., axis].min(), corners[..., axis].max()
        for height in low + (high - low) * (np.arange(3) + 0.5) / 3:
            above = corners[..., axis] > height
            cut = corners[(above.sum(axis=1) % 3) > 0]
            side = cut[..., axis] > height
            alone = np.where(side.sum(axis=1) == 1, side.argmax(axis=1), (~side).argmax(axis=1))
            rows = np.arange(len(cut))
            tip, ends = cut[rows, alone], [cut[rows, (alone + j) % 3] for j in (1, 2)]
            shares = [((height - tip[:, axis]) / (end[:, axis] - tip[:, axis]))[:, None] for end in ends]
            lines.append(np.stack([tip + s * (end - tip) for s, end in zip(shares, ends, strict=True)], axis=1))
    return np.concatenate(lines)
