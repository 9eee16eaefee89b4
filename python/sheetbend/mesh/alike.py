"""Triangles of a file turned one way round, where an exporter left them turned either way."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..arrays.types import Indices
from .topology import half_edges


def turned_alike(triangles: Indices) -> Indices:
    """(k,) which triangles to reverse so that neighbors run opposite ways along their common edge: the fewer ones of
    each part. None of a surface that has one side, or where more than two triangles meet on an edge."""
    directed = half_edges(triangles)
    _, edge, uses = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    if uses.max() > 2:
        return np.zeros(0, dtype=np.int64)
    order = np.argsort(edge.ravel(), kind="stable")
    shared = np.flatnonzero(np.diff(edge.ravel()[order]) == 0)
    first, second = order[shared], order[shared + 1]
    same = directed[first, 0] == directed[second, 0]  # both run the same way
    beside: list[list[tuple[int, bool]]] = [[] for _ in triangles]
    for a, b, turn in zip((first // 3).tolist(), (second // 3).tolist(), same.tolist(), strict=True):
        beside[a].append((b, turn))
        beside[b].append((a, turn))
    way: list[bool | None] = [None] * len(triangles)
    reverse: list[int] = []
    for seed in range(len(triangles)):
        if way[seed] is not None:
            continue
        part = _part(seed, beside, way)
        if part is None:
            return np.zeros(0, dtype=np.int64)
        other = [t for t in part if way[t]]
        reverse += other if 2 * len(other) <= len(part) else [t for t in part if not way[t]]
    return np.array(sorted(reverse), dtype=np.int64)


def _part(seed: int, beside: list[list[tuple[int, bool]]], way: list[bool | None]) -> list[int] | None:
    """The triangles that hang together with one, each with whether it runs the other way; None of one side."""
    way[seed], part, queue = False, [seed], deque([seed])
    while queue:
        t = queue.popleft()
        for other, turn in beside[t]:
            wanted = way[t] != turn
            if way[other] is None:
                way[other] = wanted
                part.append(other)
                queue.append(other)
            elif way[other] != wanted:
                return None
    return part
