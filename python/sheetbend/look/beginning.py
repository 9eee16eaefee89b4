"""How a motion begins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.timeseries import mean_position
from .seen import Seen

QUIET = 0.6  # of the rest, in which nothing moves yet: its end is where the motion exceeds the noise
EARLY, LATEST = 0.05, 0.1  # s, in which the speed at the first frame is looked for, and where that is too few frames
FRAMES = 6  # that tell it


def lets_go(s: Seen, order: Sequence[int]) -> bool:
    """Whether the speeds of markers at the first frame are within what noise makes of none: a thing is let go there.
    The slope of a parabola through N frames in the time T has the standard deviation sigma sqrt(192 / N) / T at its
    end."""
    r = s.recording
    t = r.times - r.times[0]
    early = np.flatnonzero(t <= EARLY)
    if len(early) < FRAMES:
        early = np.flatnonzero(t <= LATEST)[:FRAMES]
    x = r.positions[early][:, list(order)]
    x = x[:, np.isfinite(x).all(axis=(0, 2))]
    if len(early) < FRAMES or not x.shape[1] or not s.noise:
        return False
    slope = np.linalg.lstsq(np.vander(t[early], 3, increasing=True), x.reshape(len(early), -1), rcond=None)[0][1]
    return bool(np.abs(slope).max() < 4.0 * s.noise * np.sqrt(192 / len(early)) / t[early[-1]])


def quiet_frame(s: Seen, markers: Sequence[int]) -> float:
    """s, of the frame at rest in which markers are nearest to their mean places there; the first one's without a rest.

    A model begins with its rope below the marker that holds it, where the first fitted frame shows this marker. Noise
    in that frame moves the whole rope, which then swings, and the fit explains the swing by a motion of the hand.
    """
    t = s.recording.times
    x = s.recording.positions[t <= t[0] + QUIET * s.rest][:, list(markers)]
    off = np.linalg.norm(x - mean_position(x), axis=2).max(axis=1)
    return float(t[0] if np.isnan(off).all() else t[int(np.nanargmin(off))])
