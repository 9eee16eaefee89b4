"""How a fit finds its minimum: from every start, through short windows first where they help (`windows`), by steps that
are limited for each parameter (`approach`), and by Ceres or SciPy once it is near.

Of many starts (`starts = 32`) all are raced through the windows first, and the best of each group goes on (`race`).
Corrections of driven markers come last: far from the minimum they would explain away what the parameters have to.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..arrays.checks import MOST_WHOLE, check_count, is_number, numbers
from ..errors import InputError, SheetbendError
from .approach import LEAST, Approach, Tally
from .conditioning import Condition
from .growth import Growth, growths
from .optimizers import minimize, named
from .problem import FitProblem
from .progress import Minimum, Observer, Progress
from .race import Course, Raced, groups_of, race
from .slope import judged
from .starts import drawn, off_bounds
from .windows import STEPS, TOLERANCE, along, chosen, cut, holds_frames

AUTO = "auto"
MOST_STARTS = 10**5
NEAR_TOLERANCE = 1e-3  # of the cost: what is left is for the optimizer
MUCH, DONE = 0.25, 1e-3  # of the cost: what a first step promises where the start is near, and at the minimum
KEPT = 0.9  # of what such a step promises, that it takes off
BEGINNINGS = (0.125, 0.25, 0.5, 0.75)  # of the longest motion, for corrections that are not found in all of it
NOISE = 2.0  # sigmas: a start whose residuals are no larger is near, too


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes:
        ends: of all starts, best first; those that diverged last, with an infinite cost.
        optimizer: name of the one that ended the search.
        interrupted: whether Ctrl-C did.
        growths: of the motions at the first start.
        condition: of the Jacobian at the first start; None where the motion diverges there.
        raced: the starts that were raced, in their order; `ends` are then one for each of their groups.
    """

    ends: tuple[Minimum, ...]
    optimizer: str
    interrupted: bool
    growths: tuple[Growth, ...]
    condition: Condition | None = None
    raced: tuple[Raced, ...] = ()


