"""Smooth positions and velocities of a recorded motion."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
FEWEST = 5  # frames that a parabola is fitted to


def smoothed(times: Array, positions: Array, width: float) -> tuple[Array, Array]:
    """Values and slopes of the parabola fitted around each frame (Savitzky & Golay 1964), one-sided at the ends.

    Args:
        times: (frames,) s, increasing; the intervals need not be equal.
        positions: (frames, ...) finite.
        width: s; fewer than five frames leave the positions as they are, with central differences.
    """
    step = float(np.median(np.diff(times)))
    frames = min(2 * round(width / step / 2) + 1, len(times) - (1 - len(times) % 2))
    if frames < 5:
        return positions, np.gradient(positions, times, axis=0)
    first = np.clip(np.arange(len(times)) - frames // 2, 0, len(times) - frames)
    unit = step * (frames // 2)
    powers = ((times[first[:, None] + np.arange(frames)] - times[:, None]) / unit)[..., None] ** np.arange(3)
    fit = np.linalg.pinv(powers)  # (frames, 3, window): value, slope and half the bend from the window's samples
    value, slope = sum(np.einsum("nc,n...->cn...", fit[:, :2, k], positions[first + k]) for k in range(frames))
    return value, slope / unit


def state_at(times: Array, positions: Array, at: float, width: float) -> tuple[Array, Array]:
    """Positions and velocities (markers, 3) of the parabola through the frames within `width` s about a time; NaN for
    markers that are seen in fewer than `FEWEST` of them.

    Args:
        times: (frames,) s, increasing.
        positions: (frames, markers, 3) m, NaN = not seen.
    """
    order = np.argsort(np.abs(times - at), kind="stable")
    near = np.sort(order[: max(FEWEST, int((np.abs(times - at) <= width / 2).sum()))])
    x, v = (np.full(positions.shape[1:], np.nan) for _ in range(2))
    for marker in range(positions.shape[1]):
        seen = near[~np.isnan(positions[near, marker, 0])]
        if len(seen) >= FEWEST:
            unit = float(np.ptp(times[seen])) / 2
            powers = np.vander((times[seen] - at) / unit, 3, increasing=True)
            x[marker], v[marker], _ = np.linalg.lstsq(powers, positions[seen, marker], rcond=None)[0]
            v[marker] /= unit
    return x, v
