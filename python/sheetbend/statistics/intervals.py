"""95 % intervals in physical units, and what their width alone says of a parameter."""

from __future__ import annotations

import math
from typing import overload

import numpy as np

from ..arrays.types import Array
from ..optional import require
from ..quantities.parameters import Parameter
from ..quantities.wording import width_words
from ..result.estimate import Estimate
from .profile import FARTHEST, Ends

IDENTIFIED = 0.2
"""Largest 95 % half-width of an identified parameter, as a part of its value (or of its scale)."""
LEVEL = 0.95
"""Of all intervals."""
NORMAL = 1.959963984540054
"""Standard deviations of half a 95 % interval, of what is normally distributed."""
LIKELY = 3.841
"""What minus twice a logarithmic likelihood rises by at the ends of a 95 % interval (chi-square with one degree)."""
RAN_OFF = math.log(1e3)
"""On a log scale: a parameter that a fit moved so far from its start, and that data do not see there, ran off."""
_NEAR = 1e-3  # of a logarithm: so near the farthest that a search looks


@overload
def critical_t(degrees: float) -> float: ...


@overload
def critical_t(degrees: Array) -> Array: ...


def critical_t(degrees: float | Array) -> float | Array:
    """Standard errors of half a 95 % interval, of what follows Student's t."""
    t = require("scipy.special", "fit").stdtrit(degrees, 0.5 + LEVEL / 2)
    return np.asarray(t) if isinstance(degrees, np.ndarray) else float(t)


def known(parameter: Parameter, value: float, lower: float, upper: float) -> tuple[str, str]:
    """Verdict and words of a closed interval."""
    width = width_words(parameter, value, lower, upper)
    precise = is_precise(parameter, value, (lower, upper))
    return ("identified", f"known {width}") if precise else ("weak", f"known only {width}")


def open_estimate(
    parameter: Parameter,
    value: float,
    words: str,
    more: tuple[float, float] = (0.0, 0.0),
    verdict: str = "not identifiable",
) -> Estimate:
    """The estimate of a parameter without an interval, with the reason in words; `more`: its parts from the
    discretization and from systematic errors."""
    return Estimate(
        name=parameter.name,
        value=value,
        unit=parameter.unit,
        lower=None,
        upper=None,
        half_width=None,
        statistical=None,
        discretization=float(more[0]),
        systematic=float(more[1]),
        verdict=verdict,
        words=words,
    )


def closed_estimate(parameter: Parameter, value: float, lower: float, upper: float) -> Estimate:
    """The estimate of a parameter whose whole interval comes from the residuals: identified or weak."""
    half = (upper - lower) / 2
    verdict, words = known(parameter, value, lower, upper)
    return Estimate(
        name=parameter.name,
        value=value,
        unit=parameter.unit,
        lower=lower,
        upper=upper,
        half_width=half,
        statistical=half,
        discretization=0.0,
        verdict=verdict,
        words=words,
    )


def ran_off(parameter: Parameter, value: float) -> bool:
    """Whether the fit moved a parameter many times its size away from its start."""
    start = parameter.initial
    if start is None:
        return False
    if parameter.log:
        return abs(parameter.to_internal(value) - parameter.to_internal(start)) > RAN_OFF
    return abs(value - start) > math.exp(RAN_OFF) * max(abs(start), parameter.scale or 0.0) > 0


def at_far_limit(parameter: Parameter, value: float) -> bool:
    """Whether a parameter on a log scale went as far from its start as a search looks, a factor of a million."""
    start = parameter.initial
    if start is None or not parameter.log:
        return False
    return abs(parameter.to_internal(value) - parameter.to_internal(start)) > FARTHEST - _NEAR


def has_answer(parameter: Parameter, value: float, part: float) -> bool:
    """Whether a part of an interval is a number, and on a log scale no factor of a million."""
    return math.isfinite(part) and not (parameter.log and part >= 0.99 * value * math.expm1(FARTHEST))


def linear_ends(parameter: Parameter, internal: float, reach: float) -> Ends:
    """The linear interval in physical units; open where a log scale leaves a factor of a million."""
    if parameter.log and reach > FARTHEST:
        return None, None
    return parameter.to_physical(internal - reach), parameter.to_physical(internal + reach)


def clipped(parameter: Parameter, ends: Ends) -> Ends:
    lower, upper = ends
    lower = parameter.lower if lower is None else max(lower, parameter.lower)
    upper = parameter.upper if upper is None else min(upper, parameter.upper)
    return (lower if math.isfinite(lower) else None), (upper if math.isfinite(upper) else None)


def widened(parameter: Parameter, value: float, ends: Ends, more: float) -> Ends:
    """Both ends of an interval moved out by its other parts, at most to the parameter's bounds; on a log scale by a
    factor, which keeps them positive."""
    lower, upper = ends
    factor, shift = (1 + more / value, 0.0) if parameter.log else (1.0, more)
    return (
        None if lower is None else max(lower / factor - shift, min(parameter.lower, value)),
        None if upper is None else min(upper * factor + shift, max(parameter.upper, value)),
    )


def half_width(ends: Ends) -> float | None:
    lower, upper = ends
    return None if lower is None or upper is None else (upper - lower) / 2


def reach_of(parameter: Parameter, e: Estimate) -> float:
    """Half-width in the internal coordinate, of the narrower side where these differ; infinite without an interval."""
    at = parameter.to_internal(e.value)
    return min(
        (abs(parameter.to_internal(end) - at) for end in (e.lower, e.upper) if end is not None), default=math.inf
    )


def is_precise(parameter: Parameter, value: float, ends: Ends, more: float = 0.0) -> bool:
    half = half_width(ends)
    return half is not None and half + more <= IDENTIFIED * (parameter.scale or abs(value))
