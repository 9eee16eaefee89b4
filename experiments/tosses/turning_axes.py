"""Recordings whose axes turn about z against the table: how fast, and the same motion in axes that do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sheetbend.arrays.rotations import matrices_of, quaternions_of, rotation_matrix

Path = tuple[np.ndarray, np.ndarray, Sequence[np.ndarray]]


def steady(
    times: np.ndarray, positions: np.ndarray, quaternions: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray]:
    """Poses (frames, 3) m and (frames, 4) in axes that do not turn; those of the recording do at a rate, rad/s."""
    back = np.array([rotation_matrix("turn", (0.0, 0.0, -rate * t)) for t in times])
    return np.einsum("tab,tb->ta", back, positions), quaternions_of(back @ matrices_of(quaternions))


def turning(paths: Sequence[Path]) -> tuple[float, float]:
    """The rate, rad/s, and its 95 % half-width by linear least squares, from paths of points in free flight: times
    (frames,) s at even steps, places (frames, 3) m, and more columns (frames, 3) that they may have a share of.

    Every flight has a start and a velocity of its own. Gravity, drag, the shares and the rate are common to all.
    """
    columns, right = [], []
    for times, x, more in paths:
        t = times[:, None]
        travelled = np.vstack([np.zeros(3), np.cumsum(0.5 * (x[1:] + x[:-1]), axis=0)]) * (times[1] - times[0])
        shared = [-0.5 * t**2 * [0.0, 0.0, 1.0], -travelled, *more, t * np.cross([0.0, 0.0, 1.0], x)]
        own = np.linalg.qr(np.kron(np.hstack([np.ones_like(t), t]), np.eye(3)))[0]
        every = np.stack([part.ravel() for part in (*shared, x)], axis=1)
        every -= own @ (own.T @ every)
        columns.append(every[:, :-1])
        right.append(every[:, -1])
    A, b = np.concatenate(columns), np.concatenate(right)
    found = np.linalg.lstsq(A, b)[0]
    left = b - A @ found
    variance = left @ left / (len(b) - 6 * len(paths) - len(found)) * np.linalg.inv(A.T @ A)[-1, -1]
    return float(found[-1]), 1.96 * float(np.sqrt(variance))
