"""How a fit finds its minimum: from every start on its way (`way`), and the lowest end wins.

Of many starts (`starts = 32`) all are raced through the windows first, and the best of each group goes on (`race`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.checks import check_count
from ..errors import InputError, SheetbendError
from ..problem.problem import FitProblem
from .approach import Approach, Tally
from .conditioning import Condition
from .growth import Growth, growths
from .optimizers import named
from .progress import Minimum, Progress
from .race import Course, Raced, groups_of, race
from .starts import drawn, off_bounds
from .way import Settings, Way
from .windows import STEPS, chosen, cut

MOST_STARTS = 10**5


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
class Search(Settings):
    """What `fit` was asked for, see there."""

    starts: Sequence[Mapping[str, float]] | int = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.starts, int):
            check_count("starts", self.starts, 0, MOST_STARTS, InputError)
        elif not isinstance(self.starts, Sequence) or not all(isinstance(one, Mapping) for one in self.starts):
            fix = "give values by the names of parameters for each start, or a number of starts"
            raise InputError("starts", "must be a list of mappings", self.starts, fix)

    def run(self, problem: FitProblem) -> Found:
        """Search from every start.

        Raises:
            InputError: starts of what is not fitted, or windows that hold no frame.
            SheetbendError: no start has an answer.
        """
        named(self.optimizer)  # raises before any work
        points = self._points(problem)
        for length in self.lengths or ():
            cut(problem, length)
        if isinstance(self.starts, int) and len(points) > 1:
            return self._raced(problem, points)
        return self._searched([Way(self, problem, u) for u in points])

    def stopped(self, problem: FitProblem, undone: str) -> Found:
        """What was found where Ctrl-C came before the search: where it would begin.

        Args:
            undone: what comes before a search and was not done, in words.

        Raises:
            KeyboardInterrupt: the motion has no answer there.
        """
        u = problem.parameters.initial()
        end = Way(self, problem, u, u=u).interrupted()
        if end is None:
            raise KeyboardInterrupt
        end = replace(end, first=end.cost, message=f"interrupted before the search: {undone}")
        return Found((end,), named(self.optimizer), True, growths(problem, u))

    def _searched(self, ways: Sequence[Way]) -> Found:
        """One way after the other to its end."""
        name, ends, began = named(self.optimizer), list[Minimum](), tuple[Growth, ...]()
        for way in ways:
            try:
                grown = growths(way.problem, way.start) if not ends or self.lengths is None else ()
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

    def _raced(self, problem: FitProblem, points: Sequence[np.ndarray]) -> Found:
        """Race all starts, and go on from the best of each group. Ctrl-C while they race ends at the best of those that
        have ended.

        Raises:
            KeyboardInterrupt: none has, or the whole motion has no answer there.
        """
        whole = problem.uncorrected(problem.recordings) if problem.corrects_markers else problem
        lengths = chosen(problem, growths(problem, points[0])) if self.lengths is None else self.lengths
        course = Course(whole, lengths)
        window = None if math.isinf(course.lengths[-1]) else course.lengths[-1]
        condition = self.told(Approach(course.last, points[0]), window)

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
            end = None if best is None else Way(onward, problem, best.u, u=best.u).interrupted()
            if end is None:
                raise
            words = f"interrupted: the best of {len(ended)} starts that had ended of {len(points)}"
            end = replace(end, message=words)
            return Found((end,), named(self.optimizer), True, growths(problem, end.u), condition)
        ways = []
        for number, group in enumerate(groups_of(raced), 1):
            best, first = min(group, key=lambda end: end.cost), whole.cost(group[0].first)
            took = Tally(0, sum(end.evaluations for end in group), sum(end.jacobians for end in group))
            ways.append(Way(onward, problem, best.u, number, taken=took, first=_finite(first)))
        if not ways:
            raise SheetbendError(raced[0].message)
        return replace(onward._searched(ways), condition=condition, raced=raced)

    def onward(self, problem: FitProblem, u: np.ndarray) -> Minimum:
        """Search on the whole motion from a point that came out of its windows. Ctrl-C ends it with its best so far.

        Raises:
            SheetbendError: the motion has no answer there.
        """
        return Way(replace(self, windows=()), problem, u).end(())

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
    for _ in walk.steps(STEPS, tolerance):
        pass
    return walk
