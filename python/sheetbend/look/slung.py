"""The length of a slung cloth without tension, read off how its length changes with its sag.

A strip between two held sides carries its weight by its tension: T z'' = w (g + a)/g, with its weight per area w, its
curvature z'' and its acceleration a upward. Its length is that of the flat fabric times 1 + T/K, so a line through
length over tension gives both at T = 0 and by its slope. The weight only scales K.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays.smoothing import smoothed
from ..arrays.types import Array
from .seen import Seen

SMOOTH = 0.1  # s, over which the motion is smoothed
COLUMNS = 4  # of markers from one held side to the other, at least
VARIES = 1.3  # times its least: how much the tension varies at least, for a line through it
SHRINKS = 0.1  # of the length: by so much a fabric is stretched at most


class Slack(NamedTuple):
    """A slung cloth without tension.

    Attributes:
        length: m, from the first to the last column of markers.
        first: the same in the first frame, where it is stretched.
        stiffness: m^2/s^2, K per mass per area.
    """

    length: float
    first: float
    stiffness: float


def slack(s: Seen, own: list[int], flat: Array, apart: float) -> Slack | None:
    """What a cloth of markers that lie at flat (markers, 2) m, its x from one held side to the other, is without
    tension; None where its motion does not show it."""
    t, x = s.recording.times, s.recording.positions[:, own]
    columns = _columns(flat[:, 0], apart)
    if s.static or len(columns) < COLUMNS or len(t) < 10 or np.isnan(x).any():
        return None
    smooth, _ = smoothed(t, np.stack([x[:, column].mean(axis=1) for column in columns], axis=1), SMOOTH)
    length = np.linalg.norm(np.diff(smooth, axis=1), axis=2).sum(axis=1)
    gravity = float(np.linalg.norm(s.gravity))
    height = -smooth @ s.gravity / gravity
    level = smooth + height[..., None] * s.gravity / gravity
    along = np.linalg.norm(level - level[:, :1], axis=2)
    bend = np.array([2.0 * np.polyfit(a, h, 2)[0] for a, h in zip(along, height, strict=True)])
    _, speed = smoothed(t, height.mean(axis=1), SMOOTH)
    _, acceleration = smoothed(t, speed, SMOOTH)
    if (bend <= 0).any() or (gravity + acceleration <= 0).any():
        return None
    tension = (gravity + acceleration) / bend  # m^2/s^2, per mass per area
    if tension.max() < VARIES * tension.min():
        return None
    slope, without = np.polyfit(tension, length, 1)
    if slope <= 0 or without < (1.0 - SHRINKS) * length.min():
        return None
    return Slack(float(without), float(length[0]), float(without / slope))


def _columns(along: Array, apart: float) -> list[Array]:
    """Numbers of markers at about equal places along the cloth, from one end to the other."""
    order = np.argsort(along)
    return np.split(order, np.flatnonzero(np.diff(along[order]) > 0.5 * apart) + 1)
