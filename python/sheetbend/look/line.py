"""Markers along a line: their order, the distances between them, and shapes that are straight or flat."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..arrays.shortest_tree import tree
from ..arrays.types import Array

SHORTER = 0.9  # of the length through the markers in the file's order: another order counts only if it is so short
TURNED = 0.8  # of the way over three neighbors: how far apart the outer ones are where a line turns by 74 degrees
AXIS, FLAT = 0.97, 0.02  # cosine of the angle to an axis that is taken for it; share of a length that is flat


def chain(apart: Array, markers: tuple[int, ...]) -> tuple[int, ...]:
    """Markers in order along a line: the file's order, unless another one is a tenth shorter."""
    if len(markers) < 3:
        return markers

    def length(order: tuple[int, ...]) -> float:
        return float(sum(apart[a, b] for a, b in pairwise(order)))

    best = markers
    for first in markers:
        order, left = [first], set(markers) - {first}
        while left:
            order.append(min(left, key=lambda k: apart[order[-1], k]))
            left.remove(order[-1])
        if length(tuple(order)) < SHORTER * length(best):
            best = tuple(order)
    return best


def turns_sharply(apart: Array, order: tuple[int, ...]) -> bool:
    """Whether a line through three or more markers turns back somewhere, as no rope between them does."""
    threes = zip(order[:-2], order[1:-1], order[2:], strict=True)
    return any(apart[a, c] < TURNED * (apart[a, b] + apart[b, c]) for a, b, c in threes)


def forks(apart: Array, order: tuple[int, ...]) -> tuple[list[int], float]:
    """Markers at which the shortest tree through all of them has three arms of two or more, and the length of the line
    through the markers in order, in lengths of this tree."""
    neighbors, total = tree(apart, order)
    at = [k for k, near in neighbors.items() if sum(len(neighbors[j]) > 1 for j in near) >= 3]
    return at, sum(float(apart[a, b]) for a, b in pairwise(order)) / max(total, 1e-300)


def snapped(direction: Array) -> list[float]:
    """A direction, that of a coordinate axis where it is within some 14 degrees of it."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) > AXIS:
        return [float(np.sign(direction[k])) if i == k else 0.0 for i in range(3)]
    return [round(float(v), 4) for v in direction]


def plane(x: Array, length: float) -> list[float] | None:
    """Unit normal of the plane that all markers stay in; None where there is none."""
    flat = x.reshape(-1, 3)
    flat = flat[~np.isnan(flat[:, 0])]
    _, spread, axes = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    if len(flat) < 4 or spread[2] / np.sqrt(len(flat)) > FLAT * length:
        return None
    normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
    return snapped(normal)


def tangent(x: Array, order: tuple[int, ...]) -> Array:
    """Unit direction at the first of the markers (markers, 3), from the parabola through the first three seen."""
    own = x[[k for k in order if not np.isnan(x[k, 0])][:3]]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(own, axis=0), axis=1))])
    slope = np.linalg.lstsq(np.vander(s, 3, increasing=True), own, rcond=None)[0][1]
    return np.asarray(slope / np.linalg.norm(slope))
