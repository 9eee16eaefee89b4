"""From starting values to a minimum of a rope's problem, and no further than the answer gains by it.

The cost has long flat valleys (GJ against roll, damping against drag), where a relative change of the cost says little
of what is left to go. A step that is right to first order lowers the cost by half the squared distance to the minimum
in standard deviations, times the residual variance and the number of frames over which residuals are alike. So the
descent ends where the next step promises less than a tenth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..minimum.approach import Approach
from ..minimum.slope import ROUNDING, STUCK
from ..problem.problem import FitProblem
from .model import NAME

DISTANCE = 0.1  # standard deviations to the minimum, of a parameter, at which a descent has ended
ALIKE = 20.0  # frames over which residuals of a moving rope are alike, at least
CORRECTIONS = 4  # of a derivative, until it is computed again
DEAR = 15  # parameters, from which on that is worth it


@dataclass(frozen=True)
class Descent:
    """Where a descent ended.

    Attributes:
        values: of all parameters.
        cost: half the sum of squared residuals; infinite where the start has no answer.
        iterations: steps.
        ended: whether a minimum was reached.
        jacobian: (rows, free) the last derivative, at the end or not far from it; None where none was made.
    """

    values: dict[str, float]
    cost: float
    iterations: int
    ended: bool
    jacobian: Array | None = None

    @property
    def finite(self) -> bool:
        """Whether there is an answer."""
        return bool(np.isfinite(self.cost))


class Sparing(Approach):
    """A walk whose steps share derivatives: after a short step that kept its promise the last derivative is corrected
    by what the step showed (Broyden 1965), in units of the longest steps. With forty parameters a derivative costs as
    much as twenty simulations.

    Attributes:
        sure: whether the last step followed a derivative that was computed where it began.
        computed: number of such steps so far.
        latest: the last derivative.
    """

    def __init__(self, problem: FitProblem, u: Array) -> None:
        super().__init__(problem, u)
        self.sure, self.computed, self._corrected = True, 0, 0
        self._most = CORRECTIONS if len(self.u) >= DEAR else 0
        self.latest = self._J

    def step(self) -> bool:
        """As `Approach.step`; a corrected derivative that shows no way down is computed first."""
        if self._J is None:
            self._compute()
        u, r, J, radius = self.u, self._r, self._J, self._radius
        self.latest = J
        self.sure = self._corrected == 0
        moved = super().step()
        if not self.sure:  # what held it up may be the derivative
            self._radius = max(self._radius, radius)
        if not moved:
            if self.sure:
                return False
            self._compute()
            return self.step()
        self.computed += self.sure
        if J is not None and self.near and self._corrected < self._most:
            step = self.u - u
            weighted = step / self._longest**2
            self._J = J + np.outer(self._r - r - J @ step, weighted) / (weighted @ step)
            self._corrected, self.latest = self._corrected + 1, self._J
        elif self._J is not None:  # it came along with the residuals
            self._corrected = 0
        return True

    def renew(self) -> None:
        """Let the next step compute its derivative."""
        if self._corrected:
            self._J = None

    def _compute(self) -> None:
        _, self._r, self._J = self._evaluated(self.u, True)
        self._corrected = 0


def negligible(problem: FitProblem) -> float:
    """Share of the cost below which a promised decrease is a small part of the interval."""
    return len(problem.parameters.free) * DISTANCE**2 * ALIKE / max(problem.core.data_rows, 1)


def bearable(problem: FitProblem, cost: float) -> bool:
    """Whether a cost is one of motions that stay near the rope: off by less than its length on average."""
    name, u = f"{NAME}_length", problem.parameters.initial()
    worst = [problem.values_of(e, u).get(name, e.scene.quantities[name].value) / e.sigma for e in problem.experiments]
    return bool(cost < 0.5 * problem.core.data_rows * max(worst) ** 2)


def descend(problem: FitProblem, most: int, enough: float = 0.0, sure: bool = True) -> Descent:
    """Down from where the problem starts; a state that diverges costs infinitely much, so that the last finite one
    stays.

    Args:
        most: steps that follow a derivative of their own.
        enough: share of the cost that a step must promise and take off, where that is more than `negligible`.
        sure: whether the last step has to follow a derivative of its own; not where another search goes on from there.
    """
    walk = Sparing(problem, problem.parameters.initial())
    least, ended, first = max(enough, negligible(problem)), False, walk.cost
    if not bearable(problem, walk.cost):
        return Descent(problem.parameters.to_physical(walk.u), np.inf, 0, False)
    while walk.computed < most:
        if not walk.step():  # nothing left to promise, or no shorter step helps
            ended = walk.promised < max(least, STUCK) or walk.promised * walk.cost <= ROUNDING * first
            break
        if walk.promised < least or walk.taken < enough:
            if walk.sure or not sure:
                ended = True
                break
            walk.renew()
    return Descent(problem.parameters.to_physical(walk.u), walk.cost, walk.iterations, ended, walk.latest)
