"""How far given numbers, wrong by as much as they may well be, would move an estimate without a trace.

An error that leaves much in the residuals is named (doubts.wrong_given). So an error counts here up to the size from
which on it would be. Intervals take given numbers as exact. So the report shows a second half-width, in which these
errors count as independent of each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..quantities.wording import short
from ..result.estimate import Estimate, Premise
from ..result.result import FitData

PLAUSIBLE = "1 %, 1 mm, 1 ms or 0.25 degrees"
"""Of most given numbers, the error that may well be; of clocks and sizes it is less (`doubts.told.GROUPS`)."""
LEVEL = 0.25
"""Degrees by which a direction may well be wrong: what a spirit level or an eye along an edge leaves. Other numbers may
be wrong by the error whose effect the report tells."""
STANDS = ("identified", "weak")
NAMED = 0.85 / 0.15
"""An error is named where it leaves so many times what else the fit leaves beyond noise (doubts.causes.MOST)."""
SURELY = 2.0  # standard deviations of the sum of squares of noise, which nobody tells from what is left beyond it
_IF = "if the error in "


@dataclass(frozen=True)
class Rests:
    """What an estimate rests on: given numbers whose errors may move it by more than its half-width, and not be seen.

    Attributes:
        name: of the one that moves it the most.
        size: how well that one has to be known for the interval to hold.
        others: how many more there are.
    """

    name: str
    size: str
    others: int

    @property
    def words(self) -> str:
        """Behind a verdict."""
        more = f" and {self.others} other given value{'s are' if self.others > 1 else ' is'} right too"
        return f"{_IF}{self.name} is below {self.size}{more if self.others else ''}"


def rests(result: FitData) -> dict[str, Rests]:
    """By estimate, what it rests on; without those that no such error moves so far, and those that do not stand."""
    found = {}
    for e in result.estimates:
        far = list(_far(result, e))
        if far:
            _, off_by, most = max(far, key=lambda each: each[0])
            found[e.name] = Rests(most.name, _size(most, off_by), len(far) - 1)
    return found


def needed(result: FitData) -> dict[str, str]:
    """By given number that an estimate rests on, how well it has to be known for the intervals of all to hold."""
    found: dict[str, tuple[float, Premise]] = {}
    for e in result.estimates:
        for _, off_by, p in _far(result, e):
            found[p.name] = min((off_by, p), found.get(p.name, (math.inf, p)), key=lambda each: each[0])
    return {name: _size(p, off_by) for name, (off_by, p) in found.items()}


def told_to_rest(result: FitData) -> tuple[Estimate, ...]:
    """The estimates, each with what it rests on in its words, in place of what was said there before, and with its
    half-width in all."""
    found = rests(result)
    return tuple(
        replace(
            e,
            words=", ".join([e.words.partition(f", {_IF}")[0], *([found[e.name].words] if e.name in found else [])]),
            in_all=math.hypot(e.half_width, *(may for may, *_ in _may_move(result, e)))
            if e.half_width and e.verdict in STANDS and result.premises
            else None,
        )
        for e in result.estimates
    )


def _far(result: FitData, e: Estimate) -> Iterator[tuple[float, float, Premise]]:
    """By how much each given number may move an estimate, of those that may move it by more than its half-width, and
    the error of it that moves it by just that."""
    for may, moves, p in _may_move(result, e):
        if e.half_width and may > e.half_width:
            yield may, e.half_width / moves, p


def _may_move(result: FitData, e: Estimate) -> Iterator[tuple[float, float, Premise]]:
    """By how much each given number without a standard deviation may move an estimate that stands, and by how much an
    error of one unit of it does."""
    for p in result.premises if e.verdict in STANDS else ():
        moves = abs(p.moved.get(e.name, 0.0)) / p.off_by
        if p.sd is None:
            yield moves * min(_plausible(p), _unseen(result, p)), moves, p


def _plausible(premise: Premise) -> float:
    """Error that may well be, in its unit."""
    return math.radians(LEVEL) if premise.unit == "rad" else premise.off_by


def _unseen(result: FitData, premise: Premise) -> float:
    """Error up to which it is not surely named, in its unit."""
    noise = 2.0 * result.cost / max(result.rows, 1)
    alike = result.rows * (1.0 - 1.0 / max(result.autocorrelation_time, 1.0))
    beyond = noise * max(SURELY * math.sqrt(2.0 * result.rows), alike)
    return math.inf if premise.leaves == 0.0 else premise.off_by * math.sqrt(NAMED * beyond) / premise.leaves


def _size(premise: Premise, error: float) -> str:
    if premise.words.endswith(" %"):
        return f"{short(error / premise.off_by * float(premise.words.removesuffix(' %')), 2)} %"
    if premise.unit == "rad":
        return f"{short(math.degrees(error), 2)} degrees"
    if premise.unit == "s":
        return f"{short(1e3 * error, 2)} ms"
    if premise.unit == "kg" and premise.name == "mass of each marker":
        return f"{short(1e3 * error, 2)} g each"
    if premise.unit == "m":
        return f"{short(1e3 * error, 2)} mm{' each' if premise.name == 'markers' else ''}"
    return f"{short(error, 2)} {premise.unit}".rstrip()
