"""Recorded poses of a rigid body as markers on it, and the state that it starts a motion with."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite, numbers, vectors
from ..arrays.rotations import matrices_of, quaternions_of, rotation_matrix, rotation_vectors
from ..arrays.types import Array
from ..errors import RecordingError, SceneError

FEWEST = 2  # poses that show a velocity


def markers_of_poses(positions: ArrayLike, quaternions: ArrayLike, points: ArrayLike) -> Array:
    """(frames, k, 3) m, where points (k, 3) m of a body's frame are at poses.

    Args:
        positions: (frames, 3) m; NaN where the body was not seen.
        quaternions: (frames, 4), (x, y, z, w), from the body's axes to the recording's.

    Raises:
        RecordingError: shapes, or quaternions of no length.
    """
    x, q = _poses(positions, quaternions)
    p = np.atleast_2d(vectors("points", points, RecordingError))
    return np.asarray(x[:, None] + np.einsum("fab,kb->fka", matrices_of(q), p))


def start_of_poses(
    times: ArrayLike,
    positions: ArrayLike,
    quaternions: ArrayLike,
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    time: float | None = None,
) -> dict[str, Array]:
    """Compute the state that a body starts with from poses, for `Scene.add_body(..., **start_of_poses(...))`.

    Place and velocity are those of the parabola in a known gravity that fits the poses best, attitude and spin those of
    a constant angular velocity. Give few poses, so that this is a good approximation: four at 100 Hz or more.

    Args:
        times: (frames,) s.
        positions: (frames, 3) m, of the frame's origin; NaN where it was not seen.
        quaternions: (frames, 4), (x, y, z, w), from the body's axes to the world's.
        gravity: (3,) m/s^2 of a free flight; zero where the first poses are about straight and even.
        time: s, that of the state; the first of `times` by default.

    Returns:
        `at` (3,) m, `rotation` (3, 3), `velocity` (3,) m/s and `spin` (3,) rad/s.

    Raises:
        RecordingError: shapes, fewer than two poses, or poses that were not seen.
    """
    t = finite("times", times, None, RecordingError).ravel()
    try:
        check_increasing("times", t)
    except SceneError as error:
        raise RecordingError(error.field, error.problem, error.got, error.fix) from error
    x, q = _poses(positions, quaternions)
    if len(t) < FEWEST or len(x) != len(t) or not (np.isfinite(x).all() and np.isfinite(q).all()):
        fix = "give two or more poses that were seen, and as many times"
        raise RecordingError("positions", "do not show a state", (len(t), len(x)), fix)
    s = t - (t[0] if time is None else float(finite("time", time, (), RecordingError)))
    fall = 0.5 * np.outer(s**2, finite("gravity", gravity, (3,), RecordingError))
    frames = matrices_of(q)
    line = np.column_stack([np.ones_like(s), s])
    at, velocity = np.linalg.lstsq(line, x - fall, rcond=None)[0]
    first = frames[0]
    for _ in range(3):  # the attitude at the first time, from all poses
        turns = rotation_vectors(quaternions_of(frames @ first.T), np.zeros(3))
        turned, spin = np.linalg.lstsq(line, turns, rcond=None)[0]
        first = rotation_matrix("turned", turned) @ first
    return {"at": at, "rotation": first, "velocity": velocity, "spin": spin}


def _poses(positions: ArrayLike, quaternions: ArrayLike) -> tuple[Array, Array]:
    x, q = numbers("positions", positions, RecordingError), numbers("quaternions", quaternions, RecordingError)
    if x.ndim != 2 or x.shape[1] != 3 or q.shape != (len(x), 4):
        fix = "give positions (frames, 3) and quaternions (frames, 4)"
        raise RecordingError("poses", "have the wrong shape", (x.shape, q.shape), fix)
    size = np.linalg.norm(q, axis=1, keepdims=True)
    if (size == 0).any():
        raise RecordingError("quaternions", "have no length", int(np.argmin(size)), "give (x, y, z, w)")
    return x, q / size
