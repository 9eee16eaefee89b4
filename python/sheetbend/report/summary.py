"""The first section of a report: whether the fit worked, how well it predicts what it did not see, what to do next."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from ..quantities.wording import short
from ..result.estimate import UNSOUND
from ..result.motions import RecordingFit
from ..result.result import FitData
from .dependence import dependences
from .report_recordings import readable
from .tables import Section

NAMED = 4  # parameters of one verdict that are named
STEPS = 2  # next steps at most, called next and then
ALIKE = 1.25  # times the given noise: residuals up to there are called as large as it
FAR = 2.0  # times the given noise: from there on, the next step is to look at the residuals
OPEN = ("one-sided", "at a bound", "at its floor", "not identifiable")


def summary(result: FitData) -> Section:
    """What a reader wants to know first."""
    notes = (
        ("result", _outcome(result)),
        ("fit", _residuals(result)),
        ("prediction", _prediction(result)),
        *zip(("next", "then"), list(_steps(result))[:STEPS], strict=False),
    )
    return Section("Summary", notes=tuple(note for note in notes if note[1]))


def _outcome(result: FitData) -> str:
    """How the search ended, and the verdicts; those of few parameters with their names."""
    end = "the optimizer was interrupted" if result.interrupted else "the optimizer converged"
    if not (result.converged or result.interrupted):
        end = "the optimizer did not converge"
    total, counts = len(result.estimates), Counter(e.verdict for e in result.estimates)
    verdicts = [
        f"{count} of {total} parameters {'is' if count == 1 else 'are'} {verdict}"
        + (f" ({_names(result, (verdict,))})" if len(counts) > 1 and verdict != "identified" else "")
        for verdict, count in counts.most_common()
    ]
    return f"{end}; {', '.join(verdicts)}"


def _names(result: FitData, verdicts: Sequence[str]) -> str:
    names = [e.name for e in result.estimates if e.verdict in verdicts]
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more}"


def _noise_ratio(result: FitData) -> float:
    """Residuals over what the given sigma explains."""
    return math.sqrt(result.misfit.reduced_chi_square) if result.misfit else math.nan


def _residuals(result: FitData) -> str:
    far, ratio = _span(result.recordings, lambda r: r.rms), _noise_ratio(result)
    if not far:
        return ""
    words = f"the simulation misses the fitted data by {far} (rms)"
    if ratio > ALIKE:
        words += f", {short(ratio, 2)} times what the given noise explains"
    elif not math.isnan(ratio):
        words += f", {'as the given noise explains' if ratio > 1 / ALIKE else 'less than the given noise explains'}"
    return words


def _prediction(result: FitData) -> str:
    held = [r for r in result.recordings if r.held_out is not None]
    if not held:
        return "not tested, because nothing was held out"
    words = f"data that were not fitted are missed by {_span(held, lambda r: r.held_out)} (rms)"
    without = _span(held, lambda r: r.baseline)
    return f"{words}; a prediction without physics misses them by {without}" if without else words


def _span(recordings: Sequence[RecordingFit], error: Callable[[RecordingFit], float | None]) -> str:
    """The smallest and the largest error, for each unit."""
    found: dict[str, list[float]] = {}
    for r in recordings:
        factor, unit = readable(r)
        size = error(r)
        if size is not None:
            found.setdefault(unit, []).append(size * factor)
    told = []
    for unit, sizes in found.items():
        ends = dict.fromkeys((short(min(sizes)), short(max(sizes))))
        told.append(f"{' to '.join(ends)} {unit}")
    return " and ".join(told)


def _steps(result: FitData) -> Iterator[str]:
    """What to do, the most urgent first."""
    verdicts = {e.verdict for e in result.estimates}
    if result.interrupted:
        yield "continue the fit, for example with `sheetbend fit --resume`, before you use the values"
    elif not result.converged:
        yield "raise `max_iterations`, begin nearer to the answer, or fit the beginning of the motion first (`windows`)"
    if verdicts & {*UNSOUND}:
        yield f'do not use {_names(result, UNSOUND)} before you have read "What contradicts this fit"'
    worse = [r.name for r in result.recordings if r.held_out is not None and r.baseline and r.held_out > r.baseline]
    if worse:
        yield f"look in report.html why {', '.join(worse[:NAMED])} is predicted worse than without physics"
    if _noise_ratio(result) > FAR:
        yield "look at which markers are missed, and when: the model lacks something there, or sigma is too small"
    if verdicts & {*OPEN}:
        yield f'read what "What the data cannot tell" says about {_names(result, OPEN)}'
    weak = _names(result, ("weak",))
    narrower = f"if the intervals are too wide for you, record a motion that depends more on {weak}"
    if weak and "identified" not in verdicts:
        yield narrower
    found = dependences(result)
    if found:
        name, on = next(iter(found.items()))
        yield f'check that {on.name} is right to {on.size}. If it is not, use "+/- in all" as the half-width of {name}'
    if weak and "identified" in verdicts:
        yield narrower
    if all(r.held_out is None for r in result.recordings):
        yield "hold out a part of the data (`held_out`), to see how well the model predicts"
    if not (found or verdicts - {"identified"}):
        yield "use the values with their intervals"
