"""A mesh of a solid: bricks or tetrahedra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_kind, finite, index_array, whole
from ..arrays.types import Array, Indices
from ..errors import MeshError
from . import validate
from .places import nearest
from .solid_element import CORNERS, FACES, own_coordinates, quadrature, surface_faces
from .triangle_mesh import TriangleMesh
from .validate import MOST_CELLS

_MARGIN = 1e-6  # of an element's size, by which a point may lie outside of it


@dataclass(frozen=True, eq=False)
class SolidPlaces:
    """Points of a solid by the weights of an element's nodes.

    Attributes:
        elements: (k,) the element that each lies in.
        vertices: (k, 8 or 4) its nodes.
        weights: (k, 8 or 4) of sum 1.
    """

    elements: Indices
    vertices: Indices
    weights: Array

    def __len__(self) -> int:
        return len(self.elements)

    def positions(self, vertices: ArrayLike) -> Array:
        """(..., k, 3) m, where these places are when the mesh's vertices are at (..., n, 3) m."""
        found: Array = np.einsum("kc,...kcx->...kx", self.weights, np.asarray(vertices)[..., self.vertices, :])
        return found


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of bricks (hexahedra of eight nodes) or of linear tetrahedra, in the shape at rest. Immutable.

    Linear tetrahedra are too stiff in bending, the more so the less the material changes its volume: take bricks where
    you can.

    Attributes:
        vertices: (n, 3) m.
        elements: (m, 8) or (m, 4) vertex indices, numbered as in VTK and Gmsh.
        sets: vertices by name.
        fill: (m,) the share of each element that is material, above 0 and at most 1; all of it by default.

    Raises:
        MeshError: a wrong shape, an index out of range, a vertex without an element, an element without volume or
            turned inside out.
    """

    vertices: Array
    elements: Indices
    sets: Mapping[str, Indices] = field(default_factory=dict)
    fill: Array | None = None

    def __post_init__(self) -> None:
        vertices = validate.rows("vertices", self.vertices, 3)
        elements = _checked_elements(self.elements, len(vertices))
        check_kind("sets", self.sets, Mapping, "give lists of vertices by name", MeshError)
        sets = {name: validate.checked_set(name, ids, len(vertices)) for name, ids in self.sets.items()}
        fill = np.ones(len(elements)) if self.fill is None else finite("fill", self.fill, (len(elements),), MeshError)
        if not ((fill > 0) & (fill <= 1)).all():
            raise MeshError("fill", "must be above 0 and at most 1", float(fill.min()), "leave empty elements out")
        for array in (vertices, elements, fill, *sets.values()):
            array.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "elements", elements)
        object.__setattr__(self, "fill", fill)
        object.__setattr__(self, "sets", MappingProxyType(sets))
        bad = np.flatnonzero((self.points[1] <= 0).any(axis=1))
        if bad.size:
            problem = f"have no volume or are turned inside out: {bad.size} of {len(elements)}"
            fix = "number nodes as VTK does: a face counterclockwise as seen from the nodes behind it"
            raise MeshError("elements", problem, elements[bad[0]].tolist(), fix)

    def __repr__(self) -> str:
        return f"SolidMesh({len(self.vertices)} vertices, {len(self.elements)} {self.shape}, sets {sorted(self.sets)})"

    def __reduce__(self) -> tuple[object, ...]:
        return SolidMesh, (self.vertices, self.elements, dict(self.sets), self.fill)

    @property
    def shape(self) -> str:
        """ "bricks" or "tetrahedra"."""
        return "bricks" if self.elements.shape[1] == 8 else "tetrahedra"

    @cached_property
    def points(self) -> tuple[Array, Array, Array]:
        """The quadrature points: gradients (m, q, n, 3) 1/m of the shape functions, volumes (m, q) m^3 of material, and
        the share (m, n) m^3 of each node in its element's volume."""
        gradients, volumes, shares = quadrature(self.vertices[self.elements])
        fill = np.asarray(self.fill)[:, None]
        return gradients, volumes * fill, shares * fill

    @cached_property
    def volumes(self) -> Array:
        """(m,) m^3, of material in the elements."""
        return self.points[1].sum(axis=1)

    @cached_property
    def surface(self) -> tuple[TriangleMesh, Indices]:
        """The surface in triangles, counterclockwise as seen from outside, and the vertex (s,) of the solid that each
        of its vertices is. Material coordinates are those of each triangle alone."""
        faces = surface_faces(self.elements)
        halves = [faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]] if faces.shape[1] == 4 else [faces]
        triangles = np.stack(halves, axis=1).reshape(-1, 3)
        used, own = np.unique(triangles, return_inverse=True)
        own = own.reshape(triangles.shape)
        corners = self.vertices[triangles]
        u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        length = np.linalg.norm(u, axis=1)
        along = (u * v).sum(axis=1) / length
        flat = np.zeros((len(triangles), 3, 2))
        flat[:, 1, 0], flat[:, 2, 0] = length, along
        flat[:, 2, 1] = np.linalg.norm(v - (along / length)[:, None] * u, axis=1)
        return TriangleMesh(self.vertices[used], own, flat), used

    def within(self, lower: ArrayLike, upper: ArrayLike) -> Indices:
        """Vertices in a box of space, its faces included.

        Args:
            lower, upper: (3,) m; infinite entries leave a side open.
        """
        return validate.vertices_within(self.vertices, lower, upper)

    def areas(self, vertices: ArrayLike) -> Array:
        """(k,) m^2, what each of some vertices has of the surface between them: an equal part of each face that has all
        of its corners among them.

        Raises:
            SceneError: a vertex that does not exist.
            MeshError: one without such a face.
        """
        own = index_array("vertices", vertices, len(self.vertices))
        faces = surface_faces(self.elements)
        faces = faces[np.isin(faces, own).all(axis=1)]
        corners = faces.shape[1]
        a, b, c, d = (self.vertices[faces[:, k]] for k in (0, 1, 2, -1))
        area = 0.5 * np.linalg.norm(np.cross(c - a, d - b if corners == 4 else b - a), axis=1)
        shares = np.bincount(faces.ravel(), np.repeat(area / corners, corners), len(self.vertices))[own]
        if bad := own[shares == 0.0].tolist():
            raise MeshError("vertices", "have no face of the surface between them", bad, "give all corners of faces")
        return shares

    def nearest(self, points: ArrayLike) -> Indices:
        """(k,) the vertex nearest to each of (k, 3) points in space, m."""
        return nearest(self.vertices, validate.rows("points", points, 3))

    def at(self, points: ArrayLike) -> SolidPlaces:
        """Places at (k, 3) points of the shape at rest, m; those on an edge or a face have weights on its nodes alone.

        Raises:
            MeshError: a point lies outside of the solid.
        """
        corners = self.vertices[self.elements]
        size = np.ptp(corners, axis=1).max(axis=1)
        lower, upper = (corners.min(axis=1) - _MARGIN * size[:, None]), (corners.max(axis=1) + _MARGIN * size[:, None])
        found, weights = [], []
        for point in validate.rows("points", points, 3):
            near = np.flatnonzero(((lower <= point) & (point <= upper)).all(axis=1))
            w = own_coordinates(corners[near], point) if near.size else np.zeros((0, 1))
            best = int(w.min(axis=1).argmax()) if near.size else 0
            if not near.size or w[best].min() < -_MARGIN:
                fix = "give points of the shape at rest, or mesh.surface[0].project(points) for the nearest ones"
                raise MeshError("points", "lie outside of the solid", point.tolist(), fix)
            own = np.where(np.abs(w[best]) < _MARGIN, 0.0, w[best])
            found.append(near[best])
            weights.append(own / own.sum())
        elements = np.array(found)
        return SolidPlaces(elements, self.elements[elements], np.array(weights))


