"""Ends of a likelihood interval from a few evaluations of the residuals (after Venzon & Moolgavkar 1988, Applied
Statistics 37, 87).

The profile of a parameter is the cost with that parameter held and all others at their best. A refit at each value that
is tried costs several Jacobians; residuals alone cost a tenth of one. With residuals r + J d, J made once at the
estimate, the others follow the held parameter along a line, and the height (the square root of the rise of the cost) is
proportional to the distance t. What the residuals at a point near the profile say beyond that is its shape: how far the
height is from proportional to t, and, from the least-squares step of the others that J predicts there, how the line
bends. Interpolated between the points that were evaluated (`profile_shape`), on both sides of the estimate, they place
the next point, and at last the end.

How high an end lies is told by its distance in the linear picture, that of the linear interval. So a profile says by
how much the cost is not a parabola, and leaves everything else that an interval counts (correlated residuals, noise of
what drives a scene, priors that count as they are) as the linear interval has it.

J need not be exact for that: it only has to show how much the others' step would still take off (`Point.slack`), and
the error of that is of second order. Where its change is as large as J itself, it is made again.

Where a motion has kinks (a hinge that sticks and slides), residuals beyond one may fall lower with other derivatives,
of which J shows nothing. There both ends are looked at with the Jacobian there; one that moves is left to refits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..arrays.types import Array
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.least_squares import solved
from .approach import inside
from .profile_shape import FAR_OFF, SAME, Point, bend, distance, telling

MOST = 7  # evaluations for one end, before it is left to refits
JACOBIANS = 2  # for one end
CONFIRMED = 0.03  # of the rise: both linear ends stand where the cost rises as the linear picture has it, to this part
CLOSE = 0.15  # of the height at an end: from so near it is interpolated
SLACK = 0.05  # of the rise: what the others may leave there, which shifts an end by half of that
CURVED = 0.6  # of the way of the residuals: where they are so far from r + J d, J is made again
STRIDE = 2.5  # times the farthest distance so far
CURVE = 4  # points of a curve on each side
KINKED = 0.003  # of the height: by so much an end may move with its own Jacobian where motions have kinks
WEAK = 0.01  # of the rise: what the others' longest steps must promise to be worth taking

Evaluate = Callable[[Array, bool], tuple[bool, Array, Array]]
"""(u (p,), whether with a Jacobian) -> ok, residuals (rows,), Jacobian (rows, p), those of priors included."""


class Linear:
    """The linear picture at an estimate, which all profiles around it share.

    Attributes:
        u, r, J: (p,) internal, residuals (rows,) and Jacobian (rows, p) there.
        Q, R: of J.
    """

    def __init__(self, u: Array, r: Array, J: Array) -> None:
        self.u, self.r, self.J = u, r, J
        self.Q, self.R = np.linalg.qr(J)


class Others:
    """The step of all parameters but one that lowers the cost most, from Q and R of a Jacobian and inside limits."""

    def __init__(self, Q: Array, R: Array, column: int, ridge: Array, limits: tuple[Array, Array]) -> None:
        self._rest = np.arange(R.shape[1]) != column
        self._Q = Q
        self._S, self._R = np.linalg.qr(R[:, self._rest])
        self._ridge, self._limits = ridge[self._rest], limits

    def step(self, u: Array, r: Array) -> tuple[Array, float]:
        """(p,) the step from u, where the residuals are r (rows,), and what it takes off half their sum of squares."""
        s, seen = np.zeros(len(u)), self._S.T @ (self._Q.T @ r)
        if len(seen):
            lower, upper = (limit[self._rest] - u[self._rest] for limit in self._limits)
            s[self._rest] = inside(self._R, seen, self._ridge, np.minimum(lower, 0.0), np.maximum(upper, 0.0))
        return s, 0.5 * float(seen @ seen - np.sum((seen + self._R @ s[self._rest]) ** 2))


@dataclass
class ProfilePath:
    """The profile of one parameter around an estimate.

    Attributes:
        evaluate: see `Evaluate`.
        linear: the picture at the estimate.
        column: of the parameter.
        reach: distance of the ends that are looked for in the linear picture.
        limits: (p,) each, of the search.
        longest: (p,) longest steps; infinite where there is none.
        kinked: whether motions have kinks.
        points: that were evaluated, in order.
        rise: of the cost at the ends.
    """

    evaluate: Evaluate
    linear: Linear
    column: int
    reach: float
    limits: tuple[Array, Array]
    longest: Array
    kinked: bool = False
    points: list[Point] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.u, self.r, R = self.linear.u, self.linear.r, self.linear.R
        self._cost = 0.5 * float(self.r @ self.r)
        size = np.maximum(np.linalg.norm(R, axis=0), np.finfo(float).tiny)
        moves = (self.u > self.limits[0]) & (self.u < self.limits[1])
        moves[self.column] = False
        self._line = np.zeros(len(self.u))
        self._line[moves] = -solved(R[:, moves], R[:, self.column])
        self._line[self.column] = 1.0
        self.rise = 0.5 * (self.reach * float(np.linalg.norm(R @ self._line))) ** 2
        self._ridge = np.maximum(math.sqrt(2.0 * WEAK * self.rise) / self.longest, RANK_TOLERANCE * size)
        others = Others(self.linear.Q, R, self.column, self._ridge, self.limits)
        self._others = {-1.0: others, 1.0: others}
        self._room = {side: (self.limits[int(side > 0)] - self.u)[self.column] * side for side in (-1.0, 1.0)}

    def ends(self, first: float) -> tuple[float, float]:
        """Distances of both ends from the estimate, internal, the lower one first.

        Args:
            first: where to look first, at most `reach`. Both ends lie exactly at `reach` where the cost confirms it.

        Returns:
            Infinite on a side where the cost does not rise so far up to the limit, NaN where the path does not settle.
        """
        one = self._evaluated(-first, -1.0, straight=True)
        if self._confirms(one) and self._confirms(self._evaluated(first, 1.0, straight=True)):
            lower, upper = -self.reach, self.reach
        else:
            lower, upper = self._end(-1.0), self._end(1.0)
        return self._without_kink(lower, -1.0), self._without_kink(upper, 1.0)

    def curve(self, side: float, end: float) -> list[tuple[float, float]]:
        """(distance from the estimate, rise of the profile over that at the ends) along one side (-1 or 1): up to a
        finite end as interpolated, beyond which nothing is known; else at the points that were evaluated."""
        if math.isinf(end):
            return sorted((at.t, at.height**2) for at in self.points if at.t * side > 0.0 and at.slack <= SLACK)
        heights = np.arange(1, CURVE) / CURVE
        away = [min(distance(self.points, side, self.reach, z), abs(end)) for z in heights]
        return sorted([(side * t, float(z**2)) for t, z in zip(away, heights, strict=True)] + [(end, 1.0)])

    def lowest(self) -> tuple[float, Array]:
        """The least rise of the cost over that at the estimate among the points, and the point (p,)."""
        costs = [(0.5 * float(at.r @ at.r) - self._cost, at.u) for at in self.points]
        return min(costs, key=lambda pair: pair[0], default=(0.0, self.u))

    def _confirms(self, at: Point | None) -> bool:
        """Whether a point on the line is a linear end, and the profile as high there as the linear picture says."""
        if at is None or (at.u != self.u + at.t * self._line).any() or abs(at.t) != self.reach:
            return False
        return abs(at.height**2 - 1.0) <= CONFIRMED and at.slack <= SLACK

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
        return near and abs(distance(self.points, side, self.reach) - abs(at.t)) <= 2.0 * CLOSE * abs(at.t)

    def _found(self, side: float) -> float:
        away = distance(self.points, side, self.reach)
        return side * (away if away <= self._room[side] else math.inf)

    def _curved(self, at: Point) -> bool:
        """Whether the residuals say that the Jacobian there is another one."""
        off = float(np.linalg.norm(at.r - self.r - self.linear.J @ (at.u - self.u)))
        return off > CURVED * math.sqrt(2.0 * self.rise) * at.height

    def _made_again(self, at: Point, side: float) -> Point | None:
        """The same point computed with the Jacobian there, which all further points of its side then take; None where
        there is none."""
        ok, _, J = self.evaluate(at.u, True)
        if not ok or not np.isfinite(J).all():
            return None
        self._others[side] = Others(*np.linalg.qr(J), self.column, self._ridge, self.limits)
        return self._keep(self._point(at.t, at.u, at.r, side))

    def _without_kink(self, end: float, side: float) -> float:
        """The end, or NaN where motions have kinks and the Jacobian at the nearest point shows another height."""
        at = self._nearest(side)
        if not self.kinked or at is None or not math.isfinite(end):
            return end
        again = self._made_again(at, side)
        return end if again is not None and abs(again.height - at.height) <= KINKED else math.nan

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
        reached = max((abs(at.t) for at in telling(self.points, side)), default=self.reach)
        return side * min(distance(self.points, side, self.reach), STRIDE * reached, self._room[side])


def _stalls(before: Point, last: Point) -> bool:
    """Whether a step of the others was in vain."""
    return abs(last.t - before.t) <= SAME * abs(last.t) and last.slack > max(SLACK, 0.5 * before.slack)
