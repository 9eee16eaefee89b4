"""Likelihood intervals from the profile of a cost: honest where the linear picture of the minimum is not."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from ..errors import InputError
from ..quantities.parameters import Parameter

FARTHEST = math.log(1e6)
"""On a log scale nobody looks beyond a factor of a million."""
NOISELESS = 1e-18  # of sigma squared: data without noise, whose residuals are rounding errors

_DOUBLINGS = 14
_HALVINGS = 8
_THERE = 0.005  # of the height at the end of an interval

Ends = tuple[float | None, float | None]
"""Lower and upper end of an interval in physical units, None where it is open."""


@dataclass(frozen=True)
class Wanted:
    """A profile that is wanted: the name of a parameter, and the internal half-width of its linear interval."""

    name: str
    reach: float


@dataclass(frozen=True)
class Profile:
    """The profile of a parameter around its estimate.

    Attributes:
        ends: of the interval; NaN where there is no answer.
        away: internal distances of points from the estimate, ascending.
        rises: of the cost at these points, over that at the ends of the interval.
        reach: internal half-width of the linear interval.
    """

    ends: Ends
    away: tuple[float, ...] = ()
    rises: tuple[float, ...] = ()
    reach: float = math.inf


Profiler = Callable[[Sequence[Wanted]], Sequence[Profile]]
"""The profile of each."""


def profile_interval(
    profile: Callable[[float], float],
    value: float,
    rise: float,
    *,
    step: float,
    lower: float = -math.inf,
    upper: float = math.inf,
    log: bool = False,
    sides: Collection[float] = (-1.0, 1.0),
) -> Ends:
    """Likelihood interval: where the profile of the cost rises by `rise` above its minimum.

    Args:
        profile: cost as a function of one physical value, all other parameters refitted.
        value: the estimate, where the profile is least.
        rise: allowed rise of the cost; for 95 % and residual variance s^2 it is t^2 s^2/2 with the t
            quantile.
        step: first step away from the estimate, on the log scale where `log`; the expected half-width is a
            good one.
        lower, upper: physical bounds.
        log: search on the log scale.
        sides: on which an end is wanted; on the other it is None.

    Returns:
        The two ends; None on a side where the cost never rises that far up to the bound, or within
        2^14 steps (on a log scale: a factor of a million). NaN where the profile has no finite value before it rises
        that far.
    """
    if not (rise > 0 and step > 0):
        raise InputError("profile_interval", "needs a positive rise and step", (rise, step), "give both above 0")
    here = Parameter(name="profile", initial=value, lower=lower, upper=upper, log=log)
    start, best = here.to_internal(value), profile(value)

    def height(position: float) -> float:
        """About linear in the distance; 1 at the end of the interval."""
        cost = profile(here.to_physical(position))
        return math.sqrt(max(cost - best, 0.0) / rise) if math.isfinite(cost) else math.inf

    ends: list[float | None] = []
    farthest = FARTHEST if log else step * 2.0**_DOUBLINGS
    nearest = max(here.to_internal(lower), start - farthest), min(here.to_internal(upper), start + farthest)
    for sign, bound in zip((-1.0, 1.0), nearest, strict=True):
        crossing = _crossing(height, start, sign * step, bound) if sign in sides else None
        ends.append(None if crossing is None else here.to_physical(crossing))
    return ends[0], ends[1]


def _crossing(height: Callable[[float], float], start: float, step: float, bound: float) -> float | None:
    """The place where the height reaches 1, by doubling steps, then by safeguarded secants; None if it never does, NaN
    if only infinite heights lie beyond."""
    inside, low = start, 0.0
    for doubling in range(_DOUBLINGS + 1):
        outside = start + step * 2.0**doubling
        outside = max(outside, bound) if step < 0 else min(outside, bound)
        if outside == inside:
            return None
        high = height(outside)
        if high >= 1:
            break
        inside, low = outside, high
    else:
        return None
    for _ in range(_HALVINGS):  # back from where there is no answer
        if math.isfinite(high):
            break
        middle = 0.5 * (inside + outside)
        reached = height(middle)
        if reached >= 1:
            outside, high = middle, reached
        else:
            inside, low = middle, reached
    if not math.isfinite(high):
        return math.nan
    for _ in range(40):
        if abs(outside - inside) <= 0.002 * abs(outside - start) or high - low < 1e-12:
            break
        part = (1 - low) / (high - low)
        middle = inside + min(max(part, 0.1), 0.9) * (outside - inside)
        reached = height(middle)
        if abs(reached - 1) < _THERE:
            return middle
        if reached >= 1:
            outside, high = middle, reached
        else:
            inside, low = middle, reached
    return inside + (1 - low) / (high - low) * (outside - inside) if high > low else outside
