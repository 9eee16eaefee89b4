"""A triangle mesh: where its vertices are in space, and where they are on the flat fabric."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite, whole
from ..arrays.types import Array, Indices
from ..errors import MeshError
from . import bending_ratio, doubts, places, topology, validate
from .places import Places
from .through import through

_AnyArray = TypeVar("_AnyArray", Array, Indices)

_ONE_WAY = 2.0  # good patterns have 1 to 1.5, one-way diagonals 4


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle mesh with material coordinates. Immutable, its arrays are read-only.

    Attributes:
        vertices: (n, 3) m, positions in space.
        triangles: (m, 3) vertex indices; neighbors run opposite ways along their common edge.
        material: (n, 2) m, coordinates on the flat fabric, the first along warp (or course), the second along weft
            (or wale); or (m, 3, 2) m, one for each corner of each triangle, where no chart covers the whole mesh (cut
            panels, closed surfaces). Every triangle is counter-clockwise in them. `unfold` makes them from a shape at
            rest.
        sets: vertices by name.

    Raises:
        MeshError: a wrong shape, an index out of range, a triangle without area or clockwise in the material, neighbors
            of opposite orientation, more than two triangles on an edge, or a vertex without a triangle.
    """

    vertices: Array
    triangles: Indices
    material: Array
    sets: Mapping[str, Indices] = field(default_factory=dict)

    def __post_init__(self) -> None:
        vertices = validate.rows("vertices", self.vertices, 3)
        triangles = validate.checked_triangles(self.triangles, len(vertices))
        material = validate.checked_material(self.material, len(vertices), len(triangles))
        check_kind("sets", self.sets, Mapping, "give lists of vertices by name", MeshError)
        sets = {name: _frozen(validate.checked_set(name, ids, len(vertices))) for name, ids in self.sets.items()}
        object.__setattr__(self, "vertices", _frozen(vertices))
        object.__setattr__(self, "triangles", _frozen(triangles))
        object.__setattr__(self, "material", _frozen(material))
        object.__setattr__(self, "sets", MappingProxyType(sets))
        validate.refuse_broken(triangles, len(vertices))
        validate.refuse_flat_or_clockwise(self.corners)

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, sets {sorted(self.sets)})"

    def __reduce__(self) -> tuple[object, ...]:
        return TriangleMesh, (self.vertices, self.triangles, self.material, dict(self.sets))

    @cached_property
    def corners(self) -> Array:
        """(m, 3, 2) m, material coordinates of every triangle's corners."""
        return self.material if self.material.ndim == 3 else _frozen(self.material[self.triangles])

    @cached_property
    def areas(self) -> Array:
        """(m,) m^2, of the triangles in the material."""
        return _frozen(validate.signed_areas(self.corners))

    @cached_property
    def edges(self) -> Indices:
        """(e, 2) every edge once, lower vertex first."""
        return _frozen(topology.edges(self.triangles))

    @cached_property
    def hinges(self) -> Indices:
        """(k, 4) [v0, v1, a, b] of every interior edge, of its triangles (v0, v1, a) and (v1, v0, b)."""
        return _frozen(topology.hinges(self.triangles, self._twins))

    @cached_property
    def hinge_triangles(self) -> Indices:
        """(k, 2) the triangles (v0, v1, a) and (v1, v0, b) of every hinge."""
        return _frozen(topology.hinge_half_edges(self._twins) // 3)

    @cached_property
    def borders(self) -> Indices:
        """(b, 2) edges with one triangle, directed as in it."""
        return _frozen(topology.half_edges(self.triangles)[self._twins < 0])

    @cached_property
    def boundary(self) -> tuple[Indices, ...]:
        """The vertices of every border loop, in order; none on a closed mesh."""
        return tuple(_frozen(loop) for loop in topology.loops(self.borders))

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What can be simulated but is seldom meant: splinters, loose parts, cracks, jumps of the warp direction."""
        return doubts.doubts(self.vertices, self.triangles, self.corners, self._twins)

    @cached_property
    def diagonal_bias(self) -> float:
        """Largest over smallest `bending_ratio` of all directions, borders left out; 1 has no bias.

        1.5 for alternating or crossed diagonals and 4 for one-way ones. NaN where no triangle has three neighbors.
        """
        form = bending_ratio.bending_form(self.corners, self._twins, inside=True)
        values = bending_ratio.ratio(form, np.radians(np.arange(180.0)))
        return float(values.max() / values.min())

    @property
    def one_way_diagonals(self) -> bool:
        """True when hinges would bend this mesh at least twice as hard in one direction as in another."""
        return bool(self.diagonal_bias > _ONE_WAY)

    def bending_ratio(self, directions: ArrayLike) -> Array:
        """B/k when the hinge energy k/2 * 3 |e|^2 / (A0 + A1) * theta^2 is bent to a wide cylinder.

        3 for a fine mesh without bias; borders, where hinges are missing, lower it.

        Args:
            directions: rad, of the curvature from the warp axis, any shape.
        """
        form = bending_ratio.bending_form(self.corners, self._twins, inside=False)
        return bending_ratio.ratio(form, finite("directions", directions, None, MeshError))

    def within(self, lower: ArrayLike, upper: ArrayLike) -> Indices:
        """Vertices in a box of space, its faces included.

        Args:
            lower, upper: (3,) m; infinite entries leave a side open.
        """
        return validate.vertices_within(self.vertices, lower, upper)

    def nearest(self, points: ArrayLike) -> Indices:
        """(k,) the vertex nearest to each of (k, 3) points in space, m."""
        return places.nearest(self.vertices, validate.rows("points", points, 3))

    def with_set(self, name: str, vertices: ArrayLike) -> TriangleMesh:
        """The same mesh with one more named set (or another one of that name)."""
        check_kind("name", name, str, "name the set", MeshError)
        return replace(self, sets={**self.sets, name: whole(vertices)})

    def at(self, points: ArrayLike) -> Places:
        """Places at (k, 2) material coordinates, m.

        Raises:
            MeshError: a point lies outside of every triangle, or inside of two that have no vertex in common.
        """
        triangles, weights = places.locate(self.corners, self.triangles, validate.rows("points", points, 2))
        return Places(triangles, self.triangles[triangles], weights)

    def project(self, points: ArrayLike) -> Places:
        """The places of the mesh that are closest to (k, 3) points in space, m."""
        triangles, weights = places.closest(self.vertices, self.triangles, validate.rows("points", points, 3))
        return Places(triangles, self.triangles[triangles], weights)

    def through(self, places: Places, positions: ArrayLike) -> Array:
        """(n, 3) m: vertices on a smooth surface that leads places of the mesh through measured positions.

        A start for a cloth that is first seen hanging or in folds, from its markers (`add_cloth(..., positions=...)`).
        The surface is a thin plate spline of the mesh's own vertices; it goes on beyond the outermost places.

        Args:
            places: k of them, such as `at` gives.
            positions: (k, 3) m, a row of NaN for what is not seen.

        Raises:
            MeshError: positions of another shape, places that coincide, or fewer than three off a line.
        """
        check_kind("places", places, Places, "give what `at` returns", MeshError)
        return through(self.vertices, places.positions(self.vertices), positions)

    @cached_property
    def _twins(self) -> Indices:
        return topology.twins(self.triangles)


def _frozen(array: _AnyArray) -> _AnyArray:
    array.flags.writeable = False
    return array
