"""Intervals by bootstrap (Efron & Tibshirani 1993, An Introduction to the Bootstrap, chapters 8 and 13).

The fit is repeated on data that are drawn from its own with replacement: whole recordings, or where these are few,
stretches of each that are some autocorrelation times long (Kuensch 1989, The Annals of Statistics 17, 1217). Nothing is
assumed of the noise but that recordings, or stretches, are independent of each other. Each repetition goes from the
minimum by Gauss-Newton steps. The first takes the Jacobian that the minimum has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.checks import MOST_WHOLE, check_count
from ..arrays.types import Array
from ..errors import InputError
from ..minimum.linear_step import gauss_newton
from ..problem.problem import FitProblem
from ..problem.workers import Common
from ..quantities.parameters import Parameters
from ..quantities.wording import short
from ..result.bootstrap import Bootstrap, BootstrapInterval
from ..result.estimate import Estimate

FEWEST_DRAWS = 50
FEWEST = 8  # recordings or stretches: fewer do not show a scatter
LONG = 4.0  # autocorrelation times in a stretch
STEPS = 6
SETTLED = 0.1  # standard errors, in the mean of all parameters
WIDER = 1.5
"""Half-widths of a bootstrap over those from residuals, from which on a warning tells them. Of 200 draws the ratio
scatters by about 10 % where residuals are noise."""
_TAILS = (2.5, 97.5)  # percent


def check_bootstrap(draws: int, problem: FitProblem) -> None:
    """Refuse what cannot be drawn from, before work starts.

    Raises:
        InputError: too few draws, or experiments whose residuals are not independent of unknowns of their own.
    """
    check_count("bootstrap", draws, 0, MOST_WHOLE, InputError)
    if draws and draws < FEWEST_DRAWS:
        fix = f"give 0 for none, or at least {FEWEST_DRAWS}; 200 tell an interval to about 10 %"
        raise InputError("bootstrap", "must be large enough to show an interval", draws, fix)
    for e in problem.experiments if draws else ():
        given = {"driven_sigma": e.driven_sigma, "shooting": e.shooting, "start": e.start == "estimated" or None}
        for key in (key for key, value in given.items() if value is not None):
            fix = f"leave out `bootstrap`, or `{key}` of {e.name!r}"
            told = f"cannot draw from a motion with `{key}`: its residuals have unknowns in common"
            raise InputError("bootstrap", told, draws, fix)


def bootstrap(problem: FitProblem, u: Array, draws: int, autocorrelation_time: float) -> tuple[Bootstrap | None, str]:
    """The intervals, or None and why there are none.

    Args:
        u: (free,) the minimum.
        draws: number of fits; workers share them.
        autocorrelation_time: frames of residual that count as one.
    """
    parts = _parts(problem, autocorrelation_time)
    if parts.count < FEWEST:
        return None, f"no bootstrap was made: the fitted data are {parts.words}, and {FEWEST} are needed"
    _, r, J = problem.evaluate(u)
    common = Common((problem, u, r, J, parts))
    ends = [end for end in common.map(_drawn, range(draws)) if end is not None]
    if len(ends) < draws / 2:
        lost = f"{draws - len(ends)} of {draws} fits to drawn data did not settle near the minimum"
        return None, f"the bootstrap tells nothing: {lost}"
    at = [problem.parameters.to_physical(end) for end in ends]
    intervals = []
    for name in problem.parameters.free:
        lower, upper = np.percentile([values[name] for values in at], _TAILS)
        intervals.append(BootstrapInterval(name=name, lower=float(lower), upper=float(upper)))
    return Bootstrap(drawn=parts.words, draws=draws, lost=draws - len(ends), intervals=tuple(intervals)), ""


def moved_by(found: Bootstrap, parameters: Parameters, by: Array) -> Bootstrap:
    """Its intervals moved like the estimates, by (free,) internal, to the limit of short substeps and fine meshes."""
    intervals = []
    for one, step in zip(found.intervals, by, strict=True):
        p = parameters[one.name]
        lower, upper = (float(p.to_physical(p.to_internal(end) + step)) for end in (one.lower, one.upper))
        intervals.append(replace(one, lower=lower, upper=upper))
    return replace(found, intervals=tuple(intervals))


def wider(found: Bootstrap, estimates: Sequence[Estimate]) -> tuple[str, ...]:
    """A warning of the parameters whose bootstrap says much more than the residuals do."""
    from_noise = {e.name: math.hypot(e.statistical, e.driven) for e in estimates if e.statistical}
    much = {}
    for one in found.intervals:
        ratio = 0.5 * (one.upper - one.lower) / from_noise.get(one.name, math.inf)
        if ratio > WIDER:
            much[one.name] = ratio
    if not much:
        return ()
    words = ", ".join(f"{short(ratio, 2)} times of {name}" for name, ratio in much.items())
    return (
        f"a bootstrap over {found.drawn} gives wider intervals than the residuals do: {words}. They differ by more "
        "than noise; use the wider ones",
    )


@dataclass(frozen=True)
class _Parts:
    """What is drawn: whole recordings, or stretches of each.

    Attributes:
        recording: (data rows,) of each row.
        place: (data rows,) where along its recording each row is, in stretches from its beginning; None for whole
            recordings.
        count: of parts.
        words: what they are.
    """

    recording: NDArray[Any]
    place: Array | None
    count: int
    words: str

    def weights(self, generator: np.random.Generator) -> Array:
        """(data rows,) how often each row was drawn. Stretches begin elsewhere in each draw."""
        if self.place is None:
            return _how_often(self.recording, generator)
        drawn = np.zeros(len(self.place))
        for one in np.unique(self.recording):
            mine = self.recording == one
            stretch = np.floor(self.place[mine] + generator.uniform()).astype(int)
            drawn[mine] = _how_often(stretch, generator)
        return drawn


def _how_often(part: NDArray[Any], generator: np.random.Generator) -> Array:
    """(rows,) as many parts as there are, drawn with replacement: how often that of each row was."""
    parts, of = np.unique(part, return_inverse=True)
    times = np.bincount(generator.integers(len(parts), size=len(parts)), minlength=len(parts))
    return np.asarray(times[of], dtype=float)


def _parts(problem: FitProblem, autocorrelation_time: float) -> _Parts:
    """Recordings where there are enough, else stretches of them."""
    layout = problem.rows_layout()
    recordings = np.unique(layout.recording)
    if len(recordings) >= FEWEST:
        return _Parts(layout.recording, None, len(recordings), f"{len(recordings)} recordings")
    times = problem.row_times()
    along = np.where(np.isnan(times), layout.frame, times)  # of a shape at rest its markers are the series
    place, count, lengths = np.zeros(len(along)), 0, []
    for one in recordings:
        mine = layout.recording == one
        at = np.unique(along[mine])
        step = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
        length = max(1, math.ceil(LONG * autocorrelation_time)) * step
        place[mine] = (along[mine] - at[0]) / length
        count += math.floor((at[-1] - at[0] + step) / length + 1e-9)
        lengths.append("" if np.isnan(times[mine]).all() else f" of {short(length, 3)} s")
    return _Parts(layout.recording, place, count, f"{count} stretches{lengths[0] if len(set(lengths)) == 1 else ''}")


def _drawn(common: tuple[FitProblem, Array, Array, Array, _Parts], number: int) -> Array | None:
    """(free,) the minimum of one draw; None where the steps do not settle."""
    problem, u, r, J, parts = common
    weight = np.ones(len(r))
    weight[: problem.core.data_rows] = np.sqrt(parts.weights(np.random.default_rng([0, number])))
    variance = float(r @ r) / max(1, len(r) - len(u))
    at = u
    for _ in range(STEPS):
        scaled = weight[:, None] * J
        end = gauss_newton(problem.parameters, at, scaled, weight * r)
        by, at = scaled @ (end - at), end
        if float(by @ by) <= SETTLED**2 * len(u) * variance:
            return at
        ok, r, J = problem.evaluate(at)
        if not ok:
            return None
    return None