@dataclass(frozen=True)
class Search:
    """What `fit` was asked for, see there."""

    optimizer: str = "auto"
    starts: Sequence[Mapping[str, float]] | int = ()
    windows: Sequence[float] | str = AUTO
    max_iterations: int = 200
    tolerance: float = 1e-10
    progress: Observer | None = None

    def __post_init__(self) -> None:
        check_count("max_iterations", self.max_iterations, 1, MOST_WHOLE, InputError)
        if not is_number(self.tolerance) or not 0 < self.tolerance < 1:
            raise InputError("tolerance", "must lie between 0 and 1", self.tolerance, "give a relative change of cost")
        if self.progress is not None and not callable(self.progress):
            raise InputError("progress", "is not a function", self.progress, "give one, or leave it out")
        if isinstance(self.starts, int):
            check_count("starts", self.starts, 0, MOST_STARTS, InputError)
        elif not isinstance(self.starts, Sequence) or not all(isinstance(one, Mapping) for one in self.starts):
            fix = "give values by the names of parameters for each start, or a number of starts"
            raise InputError("starts", "must be a list of mappings", self.starts, fix)
        if isinstance(self.windows, str):
            if self.windows != AUTO:
                raise InputError("windows", "are unknown", self.windows, "give lengths in s, [] for none, or 'auto'")
            return
        w = numbers("windows", self.windows, InputError)
        if w.ndim != 1 or not (np.isfinite(w).all() and (np.diff(w, prepend=0.0) > 0).all()):
            raise InputError("windows", "must be positive and increase", self.windows, "give lengths in s")

    def run(self, problem: FitProblem) -> Found:
        """Search from every start.

        Raises:
            InputError: starts of what is not fitted, or windows that hold no frame.
            SheetbendError: no start has an answer.
        """
        name = named(self.optimizer)
        points = self._points(problem)
        for length in () if self.windows == AUTO else self.windows:
            cut(problem, float(length))
        if isinstance(self.starts, int) and len(points) > 1:
            return self._raced(problem, name, points)
        return self._searched([_Way(self, problem, name, u) for u in points])

    def stopped(self, problem: FitProblem, undone: str) -> Found:
        """What was found where Ctrl-C came before the search: where it would begin.

        Args:
            undone: what comes before a search and was not done, in words.

        Raises:
            KeyboardInterrupt: the motion has no answer there.
        """
        name, u = named(self.optimizer), problem.parameters.initial()
        end = _Way(self, problem, name, u, u=u).interrupted()
        if end is None:
            raise KeyboardInterrupt
        end = replace(end, first=end.cost, message=f"interrupted before the search: {undone}")
        return Found((end,), name, True, growths(problem, u))

    def _searched(self, ways: Sequence[_Way]) -> Found:
        """One way after the other to its end."""
        name, ends, began = ways[0].optimizer, list[Minimum](), tuple[Growth, ...]()
        for way in ways:
            try:
                grown = growths(way.problem, way.start) if not ends or self.windows == AUTO else ()
                began = began or grown
                ends.append(way.end(grown))
            except KeyboardInterrupt:
                end = way.interrupted()
                if end is None and not ends:  # before the first point of the first start
                    raise
                return Found(_best_first(ends if end is None else [*ends, end]), name, True, began, ways[0].condition)
            except SheetbendError as error:
                ends.append(way.diverged(str(error)))
            if ends[-1].interrupted:
                return Found(_best_first(ends), name, True, began, ways[0].condition)
        if not any(np.isfinite(end.cost) for end in ends):
            raise SheetbendError(ends[0].message)
        return Found(_best_first(ends), name, False, began, ways[0].condition)

    def _raced(self, problem: FitProblem, name: str, points: Sequence[np.ndarray]) -> Found:
        """Race all starts, and go on from the best of each group. Ctrl-C while they race ends at the best of those that
        have ended.

        Raises:
            KeyboardInterrupt: none has, or the whole motion has no answer there.
        """
        whole = problem.uncorrected(problem.recordings) if problem.corrects_markers else problem
        auto = isinstance(self.windows, str)
        course = Course(whole, chosen(problem, growths(problem, points[0])) if auto else [*map(float, self.windows)])
        window = None if math.isinf(course.lengths[-1]) else course.lengths[-1]
        condition = self._told(Approach(course.last, points[0]), window)

        ended = list[Raced]()

        def observe(end: Raced, number: int) -> None:
            ended.append(end)
            if self.progress is not None and math.isfinite(end.cost):
                self.progress(Progress(0, end.cost, end.u.copy(), window, start=(number, len(points))))

        onward = replace(self, windows=() if window is None else (window,))
        try:
            raced = race(course, points, observe)
        except KeyboardInterrupt:
            best = min(ended, key=lambda end: end.cost, default=None)
            end = None if best is None else _Way(onward, problem, name, best.u, u=best.u).interrupted()
            if end is None:
                raise
            words = f"interrupted: the best of {len(ended)} starts that had ended of {len(points)}"
            return Found((replace(end, message=words),), name, True, growths(problem, end.u), condition)
        ways = []
        for number, group in enumerate(groups_of(raced), 1):
            best, first = min(group, key=lambda end: end.cost), whole.cost(group[0].first)
            took = Tally(0, sum(end.evaluations for end in group), sum(end.jacobians for end in group))
            ways.append(_Way(onward, problem, name, best.u, number, taken=took, first=_finite(first)))
        if not ways:
            raise SheetbendError(raced[0].message)
        return replace(onward._searched(ways), condition=condition, raced=raced)

    def _told(self, walk: Approach, window: float | None) -> Condition | None:
        """The condition where a walk begins, also told to whoever follows the progress."""
        if walk.jacobian is None:
            return None
        found = Condition.of(walk.jacobian, walk.problem.parameters.free, window)
        if self.progress is not None:
            self.progress(Progress(0, walk.cost, walk.u.copy(), window, found))
        return found

    def onward(self, problem: FitProblem, u: np.ndarray) -> Minimum:
        """Search on the whole motion from a point that came out of its windows. Ctrl-C ends it with its best so far.

        Raises:
            SheetbendError: the motion has no answer there.
        """
        return _Way(replace(self, windows=()), problem, named(self.optimizer), u).end(())

    def _points(self, problem: FitProblem) -> list[np.ndarray]:
        if isinstance(self.starts, int):
            return [off_bounds(problem.parameters, u) for u in drawn(problem.parameters, self.starts)]
        first = problem.parameters.to_physical(problem.parameters.initial())
        points = [problem.parameters.initial()]
        for changes in self.starts:
            unknown = set(changes) - set(problem.parameters.free)
            if unknown:
                raise InputError(
                    "starts", "name no free parameter", sorted(unknown), f"use: {', '.join(problem.parameters.free)}"
                )
            points.append(problem.parameters.to_internal(first | dict(changes)))
        return [off_bounds(problem.parameters, u) for u in points]


