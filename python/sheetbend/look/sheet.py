"""Markers on a sheet: which hang together, and how they lie on the flat fabric."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array

LONGER = 1.1  # times what was seen between two markers: how much longer the way over the fabric may be
ROUNDS = 5  # of detours that are divided out
REACH = 2.3  # times the nearest neighbor's distance: markers that are so near are neighbors along the fabric


def spacing(apart: Array) -> float:
    return float(np.median((apart + np.where(np.eye(len(apart)) > 0, np.inf, 0.0)).min(axis=1)))


def components(apart: Array) -> list[list[int]]:
    """Markers that hang together by near neighbors, the largest set first."""
    near = apart < REACH * spacing(apart)
    left, found = set(range(len(near))), list[list[int]]()
    while left:
        group, border = set[int](), [min(left)]
        while border:
            k = border.pop()
            if k in left:
                left.remove(k)
                group.add(k)
                border += [int(j) for j in np.flatnonzero(near[k])]
        found.append(sorted(group))
    return sorted(found, key=len, reverse=True)


def flattened(apart: Array) -> Array:
    """(markers, 2) m on the flat fabric: distances along the fabric by shortest paths (Tenenbaum, de Silva & Langford
    2000, Science 290, 2319), and classical scaling of these.

    A path from neighbor to neighbor makes detours, 3 to 8 % between markers on a grid. How long they are is read off
    the flat layout itself, and divided out of the paths, a few times over.
    """
    near = apart < REACH * spacing(apart)
    path = _shortest(near, apart)
    flat = _scaled(np.clip(path, apart, LONGER * apart))
    for _ in range(ROUNDS):
        straight = np.linalg.norm(flat[:, None] - flat[None], axis=2)
        around = _shortest(near, straight)
        detour = np.where(straight > 0.0, around / np.where(straight > 0.0, straight, 1.0), 1.0)
        # a straight way over the fabric is never shorter than what was seen between two markers, nor much longer
        flat = _scaled(np.clip(path / detour, apart, LONGER * apart))
    angles = np.linspace(0.0, np.pi / 2, 91)[:-1]
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    best = min(turns, key=lambda turn: float(np.prod(np.ptp(flat @ turn, axis=0))))
    return np.asarray(flat @ best)


def _shortest(near: Array, length: Array) -> Array:
    """(n, n) m, of the shortest ways from neighbor to neighbor."""
    path = np.where(near, length, np.inf)
    np.fill_diagonal(path, 0.0)
    for k in range(len(path)):
        path = np.minimum(path, path[:, [k]] + path[[k]])
    return path


def _scaled(distance: Array) -> Array:
    """(n, 2) m, points whose distances are nearest to these: classical scaling."""
    n = len(distance)
    centered = np.eye(n) - 1.0 / n
    values, vectors = np.linalg.eigh(-0.5 * centered @ distance**2 @ centered)
    return np.asarray(vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0)))


def placed(flat: Array, x: Array, up: Array) -> tuple[Array, Array, Array]:
    """Where the flat fabric lies best on the markers (k, 3): the place of its lower left corner, its axes (2, 3), and
    the layout (k, 2) turned so that its y axis points up, from that corner."""
    seen = ~np.isnan(x[:, 0])
    for turn in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
        turned = flat @ np.array([[c, -s], [s, c]])
        axes, mean, center = laid(turned[seen], x[seen])
        if axes[1] @ up >= abs(axes[0] @ up) - 1e-9:
            break
    corner = turned.min(axis=0)
    return center + axes.T @ (corner - mean), axes, turned - corner


def laid(flat: Array, x: Array) -> tuple[Array, Array, Array]:
    """Axes (2, 3) along which points (k, 2) lie best on places (k, 3), and the means of both."""
    mean, center = flat.mean(axis=0), x.mean(axis=0)
    u, _, vt = np.linalg.svd((flat - mean).T @ (x - center), full_matrices=False)
    return u @ vt, mean, center
