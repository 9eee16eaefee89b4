"""What KES instruments read off the loops of a curve (S. Kawabata, The Standardization and Analysis of Hand Evaluation,
2nd ed., The Textile Machinery Society of Japan, Osaka 1980). Readings of a measured curve have no gradient."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.checks import check_count, check_kind, finite
from ..errors import InputError
from .curve import Curve, Cycle, chosen
from .reading import GRAM_FORCE, Reading

_GF_PER_CM = 0.01 / GRAM_FORCE  # gf/cm per N/m
_POINTS = 50  # of a slope


@dataclass(frozen=True)
class TensileLoop:
    """Result of `tensile_loop`.

    Attributes:
        extension: EMT, the strain at the largest load.
        energy: WT, work of loading per area.
        linearity: LT, that over the energy of a straight line to the same point.
        resilience: RT, work that unloading gives back over that of loading; None without unloading.
    """

    extension: Reading
    energy: Reading
    linearity: Reading
    resilience: Reading | None


@dataclass(frozen=True)
class ShearLoop:
    """Result of `shear_loop`.

    Attributes:
        stiffness: G, slope of the force per width against the angle, on the way out.
        hysteresis: 2HG, what the force on the way out has more than on the way back at a small angle.
        hysteresis_far: 2HG5, the same at a large angle. Each is None where the test does not come back through it.
        lost: part of the work that the way back does not give back; None without one.
    """

    stiffness: Reading
    hysteresis: Reading | None
    hysteresis_far: Reading | None
    lost: float | None


@dataclass(frozen=True)
class BendingLoop:
    """Result of `bending_loop`.

    Attributes:
        rigidity: B, slope of the moment per width against the curvature, on the way out.
        hysteresis: 2HB, what the moment on the way out has more than on the way back; None where there is none.
        lost: part of the work that the way back does not give back; None without one.
    """

    rigidity: Reading
    hysteresis: Reading | None
    lost: float | None


def tensile_loop(curve: Curve, cycle: int = 0) -> TensileLoop:
    """EMT, WT, LT and RT of a cycle.

    WT is the integral of the force per width over the strain of the way out, LT = WT/(F_max e_max/2), RT = W'/WT with
    the W' of the way back. Strains count from the cycle's start, forces from zero. KES-FB1 ends at 500 gf/cm; other
    ends give other numbers.

    Raises:
        InputError: no test of tension, or no such cycle.
    """
    check_test(curve, "tension")
    found = chosen(curve, cycle)
    out = found.loading
    strain, work = float(out.deformation[-1] - out.deformation[0]), out.work
    lost = found.lost
    return TensileLoop(
        Reading(strain, "", {}, "%", 100.0),
        Reading(work, "J/m^2", {}, "gf cm/cm^2", _GF_PER_CM),
        Reading(2.0 * work / (float(out.load[-1]) * strain), "", {}, "", 1.0),
        None if lost is None else Reading(1.0 - lost, "", {}, "%", 100.0),
    )


def shear_loop(
    curve: Curve, cycle: int = 0, *, slope: tuple[float, float] = (0.5, 2.5), at: tuple[float, float] = (0.5, 5.0)
) -> ShearLoop:
    """G between 0.5 and 2.5 degrees (by least squares), 2HG at 0.5 and 2HG5 at 5 degrees.

    Each is the mean of both sides where the test goes to both.

    Args:
        cycle: of each side.
        slope, at: angles, degrees.

    Raises:
        InputError: no test of shear, no such cycle, or one that does not reach the angles of the slope.
    """
    check_test(curve, "shear")
    sides = _sides(curve, cycle)
    low, high = (math.radians(a) for a in finite("slope", slope, (2,), InputError))
    near, far = (_width(sides, math.radians(a)) for a in finite("at", at, (2,), InputError))
    return ShearLoop(
        Reading(_mean(sides, lambda c: _slope(c, low, high)), "N/m", {}, "gf/(cm deg)", math.radians(_GF_PER_CM)),
        None if near is None else Reading(near, "N/m", {}, "gf/cm", _GF_PER_CM),
        None if far is None else Reading(far, "N/m", {}, "gf/cm", _GF_PER_CM),
        _share_lost(sides),
    )


def bending_loop(
    curve: Curve, cycle: int = 0, *, slope: tuple[float, float] = (50.0, 150.0), at: float = 100.0
) -> BendingLoop:
    """B between curvatures of 0.5 and 1.5 per cm (by least squares) and 2HB at 1 per cm.

    Each is the mean of both sides where the test goes to both.

    Args:
        cycle: of each side.
        slope, at: curvatures, 1/m.

    Raises:
        InputError: no test of bending, no such cycle, or one that does not reach the curvatures of the slope.
    """
    check_test(curve, "bending")
    sides = _sides(curve, cycle)
    low, high = finite("slope", slope, (2,), InputError).tolist()
    width = _width(sides, float(finite("at", at, (), InputError)))
    return BendingLoop(
        Reading(_mean(sides, lambda c: _slope(c, low, high)), "N m", {}, "gf cm^2/cm", 100.0 / GRAM_FORCE),
        None if width is None else Reading(width, "N", {}, "gf cm/cm", 1.0 / GRAM_FORCE),
        _share_lost(sides),
    )


def check_test(curve: Curve, test: str) -> None:
    """Refuse a curve of another test.

    Raises:
        InputError: names both.
    """
    check_kind("curve", curve, Curve, "read the file with textile.read_curves")
    if curve.test != test:
        raise InputError(curve.name, f"is not a test of {test}", curve.test, "read the file with that test=")


def _sides(curve: Curve, cycle: int) -> list[Cycle]:
    """The chosen cycle of each side to which the test goes, the positive side first."""
    check_count("cycle", cycle, -len(curve.cycles()), len(curve.cycles()), InputError)
    found = []
    for sign in (1.0, -1.0):
        own = [c for c in curve.cycles() if sign * float(c.loading.deformation[-1]) > 0.0]
        if own and not -len(own) <= cycle < len(own):
            raise InputError(
                "cycle", f"is not one of the {len(own)} of {curve.name}", cycle, "count from 0; -1 is the last"
            )
        found += [own[cycle]] if own else []
    return found


def _mean(sides: Sequence[Cycle], of: Callable[[Cycle], float]) -> float:
    return float(np.mean([of(side) for side in sides]))


def _load_at(branch: Curve, deformation: float) -> float:
    """Load at a deformation to the branch's side; NaN where it does not go."""
    sign = math.copysign(1.0, float(branch.deformation[np.abs(branch.deformation).argmax()]))
    return sign * branch.load_at(sign * deformation)


def _slope(side: Cycle, low: float, high: float) -> float:
    x, out = np.linspace(low, high, _POINTS), side.loading
    load = np.array([_load_at(out, d) for d in x])
    if np.isnan(load).any():
        reach = f"{out.deformation.min():.4g} to {out.deformation.max():.4g}"
        fix = "choose slope= so that the test passes it"
        raise InputError(out.name, f"does not go from {low:.4g} to {high:.4g} to each side", reach, fix)
    return float(np.polyfit(x, load, 1)[0])


def _width(sides: Sequence[Cycle], at: float) -> float | None:
    widths = [_load_at(s.loading, at) - _load_at(s.unloading, at) for s in sides if s.unloading is not None]
    return float(np.mean(widths)) if len(widths) == len(sides) and not np.isnan(widths).any() else None


def _share_lost(sides: Sequence[Cycle]) -> float | None:
    lost = [side.lost for side in sides]
    return None if None in lost else float(np.mean([part for part in lost if part is not None]))
