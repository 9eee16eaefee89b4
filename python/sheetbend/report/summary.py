"""The first section of a report: whether the fit worked, how well it predicts what it did not see, what to do next."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from ..quantities.wording import several, short
from ..result.estimate import UNSOUND
from ..result.motions import ForceFit, RecordingFit
from ..result.result import FitData
from .dependence import dependences
from .report_recordings import readable
from .tables import Section

STEPS = 2  # next steps at most, called next and then
ALIKE = 1.25  # times the given noise: residuals up to there are called as large as it
FAR = 2.0  # times the given noise: from there on, the next step is to look at the residuals
IS = {"no minimum": "without a minimum"}  # verdicts that do not go on "2 of 3 parameters are"
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
    total, counts = len(result.estimates), Counter(e.verdict for e in result.estimates)
    verdicts = [
        f"{count} of {total} parameters {'is' if count == 1 else 'are'} {IS.get(verdict, verdict)}"
        + (f" ({_names(result, (verdict,))})" if len(counts) > 1 and verdict != "identified" else "")
        for verdict, count in counts.most_common()
    ]
    return "; ".join([_end(result), *([", ".join(verdicts)] if verdicts else [])])


def _end(result: FitData) -> str:
    """How the search ended."""
    if result.interrupted:
        return f"the optimizer {'converged, and the fit was then' if result.converged else 'was'} interrupted"
    if not result.converged:
        return "the optimizer did not converge"
    nowhere = any(e.verdict == "no minimum" for e in result.estimates)
    return "the optimizer stopped, but in no minimum" if nowhere else "the optimizer converged"


def _names(result: FitData, verdicts: Sequence[str]) -> str:
    return several([e.name for e in result.estimates if e.verdict in verdicts])


def _noise_ratio(result: FitData) -> float:
    """Residuals over what the given sigma explains."""
    return math.sqrt(result.misfit.reduced_chi_square) if result.misfit else math.nan


def _residuals(result: FitData) -> str:
    far, ratio = _span([*result.recordings, *result.forces], lambda r: r.rms), _noise_ratio(result)
    if not far:
        return ""
    words = f"the simulation misses the fitted data by {far} (rms)"
    if ratio > ALIKE:
        words += f", {short(ratio, 2)} times what the given noise explains"
    elif not math.isnan(ratio):
        words += f", {'as expected from' if ratio > 1 / ALIKE else 'less than'} the given noise"
    return words


def _held_out(result: FitData) -> dict[str, RecordingFit | ForceFit]:
    """Recordings and force sensors of which a part was not fitted, by name."""
    every: dict[str, RecordingFit | ForceFit] = {r.name: r for r in result.recordings}
    every |= {f"{f.sensor} of {f.recording}": f for f in result.forces}
    return {name: r for name, r in every.items() if r.held_out is not None}


def _prediction(result: FitData) -> str:
    held = [*_held_out(result).values()]
    if not held:
        return result.prediction or "not tested, because nothing was held out"
    words = f"data that were not fitted are missed by {_span(held, lambda r: r.held_out)} (rms)"
    without = _span(held, lambda r: r.baseline)
    return f"{words}; a prediction without physics misses them by {without}" if without else words


def _span(
    recordings: Sequence[RecordingFit | ForceFit], error: Callable[[RecordingFit | ForceFit], float | None]
) -> str:
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
    first = [*_before_use(result)]
    yield from first
    if not _held_out(result) and not result.prediction:
        yield "hold out a part of the data (`held_out`), to see how well the model predicts"
    if not first:
        yield "use the values with their intervals" + (", after you have read the warnings" if result.warnings else "")


def _before_use(result: FitData) -> Iterator[str]:
    """What to do before the values are used, the most urgent first; nothing where the report has no objection."""
    verdicts = {e.verdict for e in result.estimates}
    if result.interrupted:
        yield "continue the fit, for example with `sheetbend fit --resume`, before you use the values"
    elif not result.converged:
        windows = ", or fit the beginning of the motion first (`windows`)" if result.growth else ""
        yield f"raise `max_iterations`, start nearer to the answer{windows}"
    if verdicts & {*UNSOUND}:
        yield f'do not use {_names(result, UNSOUND)} before you have read "What contradicts this fit"'
    worse = [name for name, r in _held_out(result).items() if r.baseline and r.held_out and r.held_out > r.baseline]
    if worse:
        words = f"{several(worse)} {'is' if len(worse) == 1 else 'are'} predicted worse than without physics"
        yield f"look in report.html why {words}"
    if _noise_ratio(result) > FAR:
        yield "look at where and when the residuals are large: the model lacks something there, or sigma is too small"
    if verdicts & {*OPEN}:
        yield f'read what "What the data cannot tell" says about {_names(result, OPEN)}'
    weak = _names(result, ("weak",))
    narrower = f"if the intervals are too wide for you, record a motion that depends more on {weak}"
    if weak and "identified" not in verdicts:
        yield narrower
    found = dependences(result)
    if found:
        name = min(found, key=lambda n: n.endswith("]"))  # the report lists those of shared parameters first
        on = found[name]
        checked = f"check that the error in {on.name} is below {on.size}"
        yield f'{checked}. If it is not, use "+/- in all" as the half-width of {name}'
    if weak and "identified" in verdicts:
        yield narrower
