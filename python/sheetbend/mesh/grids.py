"""Rectangles of triangles in the x-y plane, warp along x."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays.checks import check_count, is_number
from ..arrays.types import Indices
from ..errors import MeshError
from .triangle_mesh import TriangleMesh
from .validate import MOST_CELLS

PATTERNS = ("alternating", "crossed", "one_way")


def grid(width: float, height: float, nx: int, ny: int, pattern: str = "alternating") -> TriangleMesh:
    """nx x ny cells with their lower left corner at the origin.

    Sets: "left", "right", "bottom", "top" (each along its side) and "corners" (counter-clockwise from the origin).

    Args:
        width: along x, m.
        height: along y, m.
        nx, ny: number of cells along x and y.
        pattern: "alternating" turns the diagonal from cell to cell, "crossed" has both diagonals and a vertex in the
            middle of each cell (after all others), "one_way" has the same diagonal everywhere: the one for bending by
            the curvature model; hinges bend three times as hard along the diagonals as across them.

    Raises:
        MeshError: a size or a number that is not positive, or an unknown pattern.
    """
    _check_size(width, height)
    check_count("nx", nx, 1, MOST_CELLS, MeshError)
    check_count("ny", ny, 1, MOST_CELLS // nx, MeshError)
    if pattern not in PATTERNS:
        raise MeshError("pattern", "is unknown", pattern, f"use one of {', '.join(PATTERNS)}")
    x, y = np.meshgrid(np.linspace(0.0, width, nx + 1), np.linspace(0.0, height, ny + 1))
    flat = np.column_stack([x.ravel(), y.ravel()])
    index = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    a, b, c, d = (v.ravel() for v in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    if pattern == "crossed":
        center = len(flat) + np.arange(nx * ny)
        flat = np.vstack([flat, (flat[a] + flat[c]) / 2])
        cells = [[a, b, center], [b, c, center], [c, d, center], [d, a, center]]
    else:
        cells = [[a, b, c], [a, c, d]]
        if pattern == "alternating":
            turned = (np.add.outer(np.arange(ny), np.arange(nx)) % 2 == 1).ravel()
            cells = [[a, b, np.where(turned, d, c)], [np.where(turned, b, a), c, d]]
    triangles = np.stack([np.stack(corners, axis=1) for corners in cells], axis=1).reshape(-1, 3)
    return _flat_mesh(flat, triangles, index[:, 0], index[:, -1], index[0], index[-1])


def equilateral(width: float, height: float, n: int) -> TriangleMesh:
    """Rows of n nearly equilateral triangles' bases, straight sides, the lower left corner at the origin.

    The sides of the triangles along x are width / n; their height is stretched by up to half a row over `height`, so
    that the rows fill it. Every other row starts and ends with a half triangle. Sets as in `grid`. Hinges bend this
    mesh alike in all directions.

    Args:
        width: along x, m.
        height: along y, m.
        n: triangle sides along x.

    Raises:
        MeshError: a size or a number that is not positive.
    """
    _check_size(width, height)
    check_count("n", n, 1, MOST_CELLS, MeshError)
    side = width / n
    rows = max(1, round(height / (side * np.sqrt(3.0) / 2)))
    check_count("height over the side of a triangle", rows, 1, MOST_CELLS // n, MeshError)
    even = np.linspace(0.0, width, n + 1)
    odd = np.concatenate([[0.0], even[:-1] + side / 2, [width]])
    levels = [odd if j % 2 else even for j in range(rows + 1)]
    first = np.concatenate([[0], np.cumsum([len(level) for level in levels])])
    flat = np.vstack(
        [
            np.column_stack([x, np.full(len(x), y)])
            for x, y in zip(levels, np.linspace(0, height, rows + 1), strict=True)
        ]
    )
    triangles = []
    for j in range(rows):
        low, high = first[j], first[j + 1]
        i = np.arange(n + 1)
        if j % 2:  # n + 2 vertices below, n + 1 above
            triangles += [np.column_stack([low + i, low + i + 1, high + i])]
            triangles += [np.column_stack([low + i + 1, high + i + 1, high + i])[:-1]]
        else:
            triangles += [np.column_stack([low + i, high + i + 1, high + i])]
            triangles += [np.column_stack([low + i, low + i + 1, high + i + 1])[:-1]]
    left, right = first[:-1], first[1:] - 1
    return _flat_mesh(flat, np.vstack(triangles), left, right, np.arange(n + 1), np.arange(first[-2], first[-1]))


def _flat_mesh(
    flat: NDArray[np.float64], triangles: Indices, left: Indices, right: Indices, bottom: Indices, top: Indices
) -> TriangleMesh:
    sides = {"left": left, "right": right, "bottom": bottom, "top": top}
    corners = np.array([bottom[0], bottom[-1], top[-1], top[0]])
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    return TriangleMesh(vertices, triangles, flat, {**sides, "corners": corners})


def _check_size(width: float, height: float) -> None:
    for name, value in (("width", width), ("height", height)):
        if not (is_number(value) and value > 0):
            raise MeshError(name, "must be a positive length", value, "give meters")
