"""What a fit took as given, in its report: what an error of each given value moves in each parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..quantities.wording import short
from ..result.estimate import Estimate, Premise
from ..result.result import FitData
from .dependence import needed
from .tables import Section, wide

PREMISES_SHOWN = 8
"""Number of given values that the report lists at most, those with the strongest effects; fit.json has them all."""
PREMISE_COLUMNS = 4
"""Number of parameters above which a given value is listed with the one that it moves most."""
_FELT = 0.02  # of a half-width: given values that move every parameter by less are not listed


def premises(result: FitData) -> Section:
    """What the fit took as given: how far an error of each moves the parameters, the strongest first."""
    every_one = [e for e in result.estimates if e.half_width]
    closed = [e for e in every_one if not e.name.endswith("]")] or every_one  # those of one recording: see fit.json

    def strength(premise: Premise, e: Estimate) -> float:
        return abs(premise.moved.get(e.name, 0.0)) / (e.half_width or 1.0)

    every = [p for p in result.premises if any(strength(p, e) > _FELT for e in closed)]
    every.sort(key=lambda p: -max(strength(p, e) for e in closed))
    counted, right_to = any(p.sd for p in every), needed(result)
    listed = []
    for p in every[:PREMISES_SHOWN]:
        value = "" if p.value is None else f"{short(p.value, 4)} {p.unit}".rstrip()
        sd = "" if p.sd is None else f"{short(p.sd, 2)} {p.unit}".rstrip()
        listed.append(((p.name, value, p.words), p, (sd,) if counted else ()))
    ends = ("sd counted",) if counted else ()
    headers = ("given", "value", "if off by", *(e.name for e in closed), *ends)
    rows = [(*before, *(_shift_in_words(p, e) for e in closed), *after) for before, p, after in listed]
    if len(closed) > PREMISE_COLUMNS or wide((headers, *rows)):
        most = [max(closed, key=lambda e, p=p: strength(p, e)) for _, p, _ in listed]  # type: ignore[misc]
        headers = ("given", "value", "if off by", "largest shift", "half-widths", *ends)
        rows = [
            (*before, f"{e.name} {_shift_in_words(p, e)}", short(strength(p, e), 2), *after)
            for (before, p, after), e in zip(listed, most, strict=True)
        ]
    notes = _rests_on(every, closed, strength) if rows else ()
    if right_to:
        sizes = ", ".join(f"{p.name} {right_to[p.name]}" for p in every if p.name in right_to)
        notes = (
            (
                "required accuracy",
                f"{sizes}. A larger error may move a parameter out of its interval without a trace in the residuals",
            ),
            *notes,
        )
    return Section("What the result rests on", headers, tuple(rows), notes)


def _shift_in_words(premise: Premise, e: Estimate) -> str:
    moved = premise.moved.get(e.name)
    if moved is None:
        return ""
    if abs(moved) < 1e-3 * (e.half_width or 0.0):
        return "0"
    sign = "+" if moved > 0 and premise.name != "markers" else ""
    if e.half_width is not None and abs(e.value) > e.half_width:
        return f"{sign}{short(100 * moved / abs(e.value), 2)} %"
    return f"{sign}{short(moved, 2)} {e.unit}".rstrip()


def _rests_on(
    premises: Sequence[Premise], closed: Sequence[Estimate], strength: Callable[[Premise, Estimate], float]
) -> tuple[tuple[str, str], ...]:
    """What the reader is to make of the table."""
    notes = []
    left = len(premises) - PREMISES_SHOWN
    if left > 0:
        notes.append(("not listed", f"{left} given values with weaker effects"))
    exact = [p for p in premises if p.sd is None]
    if exact:
        strongest = max(closed, key=lambda e: strength(exact[0], e))
        times = strength(exact[0], strongest)
        words = "The intervals take these values as exact"
        if len(exact) < len(premises):
            words = "The intervals take the values without a standard deviation as exact"
        if times > 1:
            far = f"an error of {exact[0].words} in {exact[0].name} would move {strongest.name}"
            words += f", but {far} by {short(times, 2)} half-widths"
        how = "give standard deviations ([given] in a configuration, given= in Python)"
        notes.append(("", f"{words}. To include such errors in the intervals, {how}"))
    return tuple(notes)
