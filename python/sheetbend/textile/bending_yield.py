"""From a loop of bending to the yield of a cloth (`sb.add_cloth`): its whole stiffness, the share of it that slides,
and the curvature beyond which it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.timeseries import Array
from ..errors import InputError
from .curve import Curve
from .kes import check_test
from .reading import GRAM_FORCE, Reading

_TRIALS = 60  # yield curvatures of a round; each round looks closer about the best of the last
_ROUNDS = 6
_LEAST = 1e-3  # of the range of curvatures
_MOST_LEFT = 0.5  # of the height of a loop: beyond it there is none to see


@dataclass(frozen=True)
class BendingYield:
    """Result of `bending_yield`.

    Attributes:
        bending: B of small motion, as `add_cloth` takes it: the slope after a turn. KES reads (1 - yield_share) B.
        yield_share: the part of B that slides.
        yield_curvature: how far fibers bend before they slide.
        offset: the moment at zero curvature before anything slid: of a rest curvature, or the instrument's zero.
        misfit: root mean square of what the law leaves of the moments, over the height of the loop, 2HB.
    """

    bending: Reading
    yield_share: Reading
    yield_curvature: Reading
    offset: Reading
    misfit: float


def bending_yield(curve: Curve) -> BendingYield:
    """Fit a spring beside one that slides to all points of a curve in their order, by least squares.

    M = B (kappa - share set) + offset, where the set, zero at first, follows the curvature at the distance
    `yield_curvature`. After a turn the slope is B, and (1 - share) B from twice the yield curvature on; the loop is
    2 share B yield_curvature high. A fabric whose fibers begin to slide one after another has rounded corners, which
    `misfit` shows.

    Args:
        curve: of bending, from the unbent specimen on, with at least one turn.

    Raises:
        InputError: no test of bending, one that never turns back, or one without the loop of a spring that slides.
    """
    check_test(curve, "bending")
    if len(curve.branches()) < 2:
        raise InputError(curve.name, "never turns back", "one way", "give a test that goes there and back")
    widest = 0.5 * float(np.ptp(curve.deformation))  # beyond it nothing slides on the way back
    trials = 2.0 * widest * np.geomspace(_LEAST, 0.5, _TRIALS)
    for _ in range(_ROUNDS):
        solved = [_linear(curve, own) for own in _sets(curve.deformation, trials)]
        best = int(np.argmin([squares for _, squares in solved]))
        (bending, slides, offset), squares = solved[best]
        yield_curvature = float(trials[best])
        trials = np.linspace(trials[max(best - 1, 0)], trials[min(best + 1, _TRIALS - 1)], _TRIALS)
    height, left = 2.0 * slides * yield_curvature, float(np.sqrt(squares / len(curve.load)))
    if not (0.0 < slides < bending and yield_curvature < widest and left < _MOST_LEFT * height):
        wrong = f"a height of {height:.3g} N, of which {left:.3g} N rms are left"
        fix = "give a test that bends on in both directions after its slope has fallen, or leave out the yield"
        raise InputError(curve.name, "has no loop of a spring that slides", wrong, fix)
    return BendingYield(
        Reading(bending, "N m", {}, "gf cm^2/cm", 100.0 / GRAM_FORCE),
        Reading(slides / bending, "", {}, "", 1.0),
        Reading(yield_curvature, "1/m", {}, "1/cm", 0.01),
        Reading(offset, "N", {}, "gf cm/cm", 1.0 / GRAM_FORCE),
        left / height,
    )


def _sets(curvature: Array, yields: Array) -> Array:
    """(yields, points) what has slid along a path, for each yield curvature; exact between turns."""
    found = np.zeros((len(curvature), len(yields)))
    slid = np.zeros(len(yields))
    for k, kappa in enumerate(curvature):
        slid = np.clip(slid, kappa - yields, kappa + yields)
        found[k] = slid
    return found.T


def _linear(curve: Curve, slid: Array) -> tuple[tuple[float, float, float], float]:
    """B, share B and the offset that fit the moments best, and the sum of squares that they leave."""
    columns = np.column_stack([curve.deformation, -slid, np.ones(len(slid))])
    scale = np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
    found, *_ = np.linalg.lstsq(columns / scale, curve.load)
    left = curve.load - columns / scale @ found
    bending, slides, offset = (float(v) for v in found / scale)
    return (bending, slides, offset), float(left @ left)
