"""What a rope that was not weighed lets be known: stiffness, drag and masses over its density.

Motion under given grips does not change when density, stiffness and drag are multiplied by one number. A rope of
unknown weight is therefore fitted as one of 1 kg/m, and every fitted quantity with a mass in its unit is reported over
the density, in the unit that follows: EI as EI/density in m^4/s^2.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from ..report.dependence import with_dependences
from ..report.fit_result import FitResult
from .model import NAME

UNIT = 1.0  # kg/m
UNITS = {
    "N m^2": "m^4/s^2",
    "N m": "m^3/s^2",
    "N": "m^2/s^2",
    "N s/m^2": "1/s",
    "N s^2/m^3": "1/m",
    "kg": "m",
}
"""What a unit becomes over a density in kg/m."""
OVER = "/density"
_DENSITY = f"{NAME}_density"
_UNIT = re.compile("|".join(rf"(?<![\w/^]){re.escape(unit)}(?![\w/^])" for unit in sorted(UNITS, key=len)[::-1]))


def over_density(result: FitResult) -> FitResult:
    """The same fit with each quantity that has a mass in it over the density: names, units and words; numbers are
    those for 1 kg/m. The density is none of what they rest on."""
    result = replace(result, premises=tuple(p for p in result.premises if p.name != _DENSITY))
    result = replace(result, estimates=with_dependences(result))
    data = result.to_dict()
    units = {e.name: e.unit for e in result.estimates} | {g.name: g.unit for g in result.given}
    units |= {p.name: p.unit for p in result.premises}
    names = sorted((name for name, unit in units.items() if unit in UNITS), key=len)[::-1]
    data["given"] = [g for g in data["given"] if g["name"] != _DENSITY]
    return FitResult.from_dict(_renamed(data, re.compile(rf"\b(?:{'|'.join(map(re.escape, names))})\b(?!/density)")))


def is_over_density(result: FitResult) -> bool:
    """Whether it is one of a rope that was not weighed."""
    return any(name.endswith(OVER) for name in result.values)


def named_over_density(values: Mapping[str, float], result: FitResult) -> dict[str, float]:
    """Values under the names that a result of `over_density` gives them; the density, which is not known, left out."""
    over = {quantity(name) for name in result.values if name.endswith(OVER)}
    return {f"{k}{OVER}" if k in over else k: v for k, v in values.items() if k != _DENSITY}


def quantity(name: str) -> str:
    """The model's quantity that a value over the density is of."""
    return name.removesuffix(OVER)


def as_quantities(values: Mapping[str, float]) -> dict[str, float]:
    """Values under the names of the model's quantities, for a rope of 1 kg/m where they are over the density."""
    return {quantity(name): value for name, value in values.items()}


def in_units(text: str) -> str:
    """Words with units over the density."""
    return _UNIT.sub(lambda found: UNITS[found.group()], text)


def said_over_density(say: Callable[[str], None]) -> Callable[[str], None]:
    """A way to say lines in which stiffness is that over the density."""
    return lambda text: say(re.sub(r"\b(EI|GJ)\b(?!/)", rf"\1{OVER}", in_units(text)))


def _renamed(part: Any, names: re.Pattern[str]) -> Any:
    """JSON values with names and units in all texts and keys changed."""
    if isinstance(part, dict):
        return {names.sub(rf"\g<0>{OVER}", key): _renamed(value, names) for key, value in part.items()}
    if isinstance(part, list):
        return [_renamed(value, names) for value in part]
    return names.sub(rf"\g<0>{OVER}", in_units(part)) if isinstance(part, str) else part
