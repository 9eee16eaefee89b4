"""Finds the yield of a cloth in shear (`sb.add_cloth`) from a loop of a shear test: the whole shear stiffness, the
share of it that slides, and the shear strain beyond which it slides."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.checks import is_number
from ..errors import InputError
from ..result.estimate import Estimate
from .curve import Curve
from .kes import check_test
from .reading import GRAM_FORCE, Reading
from .sliding import fit_sliding

_PER_DEGREE = math.radians(0.01 / GRAM_FORCE)  # gf/(cm deg) per N/m


@dataclass(frozen=True)
class ShearYield:
    """Result of `shear_yield`.

    Attributes:
        shear: G at small strain, as `add_cloth` takes it: the slope after a turn, minus the tension. KES reads
            (1 - yield_shear_share) G plus the tension.
        yield_shear_share: the part of G that slides.
        yield_shear: the shear strain (tangent of the angle) beyond which yarns slide.
        hysteresis: height of the loop, 2 yield_shear_share shear yield_shear: 2HG where yarns slide in both directions.
        offset: the force at zero angle before anything has slid.
        misfit: root mean square of the residual forces, divided by the height of the loop.
        estimates: shear, yield_shear_share and yield_shear with their 95 % intervals.
    """

    shear: Reading
    yield_shear_share: Reading
    yield_shear: Reading
    hysteresis: Reading
    offset: Reading
    misfit: float
    estimates: tuple[Estimate, ...]


def shear_yield(curve: Curve, *, tension: float = 1e3 * GRAM_FORCE) -> ShearYield:
    """Fit a spring, parallel to a spring that slides, to all points of a loop of shear by least squares.

    The force per width is F = G (s - share set) + tension s + offset. The shear strain s is the tangent of the angle.
    The set is zero at first and follows s at the distance `yield_shear`. After a turn the slope is G + tension; beyond
    twice the yield it is (1 - share) G + tension. If yarns lock, or begin to slide one after another, the hysteresis
    of a KES test differs between 0.5 degrees (2HG) and 5 degrees (2HG5). `misfit` shows this.

    Args:
        curve: a shear test that starts at the unsheared specimen and has at least one turn.
        tension: across the jaws, N/m, constant during the test. Default: that of KES-FB1, 10 gf/cm. 0 for none.

    Raises:
        InputError: no test of shear, one that never turns back, or one without the loop of a spring that slides.
        MissingExtraError: scipy is not installed.
    """
    check_test(curve, "shear")
    if not (is_number(tension) and tension >= 0.0):
        raise InputError("tension", "must not be negative", tension, "give N/m, 0 for none")
    names, units = ("shear", "yield_shear_share", "yield_shear"), ("N/m", "N/m", "")
    found = fit_sliding(curve, np.tan(curve.deformation), names, units, tension)
    height = 2.0 * found.share.value * found.stiffness.value * found.distance.value
    return ShearYield(
        Reading(found.stiffness.value, "N/m", {}, "gf/(cm deg)", _PER_DEGREE),
        Reading(found.share.value, "", {}, "", 1.0),
        Reading(found.distance.value, "", {}, "%", 100.0),
        Reading(height, "N/m", {}, "gf/cm", 0.01 / GRAM_FORCE),
        Reading(found.offset, "N/m", {}, "gf/cm", 0.01 / GRAM_FORCE),
        found.misfit,
        found.estimates,
    )
