"""Steps from frame to frame that are too sudden for a marker on a rope or a cloth. What is seen after such a step is
another marker, or a reflection."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import noise
from ..arrays.types import Array

Mask = NDArray[np.bool_]

JUMP = 0.05  # of the size of what is recorded: what a step from frame to frame must go beyond the usual one
SUDDEN = 200.0  # m/s^2, the same where frames are far apart in time
NOISY = 8.0  # times the noise of a marker, in all three coordinates: what a leap must go beyond too
AWAY = 0.5  # of the larger of two jumps: how large their sum is at most where a marker goes elsewhere and comes back


def least_leap(times: Array, size: float) -> float:
    """m, the shortest leap between two frames that no marker makes on something of this size, m."""
    return max(JUMP * size, SUDDEN * float(np.median(np.diff(times))) ** 2)


def leaps(times: Array, track: Array) -> Array:
    """(frames - 1, 3) m, each step of a track (frames, 3) beyond what the median velocity about it gives."""
    apart = np.diff(times)[:, None]
    if not len(apart):
        return np.zeros((0, 3))
    velocity = np.diff(track, axis=0) / apart
    usual = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(velocity, ((2, 2), (0, 0)), "edge"), 5, 0), -1)
    return np.asarray((velocity - usual) * apart)


def elsewhere(times: Array, track: Array, least: float) -> Mask:
    """(frames,) where a marker (frames, 3) is not on the path that its longest stretch without jumps belongs to.

    Args:
        times: (frames,) s.
        track: (frames, 3) m.
        least: m, of a leap of a marker without noise.
    """
    seen = np.flatnonzero(np.isfinite(track[:, 0]))
    stray = np.zeros(len(times), dtype=bool)
    if len(seen) < 6:
        return stray
    x, t = track[seen], times[seen]
    unsure = float(np.nan_to_num(noise(t, x[:, None])[0]))  # m, in one coordinate
    least = max(least, NOISY * np.sqrt(3.0) * unsure)
    own, speed = leaps(t, x), np.linalg.norm(np.diff(x, axis=0), axis=1) / np.diff(t)
    bounds = [0, *(np.flatnonzero(np.linalg.norm(own, axis=1) > least) + 1).tolist(), len(seen)]
    stretches = list(pairwise(bounds))
    best = max(range(len(stretches)), key=lambda i: stretches[i][1] - stretches[i][0])
    fastest = float(speed[stretches[best][0] : stretches[best][1] - 1].max(initial=0.0))

    def reached(a: int, b: int) -> bool:
        return bool(np.linalg.norm(x[a] - x[b]) <= least + fastest * abs(t[a] - t[b]))

    def made(a: int, b: int) -> Array:
        """(3,) m, of the jumps from frame a to frame b together."""
        return np.asarray(own[[k - 1 for k in bounds[1:-1] if a < k <= b]].sum(axis=0))

    def returned(a: int, b: int, since: int, until: int) -> bool:
        """Whether the jumps into a stretch, from frame `since` of the path, and those out of it to `until` cancel: no
        rope makes either."""
        if a == 0 or b == len(seen):
            return False
        there, back = made(since, a), made(b - 1, until)
        return bool(np.linalg.norm(there + back) < AWAY * max(np.linalg.norm(there), np.linalg.norm(back)))

    first, last = stretches[best]
    good = [stretches[best]]
    for a, b in stretches[best + 1 :]:
        if reached(last - 1, a) and not returned(a, b, last - 1, b):
            last = b
            good.append((a, b))
    for a, b in reversed(stretches[:best]):
        if reached(first, b - 1) and not returned(a, b, a - 1, first):
            first = a
            good.append((a, b))
    stray[seen] = True
    for a, b in good:
        stray[seen[a:b]] = False
    return stray
