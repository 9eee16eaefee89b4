"""A grid of bricks that carries a closed surface: a solid of any shape without a mesh of its inside."""

from __future__ import annotations

import numpy as np

from ..arrays.checks import check_kind, is_number
from ..arrays.types import Array
from ..errors import MeshError
from .solid_mesh import SolidMesh, bricks
from .triangle_mesh import TriangleMesh

_SAMPLES = 3  # along each side of a brick
_LEAST = 0.5 / _SAMPLES**3  # of a brick that the surface only touches
_ASIDE = 1e-6  # of a sample: off the edges of triangles that lie on the grid


def bricks_around(surface: TriangleMesh, size: float) -> SolidMesh:
    """Bricks of about one size that cover a closed surface. Each counts with the share of it that lies inside
    (`SolidMesh.fill`), found at 27 points of it.

    `on_solid(solid, surface.vertices)` are places on the surface. Several bricks across the thinnest part are needed,
    and details smaller than a brick have no shape of their own.

    Args:
        surface: closed, counterclockwise as seen from outside, such as `read_mesh` gives of an STL file.
        size: m, of the bricks' sides, about.

    Raises:
        MeshError: a surface with borders or inside out, or a size that is not positive.
    """
    check_kind("surface", surface, TriangleMesh, "give a closed mesh, such as sb.read_mesh(path)", MeshError)
    if len(surface.borders):
        problem = f"is not closed: {len(surface.borders)} edges have one triangle"
        raise MeshError("surface", problem, surface.borders[0].tolist(), "close its holes")
    if not (is_number(size) and size > 0):
        raise MeshError("size", "must be positive", size, "give the side of a brick in m")
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    cells = [max(1, round(float(n))) for n in (high - low) / size]
    box = bricks(high - low, cells, at=low)
    sides = (high - low) / cells
    lines = [
        o + (np.arange(_SAMPLES * n) + 0.5 + _ASIDE) * d / _SAMPLES for o, n, d in zip(low, cells, sides, strict=True)
    ]
    own = [part for n in cells for part in (n, _SAMPLES)]
    inside = np.moveaxis(_winding(surface, *lines).reshape(own), (1, 3, 5), (3, 4, 5)).reshape(np.prod(cells), -1)
    fill = np.clip(inside, 0.0, 1.0).mean(axis=1)
    if inside.min() < -0.5:
        raise MeshError("surface", "is turned inside out", float(inside.min()), "reverse its triangles")
    touched = np.unique(box.at(np.clip(surface.vertices, low, high)).elements)
    fill[touched] = np.maximum(fill[touched], _LEAST)
    kept = np.flatnonzero(fill > 0)
    used, elements = np.unique(box.elements[kept], return_inverse=True)
    place = np.full(len(box.vertices), -1)
    place[used] = np.arange(len(used))
    sets = {name: place[ids][place[ids] >= 0] for name, ids in box.sets.items()}
    return SolidMesh(box.vertices[used], elements.reshape(-1, 8), {k: v for k, v in sets.items() if len(v)}, fill[kept])


def _winding(surface: TriangleMesh, xs: Array, ys: Array, zs: Array) -> Array:
    """(xs, ys, zs) how often the surface winds around the points of a grid: 1 inside, 0 outside. A point counts the
    triangles above it, by the side that they turn to it."""
    found = np.zeros((len(xs), len(ys), len(zs)))
    for a, b, c in surface.vertices[surface.triangles]:
        u, v = b - a, c - a
        twice = u[0] * v[1] - u[1] * v[0]
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        i, j = (slice(*np.searchsorted(at, (low[k], high[k]))) for k, at in enumerate((xs, ys)))
        if twice == 0.0 or i.start == i.stop or j.start == j.stop:
            continue
        x, y = xs[i, None] - a[0], ys[None, j] - a[1]
        along_u, along_v = (x * v[1] - y * v[0]) / twice, (u[0] * y - u[1] * x) / twice
        hit = (along_u >= 0) & (along_v >= 0) & (along_u + along_v <= 1)
        height = a[2] + along_u * u[2] + along_v * v[2]
        found[i, j] += np.sign(twice) * (hit[..., None] & (zs < height[..., None]))
    return found
