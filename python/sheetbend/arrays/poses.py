"""Poses of one rigid body over time: positions (poses, 3) m and unit quaternions (poses, 4), (x, y, z, w)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import SceneError
from .checks import check_increasing, finite
from .rotations import continuous, unit_quaternions
from .types import Array


def checked_poses(
    name: str, times: ArrayLike, positions: ArrayLike, quaternions: ArrayLike
) -> tuple[Array, Array, Array]:
    """Times (poses,) s, positions and quaternions as arrays, with each quaternion on the side of the one before, so
    that the rotations between two poses are between their quaternions.

    Args:
        name: of the poses, for errors.

    Raises:
        SceneError: shapes, NaN, times that do not increase, or quaternions of no length.
    """
    t = finite(f"{name}.times", times, None, SceneError).ravel()
    check_increasing(f"{name}.times", t)
    x = finite(f"{name}.positions", positions, (len(t), 3), SceneError)
    return t, x, continuous(unit_quaternions(f"{name}.quaternions", quaternions, (len(t), 4)))


def poses_at(times: Array, positions: Array, quaternions: Array, at: ArrayLike) -> tuple[Array, Array]:
    """Positions (..., 3) and unit quaternions (..., 4) at times `at` (...): linear between poses, constant outside.

    Args:
        times, positions, quaternions: as `checked_poses` returns them.
    """
    asked = np.asarray(at, dtype=float)
    right = np.clip(np.searchsorted(times, asked), 1, max(len(times) - 1, 1))
    left, right = right - 1, np.minimum(right, len(times) - 1)
    span = np.where(right > left, times[right] - times[left], 1.0)
    share = np.clip((asked - times[left]) / span, 0.0, 1.0)[..., None]
    x = (1.0 - share) * positions[left] + share * positions[right]
    q = (1.0 - share) * quaternions[left] + share * quaternions[right]
    return x, q / np.linalg.norm(q, axis=-1, keepdims=True)
