"""Which way the outer half of a rope that moves falls: down, up, or not at all.

A flexible rope carries no force across itself. So what is beyond a point of it balances across its direction there, as
in `end_load`: without a mass at the end, the integral of a - g has no part across it. With g upside down it has one,
and so it has with g in the plane of a table, which holds the rope against it.
"""

from __future__ import annotations

import numpy as np

from ..arrays.smoothing import smoothed
from ..arrays.timeseries import interpolate
from ..arrays.types import Array
from .end_load import FRAMES, across, beyond
from .seen import REST, Seen

FEWEST = 5  # markers on the rope, at least
CLEARLY = 0.5  # of what is left with the way that is taken for down: less is left with another one


def falls(s: Seen, order: tuple[int, ...]) -> int:
    """1 if a rope falls the way that is taken for down, whichever of its ends is free, or if the motion does not tell;
    -1 if gravity the other way explains much better how it moves; 0 if none does, as on a table seen from above."""
    t = s.recording.times
    x = interpolate(t, s.recording.positions[:, list(order)], t, "cubic", np.inf)
    whole = np.isfinite(x).all(axis=(1, 2))  # all but frames at both ends
    t, x = t[whole], x[whole]
    moving = t > s.recording.times[0] + s.rest
    if len(order) < FEWEST or moving.sum() < FRAMES:
        return 1
    x, speed = smoothed(t, x, REST / 2)
    _, acceleration = smoothed(t, speed, REST / 2)
    arc = s.along(order)
    ends = [(x[moving], acceleration[moving], arc), (x[moving, ::-1], acceleration[moving, ::-1], arc[-1] - arc[::-1])]
    left = {way: min(_left(*end, way * s.gravity) for end in ends) for way in (1, 0, -1)}
    best = min(left, key=lambda way: left[way])
    return best if left[best] < CLEARLY * left[1] else 1


def _left(x: Array, acceleration: Array, arc: Array, gravity: Array) -> float:
    """m/s^2, what does not balance across the rope in its outer half, root mean square: the median over markers."""
    parts = range(1, 1 + len(arc) // 2)
    each = [across(x, k, beyond(acceleration - gravity, arc, k)) / (arc[-1] - arc[k]) for k in parts]
    return float(np.median([np.sqrt(np.mean(np.sum(one**2, axis=1))) for one in each]))
