"""When what holds a rope lets it go: from then on it falls freely."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from ..arrays.smoothing import smoothed
from .seen import Seen, motion_of

SMOOTH = 0.06  # s, over which the acceleration is a mean
FALLS = 0.25  # of gravity: how near to it the acceleration is of what falls
LONG = 0.2  # s, of free fall at least: a hand that moves down does not follow it for so long


def released(s: Seen, markers: tuple[int, ...]) -> float | None:
    """s, the time at which markers begin to fall freely, on average; None where they never do."""
    t = s.recording.times
    _, velocity = motion_of(s.recording)
    mean = velocity[:, list(markers)].mean(axis=1)
    known = np.flatnonzero(np.isfinite(mean).all(axis=1))
    if len(known) < 8:
        return None
    _, acceleration = smoothed(t[known], mean[known, None], SMOOTH)
    off = np.linalg.norm(acceleration[:, 0] - s.gravity, axis=1)
    falling = off < FALLS * np.linalg.norm(s.gravity)
    for falls, frames in groupby(range(len(known)), key=lambda k: bool(falling[k])):
        some = list(frames)
        if falls and t[known[some[-1]]] - t[known[some[0]]] > LONG:
            return float(t[known[some[0]]]) - SMOOTH / 2
    return None
