"""A disk and a sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays.checks import check_count, is_number
from ..arrays.types import Array, Indices
from ..errors import MeshError
from . import topology
from .triangle_mesh import TriangleMesh
from .unfold import unfold

MOST_RINGS, MOST_SPLITS = 1000, 9  # 6 and 5 million triangles


def disk(radius: float, rings: int, support: float | None = None) -> TriangleMesh:
    """A flat disk around the origin of the x-y plane; ring k has 6 k vertices.

    The border is a polygon of 6 `rings` sides inside of the circle. Its sixfold symmetry makes bending the same in all
    directions; vertices between the circles are moved to the mean of their neighbors, which brings `bending_ratio` from
    3.4 to within 4 % of 3 (10 to 40 rings).

    Sets: "center", "rim" (counter-clockwise), and with `support` all vertices on or inside of that circle.

    Args:
        radius: of the outer vertices, m.
        rings: at least 1.
        support: radius of a circle on which the nearest inner ring is put, m, such as the plate of a drape test.

    Raises:
        MeshError: a size that is not positive, or a support that has no ring of its own.
    """
    _check("radius", is_number(radius) and radius > 0, radius, "a positive length", "meters")
    check_count("rings", rings, 1, MOST_RINGS, MeshError)
    ring, angle, triangles = _rings(rings)
    at = float(radius) * ring / rings
    held = ring == rings
    sets = {"center": np.array([0]), "rim": np.flatnonzero(held)}
    if support is not None:
        inner = round(rings * support / radius) if is_number(support) else 0
        _check("support", 0 < inner < rings, support, "near a ring inside of the rim", "another radius or more rings")
        at[ring == inner] = support
        held |= ring == inner
        sets["support"] = np.flatnonzero(ring <= inner)
    flat = at[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    flat = _relaxed(flat, triangles, held, passes=10 * rings)
    return TriangleMesh(np.column_stack([flat, np.zeros(len(flat))]), triangles, flat, sets)


def _rings(rings: int) -> tuple[Indices, Array, Indices]:
    """Ring and angle of every vertex of a disk, and its triangles."""
    first = np.concatenate([[0], 1 + 3 * np.arange(rings + 1) * np.arange(1, rings + 2)])  # vertex of each ring
    ring = np.repeat(np.arange(rings + 1), np.diff(first))
    angle = 2 * np.pi * (np.arange(len(ring)) - first[ring]) / np.maximum(6 * ring, 1)
    triangles = []
    for k in range(1, rings + 1):
        sector, j = np.arange(6)[:, None], np.arange(k)
        inner = first[k - 1] + ((sector * (k - 1) + j) % max(6 * (k - 1), 1))
        outer, after = (first[k] + (sector * k + j + step) % (6 * k) for step in (0, 1))
        triangles.append(np.stack([outer, after, inner], axis=-1).reshape(-1, 3))
        triangles.append(np.stack([inner[:, :-1], after[:, :-1], inner[:, 1:]], axis=-1).reshape(-1, 3))
    return ring, angle, np.vstack(triangles)


def _relaxed(flat: Array, triangles: Indices, held: NDArray[np.bool_], passes: int) -> Array:
    """Vertices that are not held, moved to the mean of their neighbors again and again."""
    edges = topology.edges(triangles)
    start, end = np.vstack([edges, edges[:, ::-1]]).T
    neighbors = np.bincount(start)
    for _ in range(passes):
        mean = np.column_stack([np.bincount(start, flat[end, axis]) / neighbors for axis in (0, 1)])
        flat = np.where(held[:, None], flat, mean)
    return flat


def icosphere(radius: float, subdivisions: int) -> TriangleMesh:
    """A closed sphere around the origin: an icosahedron, every triangle split in four `subdivisions` times.

    Its material is unfolded per triangle (`unfold`), since no chart covers a sphere; the flat shapes are exact, and the
    warp direction jumps where the unfolded paths meet.

    Args:
        radius: of the vertices, m.
        subdivisions: 0 for the icosahedron.

    Raises:
        MeshError: a radius that is not positive, or a number that is not whole.
    """
    _check("radius", is_number(radius) and radius > 0, radius, "a positive length", "meters")
    check_count("subdivisions", subdivisions, 0, MOST_SPLITS, MeshError)
    vertices, triangles = _icosahedron()
    for _ in range(subdivisions):
        sides = triangles[:, [[0, 1], [1, 2], [2, 0]]]
        ends, index = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
        ab, bc, ca = (len(vertices) + index.reshape(-1, 3)).T
        a, b, c = triangles.T
        vertices = np.vstack([vertices, vertices[ends].mean(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
        parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        triangles = np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3)
    vertices = radius * vertices
    return TriangleMesh(vertices, triangles, unfold(vertices, triangles))


def _icosahedron() -> tuple[Array, Indices]:
    """Unit vertices: two poles and two rings of five; triangles seen from outside are counter-clockwise."""
    turn = 2 * np.pi * np.arange(5) / 5
    z, r = 1 / np.sqrt(5.0), 2 / np.sqrt(5.0)
    upper = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(5, z)])
    half = turn + np.pi / 5
    lower = np.column_stack([r * np.cos(half), r * np.sin(half), np.full(5, -z)])
    vertices = np.vstack([[[0.0, 0.0, 1.0]], upper, lower, [[0.0, 0.0, -1.0]]])
    i = np.arange(5)
    u, u1, w, w1 = 1 + i, 1 + (i + 1) % 5, 6 + i, 6 + (i + 1) % 5
    north, south = np.zeros(5, dtype=int), np.full(5, 11)
    parts = [[north, u, u1], [u, w, u1], [w, w1, u1], [south, w1, w]]
    return vertices, np.vstack([np.column_stack(part) for part in parts])


def _check(name: str, good: bool, value: float, must: str, give: str) -> None:
    if not good:
        raise MeshError(name, f"must be {must}", value, f"give {give}")
