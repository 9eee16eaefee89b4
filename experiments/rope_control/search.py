"""Two searches for a target: L-BFGS, which follows the gradient, and an evolution strategy, which sees costs alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import sheetbend as sb
from motion import Array
from scipy.optimize import minimize
from task import Outcome, Task

SETTLED = 1e-6  # relative decrease of the cost at which L-BFGS stops
LOST = 1e3  # cost of a motion that cannot be simulated, where none before could
DISTURBED = (0.03, 0.1, 0.3)  # sizes of disturbances in turn, in unknowns
FAILURES = (sb.DivergenceError, sb.UnbalancedError)
SPREAD = 0.2  # of CMA-ES at first, in unknowns, of which one of size 1 is a likely motion


@dataclass
class Search:
    """What a search tried: after each rollout the processor time since its start, in s, and the best outcome so far.

    Attributes:
        lost: how many motions could not be simulated, such as those that pull a rope through a post.
    """

    name: str
    best: Array
    seconds: list[float] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    began: float = field(default_factory=time.process_time)
    lost: int = 0

    def note(self, unknowns: Array, outcome: Outcome) -> None:
        if self.outcomes and not outcome.cost < self.outcomes[-1].cost:
            outcome = self.outcomes[-1]
        else:
            self.best = unknowns.copy()
        self.seconds.append(time.process_time() - self.began)
        self.outcomes.append(outcome)

    def continue_with(self, other: Search) -> None:
        """Append what another search has tried."""
        self.name = other.name
        self.lost += other.lost
        for at, outcome in zip(other.seconds, other.outcomes, strict=True):
            better = not self.outcomes or outcome.cost < self.outcomes[-1].cost
            self.outcomes.append(outcome if better else self.outcomes[-1])
            self.seconds.append(other.began + at - self.began)
        if other.outcomes and self.outcomes[-1] is other.outcomes[-1]:
            self.best = other.best

    def note_lost(self, unknowns: Array) -> tuple[float, Array]:
        """A cost above that of the start, which grows with the distance from the best, and its gradient."""
        self.lost += 1
        away = unknowns - self.best
        worst = self.outcomes[0].cost if self.outcomes else LOST
        return 2.0 * worst + float(away @ away), 2.0 * away

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
        try:
            outcome, gradient = task.outcome_and_gradient(unknowns)
        except FAILURES:
            return search.note_lost(unknowns)
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


def descend_again(
    task: Task,
    seconds: float,
    tries: int = 20,
    most: int = 25,
    seed: int = 1,
    descent: Callable[[Task, float, Array, int], Search] = descend,
) -> Search:
    """A descent, and again from the best motion with a disturbance, until the target is reached or the time is spent.

    Contacts that begin, slide and stick put kinks and minima into the cost, at which a descent ends.
    """
    random, began, start = np.random.default_rng(seed), time.process_time(), np.zeros(task.size)
    whole = Search("", start)
    for k in range(tries):
        left = seconds - (time.process_time() - began)
        try:
            whole.continue_with(descent(task, left, start, most))
        except FAILURES:  # the disturbed motion cannot be simulated
            whole.lost += 1
        if left < 0.0 or whole.outcomes[-1].reached:
            break
        start = whole.best + DISTURBED[k % len(DISTURBED)] * random.standard_normal(task.size)
    return whole


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
            try:
                outcome = task.outcome(unknowns)
            except FAILURES:
                costs.append(search.note_lost(unknowns)[0])
                continue
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
