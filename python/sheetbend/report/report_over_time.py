"""The part of a report on forces and winds over time that nobody measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..quantities.wording import short
from ..result.field import KNOWN, PRIOR_ALONE
from ..result.over_time import OverTimeFit
from ..result.result import FitData
from .report_fields import interval
from .tables import Section

Told = TypeVar("Told", bound=FitData)
LISTED = 24  # knots at most; fit.json has all


def without_modes(result: Told) -> Told:
    """The result without the numbers that make up inputs over time, which have tables of their own."""
    modes = {mode for found in result.over_time for mode in found.modes}
    if not modes:
        return result
    drawn = result.bootstrap
    if drawn is not None:
        drawn = replace(drawn, intervals=tuple(one for one in drawn.intervals if one.name not in modes))
    return replace(
        result,
        bootstrap=drawn,
        starts=tuple(replace(s, values=_others(s.values, modes), first=_others(s.first, modes)) for s in result.starts),
        estimates=tuple(e for e in result.estimates if e.name not in modes),
        correlations=tuple(c for c in result.correlations if not {c.first, c.second} & modes),
        profiles=tuple(p for p in result.profiles if p.name not in modes),
    )


def _others(values: Mapping[str, float], names: set[str]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name not in names}


def inputs_over_time(result: FitData) -> list[Section]:
    """The size and the prior of each input, and its values."""
    if not result.over_time:
        return []
    rows = [_row(found) for found in result.over_time]
    headers = ("input", "recording", "rms", "largest", "unit", "size", "95 %", "length", "95 %", "unit", "left")
    notes = (
        ("rms", "of what was found, along all axes together"),
        ("size", "rms along each axis that the prior expects; length: over which the input changes little"),
        ("95 %", "interval of what was found from the recordings; open: they do not determine it"),
        ("left", "mean share of the prior's variance that the data leave"),
    )
    return [Section("Unknown inputs over time", headers, tuple(rows), notes), *map(_knots, result.over_time)]


def _row(f: OverTimeFit) -> tuple[str, ...]:
    size = np.linalg.norm(f.values, axis=1)
    return (
        f.name,
        f.recording,
        short(float(np.sqrt(np.mean(size**2))), 2),
        short(float(size.max()), 2),
        f.unit,
        short(f.size, 2),
        interval(f.size_lower, f.size_upper, 1.0),
        short(f.length, 2),
        interval(f.length_lower, f.length_upper, 1.0),
        "s",
        f"{100 * float(np.mean(f.left)):.2g} %",
    )


def _knots(f: OverTimeFit) -> Section:
    left = np.array(f.left)
    known, alone = int((left < KNOWN).sum()), int((left > PRIOR_ALONE).sum())
    note = (
        f"of the prior's variance, mean of the axes. {known} of {left.size} values are known from the data (below "
        f"{100 * KNOWN:.0f} %), {alone} from the prior alone (above {100 * PRIOR_ALONE:.0f} %)"
    )
    step = -(-len(f.times) // LISTED)
    rows = [
        (
            short(t, 4),
            *(cell for value, half in zip(values, halves, strict=True) for cell in (short(value, 3), short(half, 2))),
            f"{100 * float(np.mean(own)):.2g} %",
        )
        for t, values, halves, own in list(zip(f.times, f.values, f.half_widths, f.left, strict=True))[::step]
    ]
    more = [("not listed", f"{len(f.times) - len(rows)} knots between; fit.json has all")] if step > 1 else []
    headers = ("time (s)", "x", "+/-", "y", "+/-", "z", "+/-", "left")
    title = f"{f.kind.capitalize()} {f.name} in {f.recording} ({f.unit})"
    return Section(title, headers, tuple(rows), (("left", note), *more))
