"""What "stiffness" means of a rope: that of small motion, that where it slides inside, and that of a soft place.

Friction inside the rope holds a part of its bending stiffness, `yield_share`, until the curvature has changed by
`yield_curvature`. Small motion shows all of it, EI; what slides adds no more, and (1 - yield_share) EI is left. Where
the softness varies, ln EI is that of the whole rope less the sum of its modes, softness_k cos(k pi s / length).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..quantities.wording import short
from ..report.fit_result import FitResult
from ..report.tables import Section
from ..result.estimate import Estimate
from .model import NAME
from .over_density import quantity

SOFT = 0.3  # ln of EI of the whole rope over that of a place, from which on it is told
Interval = tuple[float, float | None, float | None]
"""Value and ends of the 95 % interval, None where it is open."""


def tangent_stiffness(result: FitResult) -> Interval | None:
    """(1 - yield_share) EI, to first order in both; None where nothing slides in the model."""
    EI, share = (_estimate(result, name) for name in ("EI", "yield_share"))
    if EI is None or share is None:
        return None
    left = 1.0 - share.value
    return _interval(EI.value * left, _reach(result, {share.name: -1.0 / left}, EI))


def softest_place(result: FitResult) -> tuple[float, Interval] | None:
    """Where along the rope (share of its length) it is softest, and EI there, to first order; None where the stiffness
    does not vary, or by little or no more than is uncertain."""
    EI, modes = _estimate(result, "EI"), _modes(result)
    if EI is None or not modes:
        return None
    places = np.linspace(0.0, 1.0, 201)
    waves = np.cos(np.pi * np.outer(places, list(modes)))
    softness = waves @ [e.value for e in modes.values()]
    at = int(softness.argmax())
    along = {e.name: -float(w) for e, w in zip(modes.values(), waves[at], strict=True)}
    reach = _reach(result, along)
    if reach is None or softness[at] <= max(reach, SOFT):
        return None
    return float(places[at]), _interval(EI.value * math.exp(-softness[at]), _reach(result, along, EI))


def stiffness_section(result: FitResult) -> Section | None:
    """The stiffnesses of a rope that slides inside or has a soft place, as a table; None of others."""
    after, softest, EI = tangent_stiffness(result), softest_place(result), _estimate(result, "EI")
    if EI is None or (after is None and softest is None):
        return None
    rows = [("EI of the whole rope" if after is None else "EI at small strain", EI.value, EI.lower, EI.upper)]
    notes = []
    if after is not None:
        rows.append(("EI where the rope slides inside", *after))
        notes.append(
            (
                "EI",
                "share and curvature of yield are in the table of estimates; a slow test of large bending shows the "
                "lower one",
            )
        )
    if softest is not None:
        place, there = softest
        rows.append((f"EI at {place:.2f} of its length", *there))
        notes.append(
            (
                "softest",
                f"at {place:.2f} of the free length from its start, EI is {there[0] / EI.value:.2g} times that of the "
                "whole rope: look for a kink, a splice or wear there. The modes are smooth: a short kink is softer",
            )
        )
    cells = tuple((what, *("" if x is None else short(x) for x in numbers), EI.unit) for what, *numbers in rows)
    return Section("Bending stiffness", ("", "value", "from", "to", "unit"), cells, tuple(notes))


def _modes(result: FitResult) -> dict[int, Estimate]:
    """The softness modes by their number."""
    first = f"{NAME}_softness_"
    return {int(e.name.removeprefix(first)): e for e in result.estimates if e.name.startswith(first)}


def _reach(result: FitResult, along: Mapping[str, float], EI: Estimate | None = None) -> float | None:
    """Half of the 95 % interval of the sum of estimates times `along`, and of ln EI; None where one is open."""
    known = {e.name: e for e in result.estimates}
    parts = {name: weight * (half or math.nan) for name, weight in along.items() for half in [known[name].half_width]}
    if EI is not None:
        parts[EI.name] = math.log(EI.upper / EI.value) if EI.half_width is not None and EI.upper else math.nan
    square = sum(part**2 for part in parts.values())
    square += sum(
        2.0 * pair.value * parts[pair.first] * parts[pair.second]
        for pair in result.correlations
        if pair.first in parts and pair.second in parts
    )
    return math.sqrt(max(square, 0.0)) if math.isfinite(square) else None


def _interval(value: float, reach: float | None) -> Interval:
    return (value, None, None) if reach is None else (value, value * math.exp(-reach), value * math.exp(reach))


def _estimate(result: FitResult, name: str) -> Estimate | None:
    return next((e for e in result.estimates if quantity(e.name) == f"{NAME}_{name}"), None)
