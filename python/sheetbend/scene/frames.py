"""The material frames of a scene's edges: what directors and the normals of sections start as."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import SceneError

Frame = tuple[int, int, int | None]  # an edge from, to; the section's normal


def directors_of(
    edges: Array, directions: ArrayLike, normals: Array | None, x: Array, known: Mapping[int, Frame]
) -> tuple[Array, list[Frame]]:
    """(n, 3) and their frames; see `Scene.add_directors`. x: (nodes, 3) m; known: frames by director and normal."""
    ends = edges.reshape(-1, 2)
    q = finite("directions", directions, (len(ends), 3), SceneError)
    along = x[ends[:, 1]] - x[ends[:, 0]]
    across = np.linalg.norm(np.cross(along, q), axis=1)
    if (across <= 1e-9 * np.linalg.norm(along, axis=1) * np.linalg.norm(q, axis=1)).any():
        bad = int(np.argmin(across))
        raise SceneError("directions", f"lie along edge {bad}", q[bad].tolist(), "give a vector across the edge")
    axes: list[int | None] = [None] * len(ends)
    if normals is not None:
        axes = normals.tolist()
        wrong = [n for n in axes if n is None or known.get(n, (0, 0, None))[2] != n]
        if wrong or len(axes) != len(ends):
            raise SceneError("normals", "are not one for each edge", wrong, "give those of add_normals")
    return q, [(int(a), int(b), n) for (a, b), n in zip(ends, axes, strict=True)]


def normals_of(edges: Array, x: Array) -> tuple[Array, Array]:
    """Ends (n, 2) of edges, and unit vectors (n, 3) along them at x (nodes, 3) m; see `Scene.add_normals`."""
    ends = edges.reshape(-1, 2)
    along = x[ends[:, 1]] - x[ends[:, 0]]
    length = np.linalg.norm(along, axis=1)
    if not (length > 0).all():
        bad = int(np.argmin(length))
        raise SceneError("edges", f"edge {bad} has no length", ends[bad].tolist(), "move its particles apart")
    return ends, along / length[:, None]
