"""Levenberg-Marquardt by Ceres, where it was built in."""

from __future__ import annotations

import importlib
import importlib.util
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from .coordinates import Coordinates
from .counts import count
from .geometric import GeometricSteps
from .problem import FitProblem
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
        left = max_iterations - spent[0]
        steps = GeometricSteps(wanted=sums and not problem.estimates_corrections)
        end, stopped = holding(problem, w, held, left, tolerance, best, watch, steps, spent[0])
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


class _Watch:
    """What Ceres calls after every iteration. It ends the run where the steps have a sum, and if it is to watch, where
    coordinates that are not held have been at a limit for two iterations; `stopped` is that point."""

    def __init__(
        self,
        coordinates: Coordinates,
        held: frozenset[int],
        best: Best,
        watch: bool,
        steps: GeometricSteps,
        first: int,
    ) -> None:
        self._coordinates, self._held, self._best = coordinates, sorted(held), best
        self._watch, self._steps, self._first = watch, steps, first
        self._before = np.zeros(len(coordinates.longest), dtype=bool)
        self.stopped: np.ndarray | None = None

    def __call__(self, iteration: int, cost: float, step: float, gradient: float, at: list[float]) -> bool:
        lower, upper = self._coordinates.limits()
        here = np.array(at)
        self._best(self._first + iteration, cost, self._coordinates.out(here))
        limited = (here <= lower) | (here >= upper)
        limited[self._held] = False
        if self._steps.add(here) and not limited.any():
            self.stopped = here
        elif self._watch and iteration > 1 and (limited & self._before).any():
            self.stopped, self._steps.sum = here, None
        self._before = limited
        return self.stopped is None


def holding(
    problem: FitProblem,
    w: np.ndarray,
    held: frozenset[int],
    max_iterations: int,
    tolerance: float,
    best: Best,
    watch: bool,
    steps: GeometricSteps,
    first: int = 0,
) -> tuple[Minimum, np.ndarray | None]:
    """One run, whose iterations count on from `first`, and where `_Watch` ended it, if it did."""
    from .. import _ceres as ceres

    coordinates = problem.coordinates
    lower, upper = coordinates.limits()
    watched = _Watch(coordinates, held, best, watch, steps, first)
    out: dict[str, Any] = {}
    with suppress(KeyboardInterrupt):
        out = ceres.minimize(
            evaluation=problem.evaluator.capsule(coordinates, problem.known_at(w)),
            u=w,
            lower=lower,
            upper=upper,
            longest_step=coordinates.longest,
            held=sorted(held),
            residual_seconds=problem.seconds.get(False, 0.0),
            max_iterations=max_iterations,
            tolerance=tolerance,
            observe=watched,
        )
    iterations, evaluations, jacobians = (out.get(name, 0) for name in ("iterations", "evaluations", "jacobians"))
    count(evaluations, jacobians)  # which do not come through the problem

    def ended(u: np.ndarray, cost: float, converged: bool, interrupted: bool, message: str) -> Minimum:
        return Minimum(u, cost, iterations, evaluations, converged, interrupted, message, jacobians=jacobians)

    if not out or (out["stopped"] and watched.stopped is None):
        return ended(best.u, best.cost, False, True, "interrupted: the best point so far"), None
    if not 0.0 <= out["cost"] < np.inf:  # Ceres tells a cost of -1 where its first point has no derivatives
        return ended(best.u, best.cost, False, False, out["message"]), None
    end = coordinates.out(np.array(out["u"]))
    if "jacobian" in out and not coordinates.charts:
        problem.keep(end, out["residual"], out["jacobian"])
    return ended(end, out["cost"], out["converged"], False, out["message"]), watched.stopped
