"""Whether the beginnings of all motions ask for the same values as the whole.

The comparison of blocks (`blocks`) is linear at the minimum. It misses two errors that leave large residuals which
oscillate like the motion itself: a minimum in which some period is matched to the wrong one, and a loss that the model
lacks, which adds up from period to period. A beginning has seen few periods. Fitted again by itself, from the estimate,
it finds its own minimum, and if that is far from the estimate then one of the two has happened. A search that goes on
from there to the whole motion tells which: a wrong minimum is left for a lower one.

Errors that change as slowly as a beginning is long go into its minimum without a trace. So what errors like those of
the other stretches would move in it counts in the comparison, as far as the given sigma allows for their size
(`stretches`).

Nothing is done where the residuals are white and as large as the given sigma, but for motions with many unknowns of
their own: these explain nearly all of a motion in a wrong minimum, too. Each beginning is fitted once from the end of
the first search, and where the search from there ends lower by `LOWER`, once more from that end; there it stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..minimum.discretization import Refinement
from ..minimum.growth import Growth
from ..minimum.linear_step import one_step
from ..minimum.progress import Minimum
from ..minimum.search import Search, fitted_window
from ..minimum.time_step import SECOND_ORDER
from ..minimum.windows import chosen, cut
from ..optional import require
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.blocks import FEWEST, LEVEL, short_of_frames
from ..statistics.covariance import Covariance, covariance
from ..statistics.gauge import null_space
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import critical_t, reach_of
from ..statistics.shared_errors import moved_by
from ..statistics.spectral import autocorrelation
from ..statistics.stretches import scatter, within_sigma
from .contradictions import CLAIMS, drawn_along, finer_experiments, value_words
from .driven_errors import driven_errors

FRAMES = 12  # of every motion: fewer do not tell how residuals correlate
LARGE = 4.0  # of the residuals' mean square, in sigma squared
MANY = 40  # unknowns of one motion
COLORED = 0.2  # autocorrelation of residuals that are not noise
KNOWN = 1.0  # of the same: a beginning that leaves more of a parameter open tells nothing of it
TOLERANCE = 1e-4  # of the cost: a beginning's minimum
CLEAR = 0.03
"""Part of a value, or of its scale, by which a beginning must differ: short beginnings of good real recordings, whose
errors are alike over their whole length, differ by up to 1.5 % (measured)."""
LOWER = 1e-3  # of the cost: an end that is lower by less is the same


@dataclass(frozen=True)
class Beginning:
    """A beginning of all motions, fitted by itself.

    Attributes:
        length: s from the scenes' start on.
        problem: of that part of the recordings.
        u: (free,) its minimum.
        cost: there.
        before: what the estimate of the whole leaves of it.
    """

    length: float
    problem: FitProblem
    u: Array
    cost: float
    before: float


class Whole:
    """The end that beginnings are compared with.

    Attributes:
        problem: of the whole motions.
        u: (free,) its minimum.
    """

    def __init__(self, problem: FitProblem, u: Array, errors: Array | None = None) -> None:
        """`errors`: (data rows, draws) of the whole motions' residuals (`driven_errors`)."""
        self.problem, self.u = problem, u
        self.errors = np.zeros((problem.core.data_rows, 0)) if errors is None else errors
        self.spread = _spread_of(problem, u)

    def scatter(self, b: Beginning, columns: Sequence[int]) -> Array:
        """(columns, columns) mean square by which errors like those of the other stretches would move a beginning's
        minimum, as far as the given sigma allows for their size."""
        layout, part = self.problem.rows_layout(), b.problem.rows_layout()
        still = np.array([e.static for e in self.problem.experiments])
        r = within_sigma(self.problem.evaluate(self.u)[1][: self.problem.core.data_rows], layout)
        J = b.problem.evaluate(b.u)[2][:, list(columns)]
        return scatter(np.where(still[layout.recording], 0.0, r), layout, part, J)

    def shared(self, b: Beginning, columns: Sequence[int]) -> Array:
        """(columns, columns) mean square by which errors that both share move a beginning's minimum from the whole's"""
        if not self.errors.size:
            return np.zeros((len(columns), len(columns)))
        mine = list(columns)
        part = self.errors[_times(self.problem) < b.length]
        here = moved_by(self.problem.evaluate(self.u)[2][:, mine], self.errors)
        off = moved_by(b.problem.evaluate(b.u)[2][:, mine], part) - here
        return np.asarray(off @ off.T / self.errors.shape[1])