def bricks(size: ArrayLike, cells: Sequence[int], at: ArrayLike = (0.0, 0.0, 0.0)) -> SolidMesh:
    """A box of bricks along the axes.

    Sets: its faces, "x_min", "x_max", "y_min", "y_max", "z_min", "z_max".

    Args:
        size: (3,) m, along x, y and z.
        cells: number of bricks along each.
        at: (3,) m, its lowest corner.

    Raises:
        MeshError: a size or a number that is not positive.
    """
    box, origin = finite("size", size, (3,), MeshError), finite("at", at, (3,), MeshError)
    if not (box > 0).all():
        raise MeshError("size", "must be positive", box.tolist(), "give three lengths in m")
    numbers = whole(cells)
    if numbers.shape != (3,) or not (numbers > 0).all():
        raise MeshError("cells", "must be three positive whole numbers", cells, "give the bricks along x, y and z")
    check_count("bricks in all", int(np.prod(numbers, dtype=float)), 1, MOST_CELLS, MeshError)
    lines = [o + s * np.linspace(0.0, 1.0, n + 1) for o, s, n in zip(origin, box, cells, strict=True)]
    vertices = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(vertices)).reshape([n + 1 for n in cells])
    ends = {-1: slice(None, -1), 1: slice(1, None)}
    elements = np.stack([index[tuple(ends[int(c)] for c in corner)].ravel() for corner in CORNERS], axis=1)
    sets = {
        f"{axis}_{end}": np.take(index, place, axis=k).ravel()
        for k, axis in enumerate("xyz")
        for end, place in (("min", 0), ("max", -1))
    }
    return SolidMesh(vertices, elements, sets)


def tetrahedra(size: ArrayLike, cells: Sequence[int], at: ArrayLike = (0.0, 0.0, 0.0)) -> SolidMesh:
    """The same box, each brick of it cut into six tetrahedra around its diagonal."""
    box = bricks(size, cells, at)
    around = (1, 2, 3, 7, 4, 5)
    cut = np.array([[0, a, b, 6] for a, b in zip(around, (*around[1:], around[0]), strict=True)])
    return SolidMesh(box.vertices, box.elements[:, cut].reshape(-1, 4), dict(box.sets))


def _checked_elements(values: ArrayLike, count: int) -> Indices:
    """(m, 8) or (m, 4) indices of different vertices, of which each of `count` is used."""
    array = whole(values)
    if array.ndim != 2 or array.shape[1] not in FACES or not len(array):
        got = (values.shape, str(values.dtype)) if isinstance(values, np.ndarray) else values
        fix = "give vertex indices, eight for a brick or four for a tetrahedron"
        raise MeshError("elements", "must be whole numbers of shape (m, 8) or (m, 4), m at least 1", got, fix)
    bad = np.flatnonzero(((array < 0) | (array >= count)).any(axis=1))
    if bad.size:
        problem = f"name vertices that do not exist, in element {bad[0]}"
        raise MeshError("elements", problem, array[bad[0]].tolist(), f"use 0 to {count - 1}")
    ordered = np.sort(array, axis=1)
    twice = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if twice.size:
        problem = f"name a vertex twice, in element {twice[0]}"
        raise MeshError("elements", problem, array[twice[0]].tolist(), "give tetrahedra or bricks of distinct nodes")
    unused = np.setdiff1d(np.arange(count), array)
    if unused.size:
        problem = f"belong to no element ({unused.size} of {count})"
        raise MeshError("vertices", problem, unused[:5].tolist(), "remove them and renumber the elements")
    return array.astype(np.int64)
