"""Numbers and verdicts as people write them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from .parameters import Parameter

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def short(number: float, digits: int = 3) -> str:
    """A number to some significant digits, without an exponent between 1e-4 and 1e6."""
    if number == 0 or not math.isfinite(number):
        return f"{number:g}"
    text = f"{number:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and 1 <= abs(number) < 1e6 else text


def figures(numbers: Sequence[float | None], uncertainty: float | None) -> list[str]:
    """Numbers of one table row, to two digits of their uncertainty and with one exponent for all of them.

    The first one is the value that sets the exponent; None gives "" .
    """
    value = next((abs(number) for number in numbers if number), 0.0)
    size = max(value, uncertainty or 0.0)
    exponent = math.floor(math.log10(size)) if size > 0 else 0
    exponent = 0 if -4 < exponent < 6 else exponent
    if uncertainty:
        digits = 1 - math.floor(math.log10(uncertainty)) + exponent
    else:
        digits = 3 - (math.floor(math.log10(value)) if value else 0) + exponent
    digits = min(max(digits, 0), 9)
    tail = f"e{exponent:+03d}" if exponent else ""
    return ["" if number is None else f"{number / 10.0**exponent:.{digits}f}{tail}" for number in numbers]


def raised(unit: str) -> str:
    """A text with whole powers as superscripts, for figures and pages: N m^2 as N m². Others stay: x^0.5."""
    return re.sub(r"\^(-?[0-9]+)(?![0-9.]*[0-9])", lambda power: power[1].translate(_RAISED), unit)


def several(names: Sequence[str], most: int = 4) -> str:
    """The first names of a list, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def quantity(value: float, parameter: Parameter) -> str:
    """A value with its unit."""
    return f"{short(value)} {parameter.unit}".rstrip()


def floor_words(parameter: Parameter, value: float, ceiling: bool, reason: str) -> str:
    """Words for a parameter at or beyond what the solver itself makes up."""
    side = "above" if ceiling else "below"
    return f"at or {side} {quantity(value, parameter)}, the solver's own ({reason}): no property of the material"


def side_words(parameter: Parameter, lower: float | None, upper: float | None) -> str:
    """Words for a parameter that is bounded from one side."""
    if lower is not None:
        return f"at least {quantity(lower, parameter)}: larger values explain the data as well"
    if upper is not None:
        return f"at most {quantity(upper, parameter)}: smaller values explain the data as well"
    return "open on both sides"


def ran_off_words(parameter: Parameter, value: float) -> str:
    """Words for a parameter that a fit moved so far that the data no longer depend on it."""
    start = parameter.initial if parameter.initial is not None else value
    far = f"ran off from {quantity(start, parameter)} to {quantity(value, parameter)}"
    side = "smaller" if abs(value) < abs(start) else "larger"
    return f"{far}: {side} values explain the data as well, or the fit lost it; start elsewhere or give it bounds"


def width_words(parameter: Parameter, value: float, lower: float, upper: float) -> str:
    """How well a closed interval knows its value: relative where it has a clear size, else absolute."""
    half_width = (upper - lower) / 2
    if parameter.log and upper > 3 * lower > 0:
        return f"within a factor of {short(math.sqrt(upper / lower), 2)}"
    if parameter.scale is None and abs(value) > half_width:
        return f"to {short(100 * half_width / abs(value), 2)} %"
    sign = "; its sign is open" if lower < 0 < upper else ""
    return f"to {quantity(half_width, parameter)}{sign}"