def checked(
    search: Search, problem: FitProblem, ends: Sequence[Minimum], growths: Sequence[Growth]
) -> tuple[tuple[Minimum, ...], tuple[Beginning, ...]]:
    """The ends of a search, best first, with a lower one where the beginnings lead to it; and the beginnings that were
    fitted. Ctrl-C passes through.

    Args:
        growths: of the motions at the best end.
    """
    found = beginnings(problem, ends[0], growths)
    whole = Whole(problem, ends[0].u)
    lower = many(problem) and any(_leaves_more(b, LEVEL / len(found)) for b in found)
    if not lower and not any(_differences(whole, b, LEVEL / len(found)) for b in found):
        return tuple(ends), found
    try:
        other = search.onward(problem, found[-1].u)
    except SheetbendError:
        return tuple(ends), found
    if other.interrupted:
        raise KeyboardInterrupt
    if not (other.converged and other.cost < (1.0 - LOWER) * ends[0].cost):
        return tuple(ends), found
    return (other, *ends), beginnings(problem, other, growths)


def beginnings(problem: FitProblem, end: Minimum, growths: Sequence[Growth]) -> tuple[Beginning, ...]:
    """Beginnings of increasing length, each fitted from the minimum of the one before, the first from the end of the
    whole; none where the residuals there are noise and the unknowns few, or where that end is none."""
    if not end.converged or problem.estimates_corrections:
        return ()
    ok, r, _ = problem.evaluate(end.u)
    if not ok or not (_systematic(problem, r) or many(problem)):
        return ()
    at, u, found = _times(problem), end.u, []
    for length in chosen(problem, growths):
        part = cut(problem, length)
        if not _enough(part, length):
            continue
        walk = fitted_window(part, u, TOLERANCE)
        if not math.isfinite(walk.cost):
            break
        u = walk.u
        before = 0.5 * float(np.sum(r[: len(at)][at < length] ** 2) + np.sum(r[len(at) :] ** 2))
        found.append(Beginning(length, part, u, walk.cost, before))
    return tuple(found)


def of_beginnings(
    problem: FitProblem, u: Array, judged: Identifiability, found: Sequence[Beginning], refinement: Refinement
) -> dict[str, str]:
    """By parameter, which beginning asks for another value than the whole.

    All parameters together must differ by more than chance explains at the 1 % level, for all beginnings together.
    Those are named that differ by 3 % or more, by more than the 95 % interval of the difference, and by more than the
    estimate's, what the discretization moves in them counted, and what noise of driven particles moves.

    Args:
        u: (free,) minimum of the whole, where the beginnings were fitted from.
    """
    words = _asked(Whole(problem, u), judged, found, refinement)
    errors = driven_errors(problem, u) if words else np.zeros((0, 0))
    return _asked(Whole(problem, u, errors), judged, found, refinement) if errors.size else words


def _asked(whole: Whole, judged: Identifiability, found: Sequence[Beginning], refinement: Refinement) -> dict[str, str]:
    problem, u = whole.problem, whole.u
    words: dict[str, str] = {}
    for b in found:
        shift: Array | None = None
        for column, (step, reach) in _differences(whole, b, LEVEL / len(found)).items():
            name = problem.parameters.free[column]
            e = next(e for e in judged.estimates if e.name == name)
            if e.verdict not in CLAIMS or name in words:
                continue
            least = max(reach, reach_of(problem.parameters[name], e))
            if abs(step) <= least:
                continue
            shift = _shift(problem, u, b, refinement) if shift is None else shift
            if abs(step) > least + shift[column]:
                words[name] = _words(problem, u, column, b, step, reach)
    return drawn_along(judged, words)


def many(problem: FitProblem) -> bool:
    """Whether a motion has so many unknowns that residuals as large as noise do not tell a right minimum."""
    return any(len(problem.acting_on(e)) >= MANY for e in problem.experiments if not e.static)


def _leaves_more(b: Beginning, level: float) -> bool:
    """Whether the whole's values leave more of a beginning than what its own unknowns take of noise. The test of
    differences misses it where a beginning leaves most unknowns open."""
    count = len(b.u)
    variance = 2.0 * b.cost / max(b.problem.core.data_rows - count, 1)
    drop = 2.0 * (b.before - b.cost) / max(variance, 1e-300)
    return bool(require("scipy.special", "fit").chdtrc(count, max(drop, 0.0)) < level)


def _systematic(problem: FitProblem, r: Array) -> bool:
    data = r[: problem.core.data_rows]
    if float(np.mean(data**2)) > LARGE:
        return True
    alike = autocorrelation(data, problem.rows_layout())
    return bool(np.abs(alike).max(initial=0.0) > max(COLORED, 4.0 / math.sqrt(len(data))))


