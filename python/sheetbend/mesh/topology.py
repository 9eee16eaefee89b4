"""Which triangles meet where: half-edges, edges, hinges, borders.

Half-edge 3 t + j of triangle t leads from its corner j to its corner j + 1; its opposite corner is j + 2 (modulo 3).
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Indices


def half_edges(triangles: Indices) -> Indices:
    """(3 m, 2) start and end of every half-edge."""
    return triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def opposite(triangles: Indices) -> Indices:
    """(3 m,) the vertex opposite to every half-edge."""
    return triangles[:, [2, 0, 1]].ravel()


def edges(triangles: Indices) -> Indices:
    """(e, 2) every edge once, lower vertex first, sorted."""
    return np.unique(np.sort(half_edges(triangles), axis=1), axis=0)


def twins(triangles: Indices) -> Indices:
    """(3 m,) the half-edge on the other side of the same edge, or -1 on the border.

    The triangles must be manifold: at most two on an edge.
    """
    pairs = np.sort(half_edges(triangles), axis=1)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    same = np.flatnonzero((pairs[order[1:]] == pairs[order[:-1]]).all(axis=1))
    found = np.full(len(pairs), -1, dtype=np.int64)
    found[order[same]] = order[same + 1]
    found[order[same + 1]] = order[same]
    return found


def hinge_half_edges(twin: Indices) -> Indices:
    """(k, 2) the two half-edges of every interior edge, lower index first."""
    first = np.flatnonzero(twin > np.arange(len(twin)))
    return np.column_stack([first, twin[first]])


def hinges(triangles: Indices, twin: Indices) -> Indices:
    """(k, 4) [v0, v1, a, b] of every interior edge: the mesh holds (v0, v1, a) and (v1, v0, b), turned so."""
    first, second = hinge_half_edges(twin).T
    across = opposite(triangles)
    return np.column_stack([half_edges(triangles)[first], across[first], across[second]])


def loops(borders: Indices) -> tuple[Indices, ...]:
    """The vertices of every closed border, in order, each from its lowest vertex.

    Args:
        borders: (b, 2) directed border edges; every vertex at most once as a start.
    """
    follows = dict(borders.tolist())
    found = []
    for start in sorted(follows):
        loop, vertex = [], start
        while vertex in follows:
            loop.append(vertex)
            vertex = follows.pop(vertex)
        if loop:
            found.append(np.array(loop, dtype=np.int64))
    return tuple(found)


def components(count: int, pairs: Indices) -> Indices:
    """(count,) the lowest item that each item is connected to.

    Args:
        pairs: (p, 2) items that are connected.
    """
    label = np.arange(count)
    while True:
        lowest = label.copy()
        low = label[pairs].min(axis=1)
        for side in (0, 1):
            np.minimum.at(lowest, label[pairs[:, side]], low)
        lowest = lowest[lowest]
        if np.array_equal(lowest, label):
            return label
        label = lowest
