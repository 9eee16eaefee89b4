"""Markers on a sheet: which hang together, and how they lie on the flat fabric."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
REACH = 2.3  # times the nearest neighbor's distance: markers that are so near are neighbors along the fabric


def spacing(apart: Array) -> float:
    return float(np.median((apart + np.where(np.eye(len(apart)) > 0, np.inf, 0.0)).min(axis=1)))


def connected(apart: Array) -> list[int]:
    """The largest set of markers that hang together by near neighbors."""
    near = apart < REACH * spacing(apart)
    left, best = set(range(len(near))), list[int]()
    while left:
        group, border = set[int](), [min(left)]
        while border:
            k = border.pop()
            if k in left:
                left.remove(k)
                group.add(k)
                border += [int(j) for j in np.flatnonzero(near[k])]
        if len(group) > len(best):
            best = sorted(group)
    return best


def flattened(apart: Array) -> Array:
    """(markers, 2) m on the flat fabric: distances along the fabric by shortest paths (Tenenbaum, de Silva & Langford
    2000, Science 290, 2319), and classical scaling of these."""
    path = np.where(apart < REACH * spacing(apart), apart, np.inf)
    np.fill_diagonal(path, 0.0)
    for k in range(len(path)):
        path = np.minimum(path, path[:, [k]] + path[[k]])
    # a straight way over the fabric is never shorter than what was seen between two markers, nor much longer
    path = np.maximum(apart, np.minimum(path, 1.1 * apart))
    n = len(path)
    centered = np.eye(n) - 1.0 / n
    values, vectors = np.linalg.eigh(-0.5 * centered @ path**2 @ centered)
    flat = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0))
    angles = np.linspace(0.0, np.pi / 2, 91)[:-1]
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    best = min(turns, key=lambda turn: float(np.prod(np.ptp(flat @ turn, axis=0))))
    return np.asarray(flat @ best)


def placed(flat: Array, x: Array, up: Array) -> tuple[Array, Array, Array]:
    """Where the flat fabric lies best on the markers (k, 3): the place of its lower left corner, its axes (2, 3), and
    the layout (k, 2) turned so that its y axis points up, from that corner."""
    seen = ~np.isnan(x[:, 0])
    for turn in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
        turned = flat @ np.array([[c, -s], [s, c]])
        mean, center = turned[seen].mean(axis=0), x[seen].mean(axis=0)
        u, _, vt = np.linalg.svd((turned[seen] - mean).T @ (x[seen] - center), full_matrices=False)
        axes = u @ vt
        if axes[1] @ up >= abs(axes[0] @ up) - 1e-9:
            break
    corner = turned.min(axis=0)
    return center + axes.T @ (corner - mean), axes, turned - corner