def _times(problem: FitProblem) -> Array:
    """(data rows,) s since the scene's start; of static rows zero, as every beginning holds them."""
    starts = np.array([e.t0 for e in problem.experiments])
    return np.nan_to_num(problem.row_times() - starts[problem.rows_layout().recording], nan=0.0)


def _enough(part: FitProblem, length: float) -> bool:
    frames = [len(r.times) for e, r in zip(part.experiments, part.recordings, strict=True) if not e.static]
    return min(frames, default=0) >= FRAMES and part.core.data_rows >= FEWEST * len(part.parameters.free)


def _differences(end: Whole, b: Beginning, level: float) -> Mapping[int, tuple[float, float]]:
    """By column, the distance of the beginning's minimum from that of the whole, and the 95 % reach of this distance;
    only columns that are clearly farther. Empty where chance explains the differences of all columns together."""
    parameters, u = b.problem.parameters, end.u
    names = list(parameters.free)
    log = [parameters[name].log for name in names]
    _, _, J = b.problem.evaluate(b.u)
    if not np.isfinite(J).all():
        return {}
    inside = np.flatnonzero(parameters.inside(u) & parameters.inside(b.u)).tolist()
    determined = null_space(J[:, inside], [names[c] for c in inside], [log[c] for c in inside]).determined
    columns = tuple(inside[i] for i in determined)
    if not columns or b.problem.core.data_rows <= len(columns):
        return {}
    own, whole = _spread_of(b.problem, b.u)(columns), end.spread(columns)
    V = short_of_frames(own, max(len(r.times) for r in b.problem.recordings)) * own.matrix + whole.matrix
    V += end.scatter(b, columns) + end.shared(b, columns)
    step, sd = (b.u - u)[list(columns)], np.sqrt(np.diag(V))
    degrees = max(float(np.median(own.degrees)), 1.0)
    score = float(step / sd @ np.linalg.lstsq(V / np.outer(sd, sd), step / sd, rcond=None)[0])
    special = require("scipy.special", "fit")
    if not special.fdtrc(len(columns), degrees, score / len(columns)) < level:
        return {}
    t = critical_t(degrees)
    found = {c: (float(d), t * float(s)) for c, d, s in zip(columns, step, sd, strict=True)}
    size = {c: _size(b.problem, u, c) for c in columns}
    return {c: (d, s) for c, (d, s) in found.items() if abs(d) > max(s, CLEAR * size[c]) and s < KNOWN * size[c]}


def _size(problem: FitProblem, u: Array, column: int) -> float:
    """Size of a parameter in internal coordinates."""
    p = problem.parameters[problem.parameters.free[column]]
    return 1.0 if p.log else p.scale or abs(float(u[column]))


def _spread_of(problem: FitProblem, u: Array) -> Callable[[tuple[int, ...]], Covariance]:
    """The covariance of columns there, each set of them once."""

    @cache
    def spread(columns: tuple[int, ...]) -> Covariance:
        _, r, J = problem.evaluate(u)
        rows, behind = problem.prior_rows
        mine = list(columns)
        return covariance(r[:rows], J[:rows, mine], problem.rows_layout(), J[rows:behind, mine])

    return spread


def _shift(problem: FitProblem, u: Array, b: Beginning, refinement: Refinement) -> Array:
    """(free,) by how much more the discretization moves the beginning's minimum than that of the whole."""
    total = np.zeros(len(u))
    for experiments in finer_experiments(problem, refinement):
        try:
            finer = FitProblem(experiments, problem.given, threads=problem.threads)
            there = one_step(b.problem, cut(finer, b.length), b.u) - b.u
            here = one_step(problem, finer, u) - u
        except SheetbendError:
            continue  # named where the whole is refined
        total += SECOND_ORDER * np.abs(there - here)
    return total


def _words(problem: FitProblem, u: Array, column: int, b: Beginning, step: float, reach: float) -> str:
    asked = value_words(problem.parameters[problem.parameters.free[column]], u[column], step, reach)
    rows = b.problem.core.data_rows
    alone, before = (short(math.sqrt(2 * cost / rows), 2) for cost in (b.cost, b.before))
    return (
        f"the first {short(b.length)} s alone ask for {asked}, and leave residuals of {alone} sigma where the values "
        f"of the whole leave {before}; the model lacks something, such as a loss, or this is not the lowest minimum"
    )
