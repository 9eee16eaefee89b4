"""How far errors in given values would move an estimate without a trace in the residuals.

An error that leaves much in the residuals is named (doubts.wrong_given), so an error counts here only up to that size.
Intervals take given values as exact. The report therefore shows a second half-width, which counts these errors as
independent of each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..quantities.wording import short
from ..result.estimate import Estimate, Premise
from ..result.result import FitData

PLAUSIBLE = "1 % (drag, damping, friction: 10 %), 1 mm, 1 ms, 0.25 degrees or 0.2 m/s of wind"
"""The plausible error in most given values; in clocks and sizes it is less, in ratios of stiffnesses and in a dry
friction that the model lacks it is more (`doubts.told.GROUPS`)."""
LEVEL = 0.25
"""The plausible error in a direction, in degrees: what a spirit level or an eye along an edge leaves. In other values
it is the error whose effect the report shows."""
STANDS = ("identified", "weak")
NAMED = 0.85 / 0.15
"""An error is named where it leaves so many times what else the fit leaves beyond noise (doubts.causes.MOST)."""
SURELY = 2.0  # standard deviations of the sum of squares of noise: a misfit below that is not told from noise
_IF = "if the error in "


@dataclass(frozen=True)
class Dependence:
    """What an estimate depends on: given values whose errors may move it by more than its half-width, and not be seen.

    Attributes:
        name: of the value that moves it the most.
        size: the error in that value that moves the estimate by just its half-width, with unit.
        others: how many more such values there are.
    """

    name: str
    size: str
    others: int

    @property
    def words(self) -> str:
        """Behind a verdict."""
        more = f" and {self.others} other given value{'s are' if self.others > 1 else ' is'} right too"
        return f"{_IF}{self.name} is below {self.size}{more if self.others else ''}"


def dependences(result: FitData) -> dict[str, Dependence]:
    """By name of an estimate, what it depends on; estimates that no such error moves so far are left out, and so are
    those whose verdict is none of STANDS."""
    found = {}
    for e in result.estimates:
        far = list(_far(result, e))
        if far:
            _, off_by, most = max(far, key=lambda each: each[0])
            found[e.name] = Dependence(most.name, _size(most, off_by), len(far) - 1)
    return found


def needed(result: FitData) -> dict[str, str]:
    """By name of a given value that an estimate depends on, the largest error at which all intervals still hold."""
    found: dict[str, tuple[float, Premise]] = {}
    for e in result.estimates:
        for _, off_by, p in _far(result, e):
            found[p.name] = min((off_by, p), found.get(p.name, (math.inf, p)), key=lambda each: each[0])
    return {name: _size(p, off_by) for name, (off_by, p) in found.items()}


def with_dependences(result: FitData) -> tuple[Estimate, ...]:
    """The estimates, each with its dependence in its words, in place of an earlier one, and with the half-width that
    counts the errors of given values (`in_all`)."""
    found = dependences(result)
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
    """Of each given value that may move an estimate by more than its half-width: how far it may, the error that moves
    it by just the half-width, and the value."""
    for may, moves, p in _may_move(result, e):
        if e.half_width and may > e.half_width:
            yield may, e.half_width / moves, p


def _may_move(result: FitData, e: Estimate) -> Iterator[tuple[float, float, Premise]]:
    """Of each given value without a standard deviation: how far it may move an estimate that stands, how far an error
    of one unit does, and the value."""
    for p in result.premises if e.verdict in STANDS else ():
        moves = abs(p.moved.get(e.name, 0.0)) / p.off_by
        if p.sd is None:
            yield moves * min(_plausible(p), _unseen(result, p)), moves, p


def _plausible(premise: Premise) -> float:
    """Plausible error in the value, in its unit."""
    return math.radians(LEVEL) if premise.unit == "rad" else premise.off_by


def _unseen(result: FitData, premise: Premise) -> float:
    """Error in the value up to which it is not surely named, in its unit."""
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
