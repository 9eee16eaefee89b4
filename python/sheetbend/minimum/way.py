"""One way of a search, from its start to its end, and how it goes.

It begins on short windows where they help (`windows`), goes on by steps that are limited for each parameter
(`approach`), and ends by Ceres or SciPy once it is near. Corrections of driven markers come last: far from the minimum
they would explain away what the parameters have to.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..arrays.checks import MOST_WHOLE, check_count, is_number, numbers
from ..errors import InputError, SheetbendError
from ..problem.problem import FitProblem
from .approach import LEAST, Approach, Tally
from .conditioning import Condition
from .growth import Growth
from .optimizers import minimize
from .progress import Minimum, Observer, Progress
from .slope import judged
from .windows import STEPS, TOLERANCE, along, chosen, cut, holds_frames

AUTO = "auto"
NEAR_TOLERANCE = 1e-3  # of the cost: what is left is for the optimizer
MUCH, DONE = 0.25, 1e-3  # of the cost: what a first step promises where the start is near, and at the minimum
KEPT = 0.9  # of what such a step promises, that it takes off
BEGINNINGS = (0.125, 0.25, 0.5, 0.75)  # of the longest motion, for corrections that are not found in all of it
NOISE = 2.0  # sigmas: a start whose residuals are no larger is near, too


@dataclass(frozen=True)
class Settings:
    """How a search goes; the arguments of `fit` with these names say what they mean."""

    optimizer: str = "auto"
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
        if isinstance(self.windows, str):
            if self.windows != AUTO:
                raise InputError("windows", "are unknown", self.windows, "give lengths in s, [] for none, or 'auto'")
            return
        w = numbers("windows", self.windows, InputError)
        if w.ndim != 1 or not (np.isfinite(w).all() and (np.diff(w, prepend=0.0) > 0).all()):
            raise InputError("windows", "must be positive and increase", self.windows, "give lengths in s")

    @property
    def lengths(self) -> tuple[float, ...] | None:
        """Of the windows, s; None where they are chosen."""
        return None if isinstance(self.windows, str) else tuple(map(float, self.windows))

    def told(self, walk: Approach, window: float | None) -> Condition | None:
        """The condition where a walk begins, also told to whoever follows the progress."""
        if walk.jacobian is None:
            return None
        found = Condition.of(walk.jacobian, walk.problem.parameters.free, window)
        if self.progress is not None:
            self.progress(Progress(0, walk.cost, walk.u.copy(), window, found))
        return found


@dataclass
class Way:
    """From one start to its end: what it went through, and where it is."""

    settings: Settings
    problem: FitProblem
    start: np.ndarray
    group: int = 0  # of raced starts
    windows: list[float] = field(default_factory=list)  # s, that were fitted
    taken: Tally = field(default_factory=Tally)
    first: float | None = None  # cost of the whole motion at the start
    u: np.ndarray | None = None  # the best point of what was fitted last
    condition: Condition | None = None  # at the start
    last: tuple[int, float | None] | None = None  # number and window of the iteration that was told last

    def end(self, grown: Sequence[Growth]) -> Minimum:
        """Raises SheetbendError where the whole motion diverges at the start and after every window."""
        most, given = self.settings.max_iterations, self.settings.lengths
        whole = self.problem.uncorrected(self.problem.recordings) if self.problem.corrects_markers else self.problem
        if given:
            self._began(self.start, whole.cost(self.start))
            self.taken.evaluations += 1
            walk = self._through(whole, given, self.start)
        else:
            walk = Approach(whole, self.start, self.taken)
            self._began(walk.u, walk.cost)
            self.condition = self.settings.told(walk, None)
        if given is None:
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
            self._walk(walk, TOLERANCE, min(STEPS, self.settings.max_iterations), length)
            self.windows.append(length)
        raise AssertionError("the whole motion comes last")

    def _arrived_at(self, walk: Approach) -> Minimum | None:
        """Where the walk ended, if its last step promised less than a tolerance that is no finer than the walk's own:
        derivatives at an optimizer's start and end would tell nothing more."""
        if walk.problem is not self.problem or not max(walk.promised, LEAST) < self.settings.tolerance:
            return None
        words = f"the last step promised {walk.promised:.2g} of the cost, less than the tolerance"
        return Minimum(walk.u, walk.cost, 0, 0, True, False, words)

    def _optimized(self, walk: Approach, most: int) -> Minimum:
        """On from a walk by the optimizer."""
        own, first = self.settings, walk.cost if np.isfinite(walk.cost) else None

        def observe(p: Progress) -> None:
            self._tell(replace(p, iteration=self.taken.iterations + p.iteration))

        return minimize(self.problem, walk.u, own.optimizer, most, own.tolerance, observe, first=first)[0]

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
            if not self.windows and self.settings.lengths is not None and not self.group:
                self.condition = self.settings.told(walk, length)
            self._walk(walk, TOLERANCE, min(STEPS, self.settings.max_iterations), length)
            self.windows.append(length)
        raise AssertionError("the whole motion comes last")

    def _walk(self, walk: Approach, tolerance: float, most: int, window: float | None) -> None:
        """Steps until the next promises little, and on the whole motion until it is near. There a step that promises
        less than the tolerance of the search is not taken: it would cost a Jacobian where it ends."""
        if window is None:
            walk.enough = max(LEAST, self.settings.tolerance)
        for _ in walk.steps(most, tolerance, lambda: window is None and walk.near):
            self._arrived(walk, window)

    def _arrived(self, walk: Approach, window: float | None) -> None:
        self.u = walk.u
        self._tell(Progress(self.taken.iterations, walk.cost, walk.u.copy(), window))

    def _tell(self, progress: Progress) -> None:
        """Each iteration once: an optimizer begins with the point where the walk, or its own run before, ended."""
        here = progress.iteration, progress.window
        if self.settings.progress is not None and here != self.last:
            self.last = here
            self.settings.progress(progress)

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
