"""Fits a spring, parallel to a spring that slides, to a loop. `bending_yield` and `shear_yield` use it.

    load = K (x - share set) + taken x + offset

The set is zero at first and follows the deformation x at a distance. It models friction between fibers or yarns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..quantities.parameters import Parameter
from ..result.estimate import Estimate
from ..statistics.covariance import covariance
from ..statistics.intervals import closed_estimate, critical_t
from .curve import Curve

_TRIALS = 60  # distances of a round; each round looks closer about the best of the last
_ROUNDS = 6
_LEAST = 1e-3  # of the range of deformations
_MOST_LEFT = 0.5  # of the height of a loop: beyond it there is none to see


@dataclass(frozen=True)
class Sliding:
    """The spring and the spring that slides, as a loop shows them.

    Attributes:
        stiffness, share, distance: K, the part of it that slides, and the distance of the set; 95 % intervals from what
            the law leaves of the loads, whose neighbors may go together.
        offset: the load without deformation before anything slid.
        misfit: root mean square of the residual loads, divided by the height of the loop.
    """

    stiffness: Estimate
    share: Estimate
    distance: Estimate
    offset: float
    misfit: float

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Stiffness, share and distance."""
        return self.stiffness, self.share, self.distance


def fit_sliding(
    curve: Curve, x: Array, names: tuple[str, str, str], units: tuple[str, str, str], taken: float = 0.0
) -> Sliding:
    """Fit a spring, parallel to a spring that slides, to all points of a loop by least squares.

    Args:
        x: (points,) the deformation in which the law is linear.
        names: of stiffness, share and distance.
        units: of the load, the stiffness and the distance.
        taken: a part of the slope that is not stiffness of the specimen, such as that of a tension.

    Raises:
        InputError: a test that never turns back, or one without the loop of a spring that slides.
        MissingExtraError: scipy is not installed.
    """
    if len(curve.branches()) < 2:
        raise InputError(curve.name, "never turns back", "one way", "give a test that goes there and back")
    load = curve.load - taken * x
    widest = 0.5 * float(np.ptp(x))  # beyond it nothing slides on the way back
    trials = 2.0 * widest * np.geomspace(_LEAST, 0.5, _TRIALS)
    for _ in range(_ROUNDS):
        solved = [_linear(load, x, own) for own in _sets(x, trials)[0]]
        best = int(np.argmin([squares for _, squares in solved]))
        (stiffness, slides, offset), squares = solved[best]
        distance = float(trials[best])
        trials = np.linspace(trials[max(best - 1, 0)], trials[min(best + 1, _TRIALS - 1)], _TRIALS)
    height, left = 2.0 * slides * distance, math.sqrt(squares / len(load))
    if not (0.0 < slides < stiffness and distance < widest and left < _MOST_LEFT * height):
        wrong = f"a height of {height:.3g} {units[0]}, of which {left:.3g} {units[0]} rms are left"
        fix = "give a test that goes on in both directions after its slope has fallen, or leave out the yield"
        raise InputError(curve.name, "has no loop of a spring that slides", wrong, fix)
    found = (stiffness, slides / stiffness, distance)
    reach = _reach(load, x, found, offset)
    parameters = (
        Parameter(name=names[0], initial=found[0], unit=units[1], log=True),
        Parameter(name=names[1], initial=found[1], lower=0.0, upper=1.0, scale=1.0),
        Parameter(name=names[2], initial=found[2], unit=units[2], log=True),
    )
    K, part, at = map(_estimate, parameters, found, reach)
    return Sliding(K, part, at, offset, left / height)


def _estimate(parameter: Parameter, value: float, reach: float) -> Estimate:
    """`reach`: half-width in the internal coordinate."""
    internal = parameter.to_internal(value)
    lower, upper = (parameter.to_physical(internal + end) for end in (-reach, reach))
    return closed_estimate(parameter, value, max(lower, parameter.lower), min(upper, parameter.upper))


def _sets(x: Array, distances: Array) -> tuple[Array, Array]:
    """(distances, points) what has slid along a path, exact between turns, and its derivative with respect to the
    distance."""
    found, derivative = np.zeros((len(x), len(distances))), np.zeros((len(x), len(distances)))
    slid, by_distance = np.zeros(len(distances)), np.zeros(len(distances))
    for k, at in enumerate(x):
        by_distance = np.where(slid < at - distances, -1.0, np.where(slid > at + distances, 1.0, by_distance))
        slid = np.clip(slid, at - distances, at + distances)
        found[k], derivative[k] = slid, by_distance
    return found.T, derivative.T


def _linear(load: Array, x: Array, slid: Array) -> tuple[tuple[float, float, float], float]:
    """K, share K and the offset that fit the loads best, and the sum of squares that they leave."""
    columns = np.column_stack([x, -slid, np.ones(len(slid))])
    scale = np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
    found, *_ = np.linalg.lstsq(columns / scale, load)
    left = load - columns / scale @ found
    stiffness, slides, offset = (float(v) for v in found / scale)
    return (stiffness, slides, offset), float(left @ left)


def _reach(load: Array, x: Array, found: tuple[float, float, float], offset: float) -> list[float]:
    """Half-widths of ln K, the share and ln distance."""
    stiffness, share, distance = found
    slid, by_distance = (made[0] for made in _sets(x, np.array([distance])))
    left = load - stiffness * (x - share * slid) - offset
    size = float(np.abs(load).max())
    per = (stiffness * (x - share * slid), -stiffness * slid, -stiffness * share * distance * by_distance)
    told = covariance(left / size, np.column_stack([*per, np.full(len(x), size)]) / size)
    return [float(v) for v in (critical_t(told.degrees) * np.sqrt(np.diag(told.matrix)))[:3]]
