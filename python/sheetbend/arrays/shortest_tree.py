"""The shortest tree through points, which shows how markers follow each other."""

from __future__ import annotations

from .types import Array


def tree(apart: Array, markers: tuple[int, ...]) -> tuple[dict[int, set[int]], float]:
    """The shortest tree through markers, as the neighbors of each, and its length (Prim 1957, Bell Syst. Tech. J. 36,
    1389)."""
    found: dict[int, set[int]] = {markers[0]: set()}
    nearest = {k: (float(apart[markers[0], k]), markers[0]) for k in markers[1:]}
    total = 0.0
    while nearest:
        b = min(nearest, key=lambda k: nearest[k])
        distance, a = nearest.pop(b)
        found[a].add(b)
        found[b] = {a}
        total += distance
        nearest = {k: min(near, (float(apart[b, k]), b)) for k, near in nearest.items()}
    return found, total
