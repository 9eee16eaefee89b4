"""How a fit finds its minimum: from every start, through short windows first where they are asked for.

The cost of a long motion is rugged far from its minimum, and where the motion is sensitive its derivative says nothing
about a large step. Over a short window from the same start it is smooth. Corrections of driven markers come last: far
from the minimum they would explain away what the parameters have to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .errors import InputError
from .optimizers import Minimum, Observer, Progress, judged, minimize
from .problem import FitProblem

WINDOW_TOLERANCE = 1e-3  # relative, of the cost: a window's minimum is only a start


@dataclass(frozen=True)
class Search:
    """What `fit` was asked for, see there."""

    optimizer: str = "auto"
    starts: Sequence[Mapping[str, float]] = ()
    windows: Sequence[float] = ()
    max_iterations: int = 200
    tolerance: float = 1e-10
    progress: Observer | None = None

    def __post_init__(self) -> None:
        if self.max_iterations < 1:
            raise InputError("max_iterations", "must be positive", self.max_iterations, "give at least 1")
        if not 0 < self.tolerance < 1:
            raise InputError("tolerance", "must lie between 0 and 1", self.tolerance, "give a relative change of cost")
        w = np.array(self.windows, dtype=float)
        if not (np.isfinite(w).all() and (np.diff(w, prepend=0.0) > 0).all()):
            raise InputError("windows", "must be positive and increase", list(self.windows), "give lengths in s")

    def run(self, problem: FitProblem) -> tuple[list[Minimum], str, bool]:
        """Ends of all starts, best first; the optimizer's name; whether Ctrl-C ended the search.

        Raises:
            InputError: starts of what is not fitted, or windows that hold no frame.
            SheetbendError: a start has no answer.
        """
        first: list[tuple[float | None, FitProblem]] = [(length, _cut(problem, length)) for length in self.windows]
        if problem.estimates_corrections:
            first.append((None, problem.uncorrected(problem.recordings)))
        ends: list[Minimum] = []
        interrupted, name = False, ""
        for u in self._points(problem):
            try:
                end, name = self._end(problem, first, u)
            except KeyboardInterrupt:  # before the first point of this start
                if not ends:
                    raise
                interrupted = True
                break
            ends.append(end)
            if end.interrupted:
                interrupted = True
                break
        return sorted(ends, key=lambda m: m.cost), name, interrupted

    def _points(self, problem: FitProblem) -> list[np.ndarray]:
        first = problem.parameters.to_physical(problem.parameters.initial())
        points = [problem.parameters.initial()]
        for changes in self.starts:
            unknown = set(changes) - set(problem.parameters.free)
            if unknown:
                raise InputError(
                    "starts", "name no free parameter", sorted(unknown), f"use: {', '.join(problem.parameters.free)}"
                )
            points.append(problem.parameters.to_internal(first | dict(changes)))
        return points

    def _end(
        self, problem: FitProblem, before: Sequence[tuple[float | None, FitProblem]], u: np.ndarray
    ) -> tuple[Minimum, str]:
        first, iterations = _cost(before[-1][1] if problem.estimates_corrections else problem, u) if before else None, 0
        for length, part in before:
            tolerance = max(self.tolerance, WINDOW_TOLERANCE)
            end, name = minimize(part, u, self.optimizer, self.max_iterations, tolerance, self._observer(length))
            u, iterations = end.u, iterations + end.iterations
            if end.interrupted:
                cost = _cost(problem, u)
                if cost is None:
                    raise KeyboardInterrupt
                return replace(end, cost=cost, first=first, iterations=iterations), name
        end, name = minimize(problem, u, self.optimizer, self.max_iterations, self.tolerance, self._observer(None))
        began = first if before else end.first
        try:
            end = judged(problem, end, end.cost if began is None else began)
        except KeyboardInterrupt:
            end = replace(end, interrupted=True)
        return replace(end, first=began, iterations=iterations + end.iterations), name

    def _observer(self, window: float | None) -> Observer | None:
        observe = self.progress
        if observe is None:
            return None

        def told(progress: Progress) -> None:
            observe(replace(progress, window=window))

        return told


def _cost(problem: FitProblem, u: np.ndarray) -> float | None:
    """None where the motion diverges."""
    ok, r, _ = problem.evaluate(u, jacobian=False)
    return 0.5 * float(r @ r) if ok else None


def _cut(problem: FitProblem, length: float) -> FitProblem:
    """The problem with the first `length` s of every motion from its scene's start on."""
    pieces = []
    for e, recording in zip(problem.experiments, problem.recordings, strict=True):
        last = e.t0 + length
        if not e.static and not (recording.times < last).any():
            fix = "make it longer, or leave it out"
            raise InputError("windows", f"hold no fitted frame of '{e.name}'", length, fix)
        pieces.append(recording if e.static else recording.piece(None, last))
    return problem.uncorrected(pieces)
