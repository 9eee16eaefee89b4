"""Two ways to a task's target: along the gradient by L-BFGS, and by an evolution strategy that sees costs alone."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from motion import Array
from scipy.optimize import minimize
from task import Outcome, Task

SETTLED = 1e-6  # relative decrease of the cost at which L-BFGS stops
SPREAD = 0.2  # of CMA-ES at first, in unknowns, of which one of size 1 is a likely motion


@dataclass
class Search:
    """What a search tried: after each rollout the seconds since its start and the best outcome so far."""

    name: str
    best: Array
    seconds: list[float] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)

    def note(self, unknowns: Array, outcome: Outcome) -> None:
        if self.outcomes and not outcome.cost < self.outcomes[-1].cost:
            outcome = self.outcomes[-1]
        else:
            self.best = unknowns.copy()
        self.seconds.append(time.perf_counter() - self.began)
        self.outcomes.append(outcome)

    def reached_after(self) -> int | None:
        """Rollouts."""
        return next((k + 1 for k, outcome in enumerate(self.outcomes) if outcome.reached), None)


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
        outcome, gradient = task.outcome_and_gradient(unknowns)
        search.note(unknowns, outcome)
        return outcome.cost, gradient

    def in_time(_: Array) -> None:
        if search.seconds[-1] > seconds:
            raise StopIteration

    options = {"maxiter": most, "maxfun": most, "ftol": SETTLED}
    minimize(tried, first, jac=True, method="L-BFGS-B", callback=in_time, options=options)
    if not search.outcomes[-1].reached:
        task.require_gradient(search.best)
    return search


def evolve(task: Task, seconds: float, seed: int = 1) -> Search | None:
    """CMA-ES from no motion, until the time is spent; None where the package cma is not installed."""
    try:
        import cma
    except ModuleNotFoundError as error:
        if error.name != "cma":
            raise
        return None
    options = {"verbose": -9, "seed": seed}
    search = Search("CMA-ES", np.zeros(task.size))
    strategy = cma.CMAEvolutionStrategy(search.best, SPREAD, options)
    while not search.seconds or search.seconds[-1] < seconds:
        tried = strategy.ask()
        costs = []
        for unknowns in tried:
            outcome = task.outcome(unknowns)
            search.note(unknowns, outcome)
            costs.append(outcome.cost)
        strategy.tell(tried, costs)
    return search


def gradient_gap(task: Task, unknowns: Array, directions: Array | None = None, step: float = 1e-3) -> float:
    """The largest gap between the gradient and central differences (one Richardson step), over its largest entry.

    Args:
        directions: (k, unknowns), unit vectors; every unknown by default.
    """
    along = np.eye(task.size) if directions is None else directions

    def cost(unknowns: Array) -> float:
        return task.outcome(unknowns).cost

    def central(direction: Array, size: float) -> float:
        return (cost(unknowns + size * direction) - cost(unknowns - size * direction)) / (2.0 * size)

    _, gradient = task.outcome_and_gradient(unknowns)
    rough = [(4.0 * central(d, step / 2.0) - central(d, step)) / 3.0 for d in along]
    return float(np.abs(along @ gradient - rough).max() / np.abs(gradient).max())
