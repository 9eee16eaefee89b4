"""What a mesh must be."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays.checks import finite, numbers, whole
from ..arrays.types import Array, Indices
from ..errors import MeshError
from . import topology

NO_AREA = 1e-12  # of the square of the longest edge: rounding of the coordinates

MOST_CELLS = 10**7  # of a mesh that is made


def rows(name: str, values: ArrayLike, width: int) -> Array:
    """(n, width) finite numbers, n >= 1, as a new array."""
    array = finite(name, values, None, MeshError)
    if array.ndim != 2 or array.shape[1] != width or len(array) == 0:
        raise MeshError(name, "have the wrong shape", array.shape, f"give (n, {width}) with n at least 1")
    return array


def vertices_within(vertices: Array, lower: ArrayLike, upper: ArrayLike) -> Indices:
    """Indices of vertices (n, 3) in a box of space with corners (3,), its faces included; infinite entries leave a side
    open.

    Raises:
        MeshError: a corner that is not three numbers.
    """
    low, high = numbers("lower", lower, MeshError), numbers("upper", upper, MeshError)
    for name, bound in (("lower", low), ("upper", high)):
        if bound.shape != (3,) or np.isnan(bound).any():
            raise MeshError(name, "must be three numbers", bound.tolist(), "give x, y and z in m, or infinity")
    return np.flatnonzero(((vertices >= low) & (vertices <= high)).all(axis=1))


def checked_triangles(values: ArrayLike, count: int) -> Indices:
    """(m, 3) indices of different vertices below `count`."""
    array = whole(values)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        got = (values.shape, str(values.dtype)) if isinstance(values, np.ndarray) else values
        raise MeshError("triangles", "must be whole numbers of shape (m, 3), m at least 1", got, "give vertex indices")
    bad = np.flatnonzero(((array < 0) | (array >= count)).any(axis=1))
    if bad.size:
        problem = f"name vertices that do not exist, in triangle {bad[0]}"
        raise MeshError("triangles", problem, array[bad[0]].tolist(), f"use 0 to {count - 1}")
    twice = np.flatnonzero((array == np.roll(array, 1, axis=1)).any(axis=1))
    if twice.size:
        problem = f"name a vertex twice, in triangle {twice[0]}"
        raise MeshError("triangles", problem, array[twice[0]].tolist(), "remove such triangles")
    return array.astype(np.int64)


def checked_material(values: ArrayLike, count: int, triangles: int) -> Array:
    """(count, 2) or (triangles, 3, 2) finite numbers."""
    array = finite("material", values, None, MeshError)
    shapes = [(count, 2), (triangles, 3, 2)]
    if array.shape not in shapes:
        fix = f"give {shapes[0]} per vertex or {shapes[1]} per triangle corner"
        raise MeshError("material", "has the wrong shape", array.shape, fix)
    return array


def checked_set(name: str, values: ArrayLike, count: int) -> Indices:
    """(k,) different vertex indices below `count`, in their order."""
    array = np.atleast_1d(np.array(values))
    label = f"sets[{name!r}]"
    if not isinstance(name, str) or not name:
        raise MeshError(label, "has no name", name, "name sets by texts")
    if array.ndim != 1 or array.size == 0 or not np.issubdtype(array.dtype, np.integer):
        raise MeshError(label, "must be a list of vertices, at least one", values, "give whole numbers")
    bad = array[(array < 0) | (array >= count)]
    if bad.size:
        raise MeshError(label, "names vertices that do not exist", bad[:5].tolist(), f"use 0 to {count - 1}")
    if len(np.unique(array)) < len(array):
        raise MeshError(label, "names a vertex twice", array.tolist(), "name each once")
    return array.astype(np.int64)


def signed_areas(corners: Array) -> Array:
    """(m,) m^2, negative where the triangle is clockwise."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: Array = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    return areas


def refuse_broken(triangles: Indices, count: int) -> None:
    """Refuse what is no surface: non-manifold edges and vertices, flipped neighbors, vertices without a triangle.

    Raises:
        MeshError: naming the first such edge or vertex.
    """
    directed = topology.half_edges(triangles)
    edges, inverse, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    many = np.flatnonzero(uses > 2)
    if many.size:
        edge = edges[many[0]].tolist()
        on_it = (np.flatnonzero(inverse.ravel() == many[0]) // 3).tolist()
        problem = f"are not manifold: {uses[many[0]]} of them share the edge {edge} ({_more(many)})"
        raise MeshError("triangles", problem, on_it, "leave two triangles on every edge; model layers as two meshes")
    repeated, turns = np.unique(directed, axis=0, return_counts=True)
    flipped = repeated[turns > 1]
    if len(flipped):
        on_it = (np.flatnonzero((directed == flipped[0]).all(axis=1)) // 3).tolist()
        problem = f"are oriented against each other along the edge {flipped[0].tolist()} ({_more(flipped)})"
        raise MeshError("triangles", problem, on_it, "unify the normals where it is made, or read it with `merge`")
    unused = np.setdiff1d(np.arange(count), triangles)
    if unused.size:
        problem = f"belong to no triangle ({unused.size} of {count})"
        raise MeshError("vertices", problem, unused[:5].tolist(), "remove them, or read it with `merge`")
    _refuse_touching_fans(triangles, count)


def _refuse_touching_fans(triangles: Indices, count: int) -> None:
    """Refuse vertices at which parts of the surface touch without a common edge."""
    halves = topology.hinge_half_edges(topology.twins(triangles))
    first, second = halves.T
    after_first, after_second = (3 * (half // 3) + (half + 1) % 3 for half in (first, second))
    meet = np.vstack([np.column_stack([first, after_second]), np.column_stack([after_first, second])])
    fans = topology.components(3 * len(triangles), meet)  # of corners at one vertex, joined across edges
    roots = triangles.ravel()[np.unique(fans)]
    touching = np.flatnonzero(np.bincount(roots, minlength=count) > 1)
    if touching.size:
        problem = f"join parts that share no edge ({_more(touching)})"
        raise MeshError("vertices", problem, touching[:5].tolist(), "give each part a vertex of its own there")


def refuse_flat_or_clockwise(corners: Array) -> None:
    """Refuse triangles without area or clockwise in the material (m, 3, 2).

    Raises:
        MeshError: naming the first such triangle.
    """
    areas = signed_areas(corners)
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(-1).max(axis=1)
    flat = np.flatnonzero(np.abs(areas) <= NO_AREA * longest)
    if flat.size:
        problem = f"gives triangle {flat[0]} no area ({_more(flat)})"
        raise MeshError("material", problem, corners[flat[0]].tolist(), "remove or merge such triangles")
    inverted = np.flatnonzero(areas < 0)
    if inverted.size == len(areas):
        fix = "reverse the corners of all triangles, or the sign of the second coordinate"
        raise MeshError("material", "is clockwise in every triangle", f"{inverted.size} triangles", fix)
    if inverted.size:
        problem = f"inverts triangle {inverted[0]} ({_more(inverted)})"
        raise MeshError("material", problem, corners[inverted[0]].tolist(), "make every triangle counter-clockwise")


def _more(found: NDArray[np.generic]) -> str:
    return "the only one" if len(found) == 1 else f"the first of {len(found)}"
