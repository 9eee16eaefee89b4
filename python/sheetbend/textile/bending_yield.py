"""From a loop of bending to the yield of a cloth (`sb.add_cloth`): its whole stiffness, the share of it that slides,
and the curvature beyond which it does."""

from __future__ import annotations

from dataclasses import dataclass

from ..result.estimate import Estimate
from .curve import Curve
from .kes import check_test
from .reading import GRAM_FORCE, Reading
from .sliding import fit_sliding


@dataclass(frozen=True)
class BendingYield:
    """Result of `bending_yield`.

    Attributes:
        bending: B of small motion, as `add_cloth` takes it: the slope after a turn. KES reads (1 - yield_share) B.
        yield_share: the part of B that slides.
        yield_curvature: how far fibers bend before they slide.
        offset: the moment at zero curvature before anything slid: of a rest curvature, or the instrument's zero.
        misfit: root mean square of what the law leaves of the moments, over the height of the loop, 2HB.
        estimates: bending, yield_share and yield_curvature with their 95 % intervals.
    """

    bending: Reading
    yield_share: Reading
    yield_curvature: Reading
    offset: Reading
    misfit: float
    estimates: tuple[Estimate, ...]


def bending_yield(curve: Curve) -> BendingYield:
    """Fit an elastic spring and a sliding one, in parallel, to all points of a bending curve by least squares.

    M = B (kappa - share set) + offset, where the set, zero at first, follows the curvature at the distance
    `yield_curvature`. After a turn the slope is B, and (1 - share) B from twice the yield curvature on; the loop is
    2 share B yield_curvature high. A fabric whose fibers begin to slide one after another has rounded corners, which
    `misfit` shows.

    Args:
        curve: of bending, from the unbent specimen on, with at least one turn.

    Raises:
        InputError: no test of bending, one that never turns back, or one without the loop of a spring that slides.
        MissingExtraError: scipy is not installed.
    """
    check_test(curve, "bending")
    names, units = ("bending", "yield_share", "yield_curvature"), ("N", "N m", "1/m")
    found = fit_sliding(curve, curve.deformation, names, units)
    return BendingYield(
        Reading(found.stiffness.value, "N m", {}, "gf cm^2/cm", 100.0 / GRAM_FORCE),
        Reading(found.share.value, "", {}, "", 1.0),
        Reading(found.distance.value, "1/m", {}, "1/cm", 0.01),
        Reading(found.offset, "N", {}, "gf cm/cm", 1.0 / GRAM_FORCE),
        found.misfit,
        found.estimates,
    )