def _best_first(ends: Sequence[Minimum]) -> tuple[Minimum, ...]:
    return tuple(sorted(ends, key=lambda m: m.cost))


def _finite(cost: float) -> float | None:
    return cost if math.isfinite(cost) else None


def fitted_window(part: FitProblem, u: np.ndarray, tolerance: float) -> Approach:
    """At a minimum of a window, searched from u; its cost is infinite where the window has no answer there."""
    walk = Approach(part, u)
    while walk.iterations < STEPS and walk.step():
        if walk.promised < tolerance or walk.taken < tolerance:
            break
    return walk


@dataclass
class _Way:
    """From one start to its end: what it went through, and where it is."""

    search: Search
    problem: FitProblem
    optimizer: str
    start: np.ndarray
    group: int = 0  # of raced starts
    windows: list[float] = field(default_factory=list)  # s, that were fitted
    taken: Tally = field(default_factory=Tally)
    first: float | None = None  # cost of the whole motion at the start
    u: np.ndarray | None = None  # the best point of what was fitted last
    condition: Condition | None = None  # at the start

    def end(self, grown: Sequence[Growth]) -> Minimum:
        """Raises SheetbendError where the whole motion diverges at the start and after every window."""
        most = self.search.max_iterations
        whole = self.problem.uncorrected(self.problem.recordings) if self.problem.corrects_markers else self.problem
        given = [] if isinstance(self.search.windows, str) else [float(length) for length in self.search.windows]
        if given:
            self._began(self.start, whole.cost(self.start))
            self.taken.evaluations += 1
            walk = self._through(whole, given, self.start)
        else:
            walk = Approach(whole, self.start, self.taken)
            self._began(walk.u, walk.cost)
            self.condition = self.search._told(walk, None)
        if self.search.windows == AUTO:
            lengths = chosen(self.problem, grown)
            if (lengths or not np.isfinite(walk.cost)) and not self._starts_near(walk):
                walk = self._through(whole, lengths, self.start)
        if not np.isfinite(walk.cost):
            raise SheetbendError(f"the fit cannot start: {whole.failure}")
        self._walk(walk, NEAR_TOLERANCE, most - 1, None)
        if whole is not self.problem:
            walk = self._corrected(whole, walk.u)
            self._walk(walk, NEAR_TOLERANCE, most - 1, None)
        end = self._arrived_at(walk) or self._optimized(walk, max(1, most - walk.iterations))
        try:
            end = judged(self.problem, end, end.cost if self.first is None else self.first)
        except KeyboardInterrupt:
            end = replace(end, interrupted=True)
        return self._counted(end)

    def _corrected(self, whole: FitProblem, u: np.ndarray) -> Approach:
        """From a fit that takes what drives the scenes for the truth to one that corrects it. Where no correction of
        the whole motion is found at once, those of its beginnings are, each from the one before."""
        walk = Approach(self.problem.follow(whole), u, self.taken)
        if np.isfinite(walk.cost):
            return walk
        pairs = zip(self.problem.experiments, self.problem.recordings, strict=True)
        longest = max((float(r.times[-1]) - e.t0 for e, r in pairs if not e.static), default=0.0)
        parts = [share * longest for share in BEGINNINGS if holds_frames(self.problem, share * longest)]
        for length, walk in along(self.problem, [*parts, math.inf], u, self.taken, partial(cut, corrected=True)):
            if math.isinf(length):
                return walk
            self._walk(walk, TOLERANCE, min(STEPS, self.search.max_iterations), length)
            self.windows.append(length)
        raise AssertionError("the whole motion comes last")

    def _arrived_at(self, walk: Approach) -> Minimum | None:
        """Where the walk ended, if its last step promised less than a tolerance that is no finer than the walk's own:
        derivatives at an optimizer's start and end would tell nothing more."""
        if walk.problem is not self.problem or not max(walk.promised, LEAST) < self.search.tolerance:
            return None
        words = f"the last step promised {walk.promised:.2g} of the cost, less than the tolerance"
        return Minimum(walk.u, walk.cost, 0, 0, True, False, words)

    def _optimized(self, walk: Approach, most: int) -> Minimum:
        """On from a walk by the optimizer."""
        observe, first = self._observer(None, self.taken.iterations), walk.cost if np.isfinite(walk.cost) else None
        return minimize(self.problem, walk.u, self.optimizer, most, self.search.tolerance, observe, first=first)[0]

    def _began(self, u: np.ndarray, cost: float) -> None:
        if np.isfinite(cost):
            self.first, self.u = cost if self.first is None else self.first, u

    def interrupted(self) -> Minimum | None:
        """The best point so far, after Ctrl-C; None before the first, or where the whole motion diverges there."""
        if self.u is None:
            return None
        cost = self.problem.cost(self.u)
        if not np.isfinite(cost):
            return None
        return self._counted(Minimum(self.u, cost, 0, 1, False, True, "interrupted: the best point so far"))

    def diverged(self, words: str) -> Minimum:
        """The row of a start that has no answer."""
        return self._counted(Minimum(self.start, math.inf, 0, 0, False, False, words))

    def _starts_near(self, walk: Approach) -> bool:
        """Whether the first step on the whole motion promises much of the cost (or nothing is left to promise), keeps
        it, and is short of every limit. Far off, the slope of a long motion promises little."""
        if np.isfinite(walk.cost) and walk.step():
            self._arrived(walk, None)
        noise = walk.cost < 0.5 * NOISE**2 * self.problem.core.data_rows
        if walk.promised < DONE:
            return noise or walk.free
        return walk.free and (noise or (walk.promised > MUCH and walk.taken > KEPT * walk.promised))

    def _through(self, whole: FitProblem, lengths: Sequence[float], u: np.ndarray) -> Approach:
        """Fit window after window; where one diverges at the values of the one before, one in between comes first.
        Gives the whole motion at the end of the last."""
        for length, walk in along(whole, [*lengths, math.inf], u, self.taken):
            if math.isinf(length):
                return walk
            if not self.windows and self.search.windows != AUTO and not self.group:
                self.condition = self.search._told(walk, length)
            self._walk(walk, TOLERANCE, min(STEPS, self.search.max_iterations), length)
            self.windows.append(length)
        raise AssertionError("the whole motion comes last")

    def _walk(self, walk: Approach, tolerance: float, most: int, window: float | None) -> None:
        """Steps until the next promises little, and on the whole motion until it is near. There a step that promises
        less than the tolerance of the search is not taken: it would cost a Jacobian where it ends."""
        if window is None:
            walk.enough = max(LEAST, self.search.tolerance)
        while walk.iterations < most and not (window is None and walk.near) and walk.step():
            self._arrived(walk, window)
            if walk.promised < tolerance or walk.taken < tolerance:
                break

    def _arrived(self, walk: Approach, window: float | None) -> None:
        self.u = walk.u
        observe = self._observer(window, 0)
        if observe is not None:
            observe(Progress(self.taken.iterations, walk.cost, walk.u.copy()))

    def _observer(self, window: float | None, before: int) -> Observer | None:
        observe = self.search.progress
        if observe is None:
            return None
        return lambda p: observe(replace(p, iteration=before + p.iteration, window=window))

    def _counted(self, end: Minimum) -> Minimum:
        return replace(
            end,
            first=self.first,
            iterations=self.taken.iterations + end.iterations,
            evaluations=self.taken.evaluations + end.evaluations,
            jacobians=self.taken.jacobians + end.jacobians,
            windows=tuple(self.windows),
            group=self.group,
        )
