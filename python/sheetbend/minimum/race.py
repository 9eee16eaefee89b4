"""Many starts at little cost: all of them go through the windows with a loose tolerance, and those that end in the same
minimum of the last window are one group, of which only the best goes on to a whole fit.

Two ends are in one minimum where the quadratic model of the better one, 0.5 d' (J' J) d with d from one to the other,
explains the difference of their costs and is a small part of the cost. So far off parameters may be that the last
window does not determine; it cannot tell such ends apart. A start stops as soon as it has come so near to an end that
is known. What is known grows in rounds, each as large as all before it, so that who shares the work decides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..problem.problem import FitProblem
from ..problem.triangle import triangle
from ..problem.workers import Common
from .approach import Approach, Tally
from .windows import STEPS, TOLERANCE, along, cut

LAST = 1e-3  # of the cost: tolerance in the last window
ALIKE = 0.1  # of the cost: ends whose quadratic model differs by less are in one minimum
EXPLAINED = 0.05  # of the cost, that the model may miss of the difference
FLOOR = 0.1  # sigmas: residuals that differ by less are the same


@dataclass(frozen=True)
class Raced:
    """One start of a race.

    Attributes:
        first, u: (free,) where it began and where it stopped.
        cost: of the last window there; infinite where the motion has no answer on the way.
        evaluations, jacobians: that it took.
        message: why it led nowhere.
        group: number of its minimum, from 1, the one with the lowest cost first; 0 where it led nowhere.
    """

    first: Array
    u: Array
    cost: float
    evaluations: int
    jacobians: int
    message: str = ""
    group: int = 0


@dataclass(frozen=True)
class Reference:
    """An end that others are compared with: u (free,), its cost, the triangle (free, free) of its Jacobian, and the
    cost below which nothing counts."""

    u: Array
    cost: float
    triangle: Array
    floor: float

    def holds(self, u: Array, cost: float) -> bool:
        """Whether a point is in the same minimum."""
        size = max(self.cost, self.floor)
        with np.errstate(over="ignore", invalid="ignore"):
            rise = 0.5 * float(np.sum((self.triangle @ (u - self.u)) ** 2))
        return rise < ALIKE * size and abs(cost - self.cost - rise) < EXPLAINED * size


class Course:
    """What all starts go through.

    Attributes:
        problem: whole, with markers that scenes follow taken for the truth.
        lengths: s, of the windows; infinite for the whole motion.
    """

    def __init__(self, problem: FitProblem, lengths: Sequence[float]) -> None:
        self.problem, self.lengths = problem, tuple(lengths) or (math.inf,)
        self._parts: dict[float, FitProblem] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Course, (self.problem, self.lengths)

    def part(self, whole: FitProblem, length: float) -> FitProblem:
        """The problem of a window, made once."""
        if length not in self._parts:
            self._parts[length] = cut(whole, length)
        return self._parts[length]

    @property
    def last(self) -> FitProblem:
        """The problem in which all end."""
        return self.problem if math.isinf(self.lengths[-1]) else self.part(self.problem, self.lengths[-1])

    def reference(self, end: Raced) -> Reference:
        """The end of a start, in the form in which ends are compared."""
        _, r, J = self.last.evaluate(end.u)
        floor = 0.5 * FLOOR**2 * len(r)
        return Reference(end.u, end.cost, triangle(J), floor)


Observe = Callable[[Raced, int], None]


def race(course: Course, points: Sequence[Array], observe: Observe | None = None) -> tuple[Raced, ...]:
    """All starts to the end of the last window, in their order, with their groups. Ctrl-C passes through.

    Args:
        observe: called with each that has ended and how many have.
    """
    common, ended = Common(course), list[Raced]()
    references: dict[bytes, Reference] = {}  # by the bits of their points, each made once
    known: list[Reference] = []
    while len(ended) < len(points):
        batch = points[len(ended) : max(1, 2 * len(ended))]
        for end in common.map(_run, [(u, tuple(known)) for u in batch]):
            ended.append(end)
            if observe is not None:
                observe(end, len(ended))
        ended, known = _grouped(course, ended, references)
    return tuple(ended)


def groups_of(ended: Sequence[Raced]) -> list[list[Raced]]:
    """The raced starts that reached a minimum, grouped by its number: group k is at place k - 1."""
    return [[end for end in ended if end.group == number] for number in range(1, 1 + max(end.group for end in ended))]


def _grouped(
    course: Course, ended: Sequence[Raced], made: dict[bytes, Reference]
) -> tuple[list[Raced], list[Reference]]:
    """The raced starts with their groups, and the best end of each group."""
    groups: list[Reference] = []
    found = list(ended)
    for i in sorted((i for i, end in enumerate(ended) if math.isfinite(end.cost)), key=lambda i: ended[i].cost):
        end = ended[i]
        number = next((k for k, best in enumerate(groups) if best.holds(end.u, end.cost)), len(groups))
        if number == len(groups):
            key = end.u.tobytes()
            if key not in made:
                made[key] = course.reference(end)
            groups.append(made[key])
        found[i] = replace(end, group=number + 1)
    return found, groups


def _run(course: Course, item: tuple[Array, tuple[Reference, ...]]) -> Raced:
    """One start through all windows."""
    first, known = item
    u, tally = first, Tally()
    try:
        for length, walk in along(course.problem, course.lengths, u, tally, course.part):
            last = length == course.lengths[-1]
            if not math.isfinite(walk.cost) or (math.isinf(length) and not last):
                break
            near = partial(_in_known, walk, known if last else ())
            for _ in walk.steps(STEPS, LAST if last else TOLERANCE, near):
                pass
            u = walk.u
            if last:
                return Raced(first, u, walk.cost, tally.evaluations, tally.jacobians)
        words = course.problem.failure
    except SheetbendError as error:
        words = str(error)
    return Raced(first, u, math.inf, tally.evaluations, tally.jacobians, f"the fit cannot start: {words}")


def _in_known(walk: Approach, known: Sequence[Reference]) -> bool:
    """Whether the walk is in the minimum of a known end."""
    return any(end.holds(walk.u, walk.cost) for end in known)
