"""The shape of a profile of a cost between a few points near it.

Over the height of the linear picture, which is proportional to the distance, the height is a smooth function of the
height with its sign, 1 where that is zero. (Over the distance it is none where a profile flattens.) The way of the
other parameters is a line, and bends away by a smooth function of the distance times its square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array

FAR_OFF = 1.0  # of the rise: where the others leave more, a point tells little
LEAST = 0.05  # of the linear height: an interpolation below this is none
SAME = 0.1  # of a distance, or a height: nearer points tell no slope


@dataclass(frozen=True)
class Point:
    """A point near the profile.

    Attributes:
        t: distance of the held parameter from the estimate, internal.
        u: (p,) all parameters.
        r: (rows,) residuals.
        height: square root of the profile's rise there, over that at the end of the interval.
        slack: what the others' step would take off the cost, of the rise at the end.
        bend: (p,) how far the others are from the line of the linear picture behind that step, over t^2.
    """

    t: float
    u: Array
    r: Array
    height: float
    slack: float
    bend: Array


def telling(points: Sequence[Point], side: float) -> list[Point]:
    """Points of one side (-1 or 1), those that tell most of its end first."""
    return sorted((at for at in points if at.t * side > 0), key=lambda at: abs(at.height - 1.0) + at.slack)


def _two(points: Sequence[Point], side: float) -> list[Point]:
    every = telling(points, side) + telling(points, -side)
    return every[:1] + [at for at in every[1:] if at.slack <= FAR_OFF][:1]


def distance(points: Sequence[Point], side: float, reach: float, height: float = 1.0) -> float:
    """Distance at which the profile has a height on one side, by default that of the end; infinite where the heights do
    not rise so far.

    Args:
        reach: distance of the end in the linear picture.
    """
    near, factor = _two(points, side), 1.0
    z = [math.copysign(at.height, side * at.t) for at in near]
    slopes = [(at.height * reach / abs(at.t) - 1.0) / max(x, LEAST, key=abs) for x, at in zip(z, near, strict=True)]
    if near:
        factor += height * slopes[0]
    if len(near) == 2 and abs(z[1] - z[0]) > SAME:
        factor += height * (height - z[0]) * (slopes[1] - slopes[0]) / (z[1] - z[0])
    return height * reach / factor if factor > LEAST else math.inf


def bend(points: Sequence[Point], side: float, t: float) -> Array | float:
    """(p,) how far the others are from their line at a distance, over its square; zero before there is a point."""
    near = _two(points, side)
    if len(near) < 2:
        return near[0].bend if near else 0.0
    one, other = near
    return np.asarray(one.bend + (other.bend - one.bend) * ((t - one.t) / (other.t - one.t)))
