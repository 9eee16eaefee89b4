"""Two ways to a task's target: along the gradient by L-BFGS, and by an evolution strategy that sees costs alone."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize
from task import Array, Task

SETTLED = 1e-6  # relative decrease of the cost at which L-BFGS stops
SPREAD = 0.2  # of CMA-ES at first, in unknowns, of which one of size 1 is a likely motion


@dataclass
class Search:
    """What a search tried: after so many seconds, so many rollouts, the best cost so far and the error in m there."""

    name: str
    best: Array
    seconds: list[float] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)

    def note(self, unknowns: Array, cost: float, error: float) -> None:
        if self.costs and not cost < self.costs[-1]:
            cost, error = self.costs[-1], self.errors[-1]
        else:
            self.best = unknowns.copy()
        self.seconds.append(time.perf_counter() - self.began)
        self.costs.append(cost)
        self.errors.append(error)

    def first_below(self, error: float) -> int | None:
        """The number of rollouts after which the error is first below a bound."""
        return next((k + 1 for k, e in enumerate(self.errors) if e < error), None)


class _OutOfTime(Exception):
    pass


def descend(task: Task, seconds: float, start: Array | None = None, most: int = 1000) -> Search:
    """L-BFGS from no motion, until it settles, or the time or `most` gradients are spent.

    Raises:
        EmptyGradientError: the loss does not feel the control at the start, or where the search stopped short of the
            target.
    """
    first = np.zeros(task.size) if start is None else start
    search = Search("L-BFGS", first)
    task.require_gradient(first)

    def tried(unknowns: Array) -> tuple[float, Array]:
        if search.seconds and (search.seconds[-1] > seconds or len(search.seconds) >= most):
            raise _OutOfTime
        cost, error, gradient = task.cost_and_gradient(unknowns)
        search.note(unknowns, cost, error)
        return cost, gradient

    try:
        minimize(tried, first, jac=True, method="L-BFGS-B", options={"maxiter": most, "maxfun": most, "ftol": SETTLED})
    except _OutOfTime:
        pass
    if search.errors[-1] > task.reached:
        task.require_gradient(search.best)
    return search


def evolve(task: Task, seconds: float, seed: int = 1) -> Search | None:
    """CMA-ES from no motion, until the time is spent; None where the package cma is not installed."""
    try:
        import cma
    except ModuleNotFoundError:
        return None
    options = {"verbose": -9, "seed": seed}
    search = Search("CMA-ES", np.zeros(task.size))
    strategy = cma.CMAEvolutionStrategy(search.best, SPREAD, options)
    while not search.seconds or search.seconds[-1] < seconds:
        tried = strategy.ask()
        costs = []
        for unknowns in tried:
            cost, error = task.cost(unknowns)
            search.note(unknowns, cost, error)
            costs.append(cost)
        strategy.tell(tried, costs)
    return search


def gradient_gap(task: Task, unknowns: Array, step: float = 1e-3) -> float:
    """The largest gap between the gradient and central differences (one Richardson step), over its largest entry."""

    def central(direction: Array, size: float) -> float:
        return (task.cost(unknowns + size * direction)[0] - task.cost(unknowns - size * direction)[0]) / (2.0 * size)

    gradient = task.cost_and_gradient(unknowns)[2]
    rough = [(4.0 * central(d, step / 2.0) - central(d, step)) / 3.0 for d in np.eye(task.size)]
    return float(np.abs(gradient - rough).max() / np.abs(gradient).max())
