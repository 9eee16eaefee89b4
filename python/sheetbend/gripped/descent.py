"""From starting values to a minimum of a rope's problem, and no further than the answer gains by it.

The cost has long flat valleys (GJ against roll, damping against drag), where a relative change of the cost says little
of what is left to go. A step that is right to first order lowers the cost by half the squared distance to the minimum
in standard deviations, times the residual variance and the number of frames over which residuals are alike. So the
descent ends where the next step promises less than a distance of a few hundredths.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..approach import Approach
from ..experiment import Experiment
from ..optimizers import ROUNDING, STUCK
from ..parameters import Parameter
from ..problem import FitProblem
from .model import NAME
from .pieces import problem_of

DISTANCE = 0.03  # standard deviations to the minimum, of a parameter, at which a descent has ended
ALIKE = 20.0  # frames over which residuals of a moving rope are alike, at least


@dataclass(frozen=True)
class Descent:
    """Where a descent ended.

    Attributes:
        values: of all parameters.
        cost: half the sum of squared residuals; infinite where the start has no answer.
        iterations: steps.
        ended: whether a minimum was reached.
    """

    values: dict[str, float]
    cost: float
    iterations: int
    ended: bool

    @property
    def finite(self) -> bool:
        """Whether there is an answer."""
        return bool(np.isfinite(self.cost))


def negligible(problem: FitProblem) -> float:
    """Share of the cost below which a promised decrease is a small part of the interval."""
    return len(problem.parameters.free) * DISTANCE**2 * ALIKE / max(problem.core.data_rows, 1)


def bearable(problem: FitProblem, cost: float) -> bool:
    """Whether a cost is one of motions that stay near the rope: off by less than its length on average."""
    name, u = f"{NAME}_length", problem.parameters.initial()
    worst = [problem.values_of(e, u).get(name, e.scene.quantities[name].value) / e.sigma for e in problem.experiments]
    return bool(cost < 0.5 * problem.core.data_rows * max(worst) ** 2)


def descend(
    experiments: Sequence[Experiment],
    parameters: Sequence[Parameter],
    values: Mapping[str, float],
    most: int,
    threads: int = 1,
    enough: float = 0.0,
    followed: Callable[[int, float], None] = lambda iteration, cost: None,
) -> Descent:
    """Down from `values`; a state that diverges costs infinitely much, so that the last finite one stays.

    Args:
        most: steps.
        enough: share of the cost that a step must promise and take off, where that is more than `negligible`.
        followed: called with each step's number and cost.
    """
    problem = problem_of(experiments, parameters, values, threads)
    walk = Approach(problem, problem.parameters.initial())
    least, ended, first = max(enough, negligible(problem)), False, walk.cost
    if not bearable(problem, walk.cost):
        return Descent(problem.parameters.to_physical(walk.u), np.inf, 0, False)
    while walk.iterations < most:
        if not walk.step():  # nothing left to promise, or no shorter step helps
            ended = walk.promised < max(least, STUCK) or walk.promised * walk.cost <= ROUNDING * first
            break
        followed(walk.iterations, walk.cost)
        if walk.promised < least or walk.taken < enough:
            ended = True
            break
    return Descent(problem.parameters.to_physical(walk.u), walk.cost, walk.iterations, ended)
