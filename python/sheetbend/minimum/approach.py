"""The way from a start far off to the neighborhood of a minimum: Gauss-Newton steps inside a box.

A trust region of one radius, as Ceres and SciPy have it, suits all parameters at once. In logarithms that fails in two
ways: a parameter that the data hardly see at this point (a drag far too small) is thrown by tens of decades in a step
and never returns, or the radius shrinks for its sake and holds up all others. Here each parameter has its own limit for
one step (a factor of 10 on a log scale, a natural scale elsewhere), and the linear least-squares problem is
solved inside that box: what would go further stops at its side, and the others take the step that is best given that.
A weak ridge keeps parameters where they are as long as moving them promises next to nothing. Steps are taken in the
coordinates of the problem (`coordinates`), in which no step leaves the possible bodies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..arrays.types import Array
from ..problem.coordinates import Coordinates
from ..problem.counts import counted
from ..problem.triangle import triangle
from ..quantities.parameters import Parameters

RIDGE = 1e-3  # of the cost: what a parameter's longest step must promise to be worth taking
GOOD, POOR = 0.75, 0.25  # of the decrease that the linear model promises
WITHIN = 0.9  # of the way to the box's side: such a step was not held up by it
NEAR = 0.2  # of the longest step: so short a step, and as good as promised, is near the minimum
LEAST = 1e-8  # of the cost: steps that promise less are left to the optimizer
SHORTEST = 1e-6  # of the longest step: where no shorter one helps, the slope is wrong


@dataclass
class Tally:
    """What several walks took: steps, simulations of all experiments, and how many of these with a Jacobian."""

    iterations: int = 0
    evaluations: int = 0
    jacobians: int = 0


class Walked(Protocol):
    """What a walk asks of a problem: `problem.FitProblem`, or many recordings (`many.ManyProblem`)."""

    @property
    def parameters(self) -> Parameters: ...

    @property
    def coordinates(self) -> Coordinates: ...

    @property
    def cheap_jacobian(self) -> bool: ...

    def evaluate(self, u: Array, jacobian: bool = True) -> tuple[bool, Array, Any]: ...


class Approach:
    """A walk along such steps on one problem.

    Attributes:
        u: (free,) where it is, with its cost (half the sum of squares): infinite where the start has no answer.
        free: whether its last step was as good as promised at the first try, and held up by no limit.
        near: whether the last step was as good as promised, held up by no limit, and a small part of the longest.
        enough: share of the cost that a step must promise.
        promised: share of the cost that the last step was to take off.
        taken: share of the cost that it took off.
        iterations: steps so far.
    """

    def __init__(self, problem: Walked, u: Array, tally: Tally | None = None) -> None:
        self.problem, self._tally = problem, tally or Tally()
        self._lower, self._upper = problem.coordinates.limits()
        self._w = np.clip(problem.coordinates.into(u), self._lower, self._upper)
        self.u = problem.coordinates.out(self._w)
        self._longest, self._radius = problem.coordinates.longest, 1.0
        self.free = self.near = False
        self.promised = self.taken = 1.0
        self.enough = LEAST
        self.iterations = 0
        self.cost, self._r, self._J = self._evaluated(self.u, True)

    @property
    def least(self) -> float:
        """Share of the cost below which no step is taken."""
        return self.enough

    def _inside(self, J: Any, lower: Array, upper: Array) -> Array:
        """The best step in a box."""
        return inside(J, self._r, math.sqrt(2.0 * RIDGE * self.cost) / self._longest, lower, upper)

    def _finite(self) -> bool:
        return self._J is not None and bool(np.isfinite(self._J).all())

    def _evaluated(self, u: Array, jacobian: bool) -> tuple[float, Array, Any]:
        before = counted()
        ok, r, J = self.problem.evaluate(u, jacobian)
        made = counted()
        self._tally.evaluations += made[0] - before[0]
        self._tally.jacobians += made[1] - before[1]
        cost = 0.5 * float(r @ r) if ok else math.inf
        return (cost, r, J if jacobian else None) if math.isfinite(cost) else (math.inf, r, None)

    @property
    def jacobian(self) -> Array | None:
        """(rows, free) where it is, if it was made there."""
        return self._J

    def steps(self, most: int, least: float, arrived: Callable[[], bool] = lambda: False) -> Iterator[None]:
        """Steps, up to `most` in all, until one promises or takes off less than a share `least` of the cost.

        Args:
            arrived: whether to stop here; asked before every step.
        """
        while self.iterations < most and not arrived() and self.step():
            yield
            if self.promised < least or self.taken < least:
                return

    def step(self) -> bool:
        """Go to a lower cost; False where no step inside the limits promises or gives one."""
        if self._J is None:
            _, self._r, self._J = self._evaluated(self.u, True)
        if self.cost == 0.0:
            self.promised = 0.0
            return False
        if self._J is None or not self._finite():
            return False
        longest, tries, coordinates = self._longest, 0, self.problem.coordinates
        slopes = coordinates.jacobian(self._J, self._w)
        while self._radius > SHORTEST:
            tries += 1
            box = self._radius * longest
            lower, upper = np.maximum(self._lower - self._w, -box), np.minimum(self._upper - self._w, box)
            s = self._inside(slopes, lower, upper)
            promised = self.cost - 0.5 * float(np.sum((self._r + slopes @ s) ** 2))
            self.promised = promised / self.cost
            if self.promised < self.least:
                return False
            w = self._w + s
            u = coordinates.out(w)
            cost, r, J = self._evaluated(u, self.problem.cheap_jacobian)
            share, used = (self.cost - cost) / promised, float(np.max(np.abs(s) / longest))
            inner = share > GOOD and used < WITHIN * self._radius
            if share < POOR:
                self._radius = 0.3 * min(self._radius, used)
            elif share > GOOD:
                self._radius = min(1.0, 3.0 * self._radius)
            if share > 0.0:
                self.near = inner and used < NEAR
                self.free = inner and tries == 1
                self.taken = 1.0 - cost / self.cost
                self._w, self.u, self.cost, self._r, self._J = w, u, cost, r, J
                self.iterations += 1
                self._tally.iterations += 1
                return True
        return False


def inside(J: Array, r: Array, ridge: Array, lower: Array, upper: Array) -> Array:
    """The s (n,) between lower <= 0 and upper >= 0 with the least |r + J s|^2 + |ridge s|^2: active sets, from the
    unbounded solution on (bounded-variable least squares).

    Args:
        J, r, ridge: (rows, n), (rows,), (n,).
    """
    n = J.shape[1]
    R = triangle(np.column_stack([J, r]))[:n]  # its last column is Q'r
    A = np.concatenate([R[:, :n], np.diag(ridge)])
    b = np.concatenate([-R[:, n], np.zeros(n)])
    s, held = np.zeros(n), np.zeros(n, dtype=bool)
    for _ in range(4 * n + 4):
        free = ~held
        wanted = s.copy()
        if free.any():
            wanted[free] = np.linalg.lstsq(A[:, free], b - A[:, held] @ s[held], rcond=None)[0]
        out = free & ((wanted < lower) | (wanted > upper))
        if out.any():
            # Go along until the first side is met, and stay there.
            change = wanted - s
            room = np.where(change > 0.0, upper - s, lower - s)[out] / change[out]
            s[free] += room.min() * change[free]
            first = np.flatnonzero(out)[room <= room.min() * (1.0 + 1e-12)]
            s[first] = np.where(change[first] > 0.0, upper[first], lower[first])
            held[first] = True
            continue
        s = wanted
        slope = A.T @ (A @ s - b)
        pushes = held & np.where(s >= upper, slope > 0.0, slope < 0.0)
        if not pushes.any():
            break
        size = np.where(pushes, np.abs(slope) / np.maximum(np.linalg.norm(A, axis=0), 1e-300), 0.0)
        held[np.argmax(size)] = False
    return np.clip(s, lower, upper)
