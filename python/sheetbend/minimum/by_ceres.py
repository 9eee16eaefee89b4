"""Levenberg-Marquardt by Ceres, where it was built in."""

from __future__ import annotations

import importlib
import importlib.util
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ..problem.coordinates import Coordinates
from ..problem.counts import count
from ..problem.problem import FitProblem
from .geometric import GeometricSteps
from .progress import Best, Minimum


def has_ceres() -> bool:
    """Whether the Ceres module was built, and loads."""
    return importlib.util.find_spec("sheetbend._ceres") is not None and not ceres_trouble()


@cache
def ceres_trouble() -> str:
    """Why a Ceres module that was built does not load, as where its library is of another version; else empty."""
    try:
        importlib.import_module("sheetbend._ceres")
    except ModuleNotFoundError:
        return ""
    except ImportError as error:
        return str(error)
    return ""


def search(problem: FitProblem, u: np.ndarray, max_iterations: int, tolerance: float, best: Best) -> Minimum:
    """Ceres, with coordinates that rest at a limit held there, from the start or from where they come to it: it
    searches along every step that it projects, and comes near a minimum beside a limit by small steps only. Steps that
    become a geometric series are summed up."""
    w = np.clip(problem.coordinates.into(u), *problem.coordinates.limits())
    held = _resting(problem, w)
    spent = [0, 0, 0]
    watch = sums = True
    while True:
        steps = GeometricSteps(wanted=sums and not problem.estimates_corrections)
        watched = Watch(problem.coordinates, best, held, watch, steps, spent[0])
        end, stopped = run(problem, w, max_iterations - spent[0], tolerance, watched)
        spent = [a + b for a, b in zip(spent, (end.iterations, end.evaluations, end.jacobians), strict=True)]
        end = replace(end, iterations=spent[0], evaluations=spent[1], jacobians=spent[2])
        if end.interrupted or (stopped is None and not held):
            return end
        if stopped is not None and steps.sum is not None:
            w = np.clip(steps.sum, *problem.coordinates.limits())
            sums = problem.cost(problem.coordinates.out(w)) < end.cost
            spent[1] += 1
            w = w if sums else stopped
            continue
        w = problem.coordinates.into(end.u) if stopped is None else stopped
        resting = _resting(problem, w)
        if stopped is not None:
            watch = bool(resting - held)
            held |= resting
        elif resting >= held:
            return end
        else:
            held, watch = frozenset(), False


def _resting(problem: FitProblem, w: np.ndarray) -> frozenset[int]:
    """Coordinates that lie at a limit and would go beyond it; not all of them."""
    lower, upper = problem.coordinates.limits()
    if not ((w <= lower) | (w >= upper)).any():
        return frozenset()
    ok, r, J = problem.evaluate(problem.coordinates.out(w))
    if not ok:
        return frozenset()
    slope = problem.coordinates.jacobian(J, w).T @ r
    resting = np.flatnonzero(((w <= lower) & (slope > 0.0)) | ((w >= upper) & (slope < 0.0)))
    return frozenset(resting.tolist()) if len(resting) < len(w) else frozenset()


@dataclass
class Watch:
    """What Ceres calls after every iteration.

    Attributes:
        coordinates: in which it searches.
        best: is told of every point.
        held: coordinates that rest at a limit.
        limits: whether to end the run where others have been at a limit for two iterations.
        steps: of this run; where they have a sum, it ends.
        before: iterations of earlier runs.
        stopped: the point where it ended the run.
    """

    coordinates: Coordinates
    best: Best
    held: frozenset[int]
    limits: bool
    steps: GeometricSteps
    before: int = 0
    stopped: np.ndarray | None = None

    def __post_init__(self) -> None:
        self._limited = np.zeros(len(self.coordinates.longest), dtype=bool)

    def __call__(self, iteration: int, cost: float, step: float, gradient: float, at: list[float]) -> bool:
        lower, upper = self.coordinates.limits()
        here = np.array(at)
        self.best(self.before + iteration, cost, self.coordinates.out(here))
        limited = (here <= lower) | (here >= upper)
        limited[sorted(self.held)] = False
        if self.steps.add(here) and not limited.any():
            self.stopped = here
        elif self.limits and iteration > 1 and (limited & self._limited).any():
            self.stopped, self.steps.sum = here, None
        self._limited = limited
        return self.stopped is None


def run(
    problem: FitProblem, w: np.ndarray, max_iterations: int, tolerance: float, watch: Watch
) -> tuple[Minimum, np.ndarray | None]:
    """One run of Ceres, and where it was ended by what watches it, if it was."""
    from .. import _ceres as ceres

    coordinates = problem.coordinates
    lower, upper = coordinates.limits()
    out: dict[str, Any] = {}
    with suppress(KeyboardInterrupt):
        out = ceres.minimize(
            evaluation=problem.evaluator.capsule(coordinates, problem.known_at(w)),
            u=w,
            lower=lower,
            upper=upper,
            longest_step=coordinates.longest,
            held=sorted(watch.held),
            residual_seconds=problem.seconds.get(False, 0.0),
            max_iterations=max_iterations,
            tolerance=tolerance,
            observe=watch,
        )
    iterations, evaluations, jacobians = (out.get(name, 0) for name in ("iterations", "evaluations", "jacobians"))
    count(evaluations, jacobians)  # which do not come through the problem

    def ended(u: np.ndarray, cost: float, converged: bool, interrupted: bool, message: str) -> Minimum:
        return Minimum(u, cost, iterations, evaluations, converged, interrupted, message, jacobians=jacobians)

    if not out or (out["stopped"] and watch.stopped is None):
        return ended(watch.best.u, watch.best.cost, False, True, "interrupted: the best point so far"), None
    if not 0.0 <= out["cost"] < np.inf:  # Ceres tells a cost of -1 where its first point has no derivatives
        return ended(watch.best.u, watch.best.cost, False, False, out["message"]), None
    end = coordinates.out(np.array(out["u"]))
    if "jacobian" in out and not coordinates.charts:
        problem.keep(end, out["residual"], out["jacobian"])
    return ended(end, out["cost"], out["converged"], False, out["message"]), watch.stopped
