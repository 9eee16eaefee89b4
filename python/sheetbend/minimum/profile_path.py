"""Ends of a likelihood interval from a few evaluations of the residuals (after Venzon & Moolgavkar 1988, Applied
Statistics 37, 87).

The profile of a parameter is the cost with that parameter held and all others at their best. A refit at each value that
is tried costs several Jacobians; residuals alone cost a tenth of one. With residuals r + J d, J made once at the
estimate, the others follow the held parameter along a line, and the height (the square root of the rise of the cost) is
proportional to the distance t. What the residuals at a point near the profile say beyond that is its shape: how far the
height is from proportional to t, and, from the least-squares step of the others that J predicts there, how the line
bends. Interpolated between the points that were evaluated (`profile_shape`), on both sides of the estimate, they place
the next point, and at last the end.

J need not be exact for that: it only has to show how much the others' step would still take off (`Point.slack`), and
the error of that is of second order. Where its change is as large as J itself, it is made again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..arrays.timeseries import Array
from ..statistics.gauge import RANK_TOLERANCE
from .approach import inside
from .profile_shape import FAR_OFF, SAME, Point, bend, end, telling

MOST = 7  # evaluations for one end, before it is left to refits
JACOBIANS = 2  # for one end
CONFIRMED = 0.2  # of a rise: both linear ends stand where the cost rises as the linear picture has it, to this part
CLOSE = 0.15  # of the height at an end: from so near it is interpolated
SLACK = 0.05  # of the rise: what the others may leave there, which shifts an end by half of that
CURVED = 0.6  # of the way of the residuals: where they are so far from r + J d, J is made again
STRIDE = 2.5  # times the farthest distance so far
WEAK = 0.01  # of the rise: what the others' longest steps must promise to be worth taking

Evaluate = Callable[[Array, bool], tuple[bool, Array, Array]]
"""(u (p,), whether with a Jacobian) -> ok, residuals (rows,), Jacobian (rows, p), those of priors included."""


class Others:
    """The step of all parameters but one that lowers the cost most, from a Jacobian (rows, p) and inside limits."""

    def __init__(self, jacobian: Array, column: int, ridge: Array, limits: tuple[Array, Array]) -> None:
        self._rest = np.arange(jacobian.shape[1]) != column
        self._Q, self._R = np.linalg.qr(jacobian[:, self._rest])
        self._ridge, self._limits = ridge[self._rest], limits

    def step(self, u: Array, r: Array) -> tuple[Array, float]:
        """(p,) the step from u, where the residuals are r (rows,), and what it takes off half their sum of squares."""
        s, seen = np.zeros(len(u)), self._Q.T @ r
        if len(seen):
            lower, upper = (limit[self._rest] - u[self._rest] for limit in self._limits)
            s[self._rest] = inside(self._R, seen, self._ridge, np.minimum(lower, 0.0), np.maximum(upper, 0.0))
        return s, 0.5 * float(seen @ seen - np.sum((seen + self._R @ s[self._rest]) ** 2))


@dataclass
class ProfilePath:
    """The profile of one parameter around an estimate.

    Attributes:
        evaluate: see `Evaluate`.
        u, r, J: the estimate (p,), internal, and residuals (rows,) and Jacobian (rows, p) there.
        column: of the parameter.
        rise: of the cost at the ends that are looked for.
        limits: (p,) each, of the search.
        longest: (p,) longest steps; infinite where there is none.
        points: that were evaluated, in order.
    """

    evaluate: Evaluate
    u: Array
    r: Array
    J: Array
    column: int
    rise: float
    limits: tuple[Array, Array]
    longest: Array
    points: list[Point] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._cost = 0.5 * float(self.r @ self.r)
        size = np.maximum(np.linalg.norm(self.J, axis=0), np.finfo(float).tiny)
        self._ridge = np.maximum(math.sqrt(2.0 * WEAK * self.rise) / self.longest, RANK_TOLERANCE * size)
        moves = (self.u > self.limits[0]) & (self.u < self.limits[1])
        moves[self.column] = False
        self._line = np.zeros(len(self.u))
        slope = np.linalg.lstsq(self.J[:, moves] / size[moves], self.J[:, self.column], rcond=RANK_TOLERANCE)[0]
        self._line[moves] = -slope / size[moves]
        self._line[self.column] = 1.0
        self._reach = math.sqrt(2.0 * self.rise) / float(np.linalg.norm(self.J @ self._line))
        others = Others(self.J, self.column, self._ridge, self.limits)
        self._others = {-1.0: others, 1.0: others}
        self._room = {side: (self.limits[int(side > 0)] - self.u)[self.column] * side for side in (-1.0, 1.0)}

    def ends(self, first: float) -> tuple[float, float]:
        """Distances of both ends from the estimate, internal, the lower one first.

        Args:
            first: expected distance: that of the linear interval. Both ends lie exactly there where the cost confirms
                it.

        Returns:
            Infinite on a side where the cost does not rise so far up to the limit, NaN where the path does not settle.
        """
        lower = self._evaluated(-first, -1.0, straight=True)
        if self._confirms(lower, first) and self._confirms(self._evaluated(first, 1.0, straight=True), first):
            return -first, first
        return self._end(-1.0), self._end(1.0)

    def lowest(self) -> tuple[float, Array]:
        """The least rise of the cost over that at the estimate among the points, and the point (p,)."""
        costs = [(0.5 * float(at.r @ at.r) - self._cost, at.u) for at in self.points]
        return min(costs, key=lambda pair: pair[0], default=(0.0, self.u))

    def _confirms(self, at: Point | None, first: float) -> bool:
        """Whether the cost at a point on the line is what the linear picture says of that distance."""
        if at is None or (at.u != self.u + at.t * self._line).any() or abs(at.t) != first:
            return False
        expected = (first / self._reach) ** 2
        rose = (0.5 * float(at.r @ at.r) - self._cost) / self.rise
        return abs(rose - expected) <= CONFIRMED * expected and at.slack <= CONFIRMED * expected

    def _end(self, side: float) -> float:
        made, before = 0, None
        for _ in range(MOST):
            last = self._nearest(side)
            if last is not None:
                if last.slack <= SLACK and last.height < 1.0 and abs(last.t) >= self._room[side]:
                    return side * math.inf
                if self._arrived(last, side) and (made or not self._curved(last)):
                    return self._found(side)
                if self._arrived(last, side) or (before is not None and _stalls(before, last)):
                    if made == JACOBIANS or (last := self._made_again(last, side)) is None:
                        return math.nan
                    made += 1
                    if self._arrived(last, side):
                        return self._found(side)
                    before = None
                else:
                    before = last
            aim = self._aim(side) if last is None or last.slack <= FAR_OFF else last.t
            if self._evaluated(aim, side) is None:
                return math.nan
        return math.nan

    def _arrived(self, at: Point, side: float) -> bool:
        """Whether the end is known from that point, about as many parts of the way off as the height is."""
        near = at.slack <= SLACK and abs(at.height - 1.0) <= CLOSE
        return near and abs(end(self.points, side, self._reach) - abs(at.t)) <= 2.0 * CLOSE * abs(at.t)

    def _found(self, side: float) -> float:
        away = end(self.points, side, self._reach)
        return side * (away if away <= self._room[side] else math.inf)

    def _curved(self, at: Point) -> bool:
        """Whether the residuals say that the Jacobian there is another one."""
        off = float(np.linalg.norm(at.r - self.r - self.J @ (at.u - self.u)))
        return off > CURVED * math.sqrt(2.0 * self.rise) * at.height

    def _made_again(self, at: Point, side: float) -> Point | None:
        """That point by the Jacobian there, which all others of its side then take; None where there is none."""
        ok, _, J = self.evaluate(at.u, True)
        if not ok or not np.isfinite(J).all():
            return None
        self._others[side] = Others(J, self.column, self._ridge, self.limits)
        return self._keep(self._point(at.t, at.u, at.r, side))

    def _evaluated(self, t: float, side: float, straight: bool = False) -> Point | None:
        """The point there, or at the limit before it; None where there is no room or the physics has no answer.

        Args:
            straight: on the line of the linear picture.
        """
        t = side * min(abs(t), self._room[side])
        if t == 0.0:
            return None
        off = 0.0 if straight else t**2 * bend(self.points, side, t)
        u = np.clip(self.u + t * self._line + off, *self.limits)
        ok, r, _ = self.evaluate(u, False)
        if not ok or not np.isfinite(r).all():
            return None
        return self._keep(self._point(t, u, r, side))

    def _point(self, t: float, u: Array, r: Array, side: float) -> Point:
        s, promised = self._others[side].step(u, r)
        rose = 0.5 * float(r @ r) - self._cost - promised
        off = u + s - self.u - t * self._line
        return Point(t, u, r, math.sqrt(max(rose, 0.0) / self.rise), promised / self.rise, off / t**2)

    def _keep(self, at: Point) -> Point:
        self.points = [other for other in self.points if abs(other.t - at.t) > SAME * abs(at.t)]
        self.points.append(at)
        return at

    def _nearest(self, side: float) -> Point | None:
        return next(iter(telling(self.points, side)), None)

    def _aim(self, side: float) -> float:
        """The end as far as it is known, no farther than the limit and a stride beyond the points."""
        reached = max((abs(at.t) for at in telling(self.points, side)), default=self._reach)
        return side * min(end(self.points, side, self._reach), STRIDE * reached, self._room[side])


def _stalls(before: Point, last: Point) -> bool:
    """Whether a step of the others was in vain."""
    return abs(last.t - before.t) <= SAME * abs(last.t) and last.slack > max(SLACK, 0.5 * before.slack)
