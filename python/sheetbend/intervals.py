"""95 % intervals in physical units, and what their width alone says of a parameter."""

from __future__ import annotations

import math

from .parameters import Parameter
from .profile import FARTHEST, Ends
from .result import Estimate
from .wording import width_words

IDENTIFIED = 0.2
"""Largest 95 % half-width of an identified parameter, as a part of its value (or of its scale)."""


def known(parameter: Parameter, value: float, lower: float, upper: float) -> tuple[str, str]:
    """Verdict and words of a closed interval."""
    width = width_words(parameter, value, lower, upper)
    precise = is_precise(parameter, value, (lower, upper))
    return ("identified", f"known {width}") if precise else ("weak", f"known only {width}")


def open_estimate(parameter: Parameter, value: float, words: str, more: tuple[float, float] = (0.0, 0.0)) -> Estimate:
    """Of a parameter that is not determined, in words why; `more`: discretization and systematic parts."""
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
        verdict="not identifiable",
        words=words,
    )


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
    """Both ends moved out by the other parts; a factor on a log scale keeps them positive."""
    lower, upper = ends
    factor, shift = (1 + more / value, 0.0) if parameter.log else (1.0, more)
    return (
        None if lower is None else lower / factor - shift,
        None if upper is None else upper * factor + shift,
    )


def half_width(ends: Ends) -> float | None:
    lower, upper = ends
    return None if lower is None or upper is None else (upper - lower) / 2


def is_precise(parameter: Parameter, value: float, ends: Ends, more: float = 0.0) -> bool:
    half = half_width(ends)
    return half is not None and half + more <= IDENTIFIED * (parameter.scale or abs(value))
