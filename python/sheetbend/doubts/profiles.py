"""Profiles of the cost around a minimum, by a path along each and by refits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..minimum.optimizers import refit
from ..minimum.profile_path import Linear, ProfilePath
from ..problem.coordinates import step_limits
from ..problem.counts import count, counted
from ..problem.problem import FitProblem
from ..problem.workers import Common, current
from ..statistics.least_squares import solved
from ..statistics.profile import NOISELESS, Ends, Profile, Wanted, profile_interval

PROFILE_TOLERANCE = 0.02
"""Of the cost of one row: what an interval's end rises by is a hundred times that. A relative tolerance of all rows
together would waste steps on few rows, and stop too early on many."""


@dataclass(frozen=True)
class Elsewhere:
    """The end of another search, in the same cost.

    Attributes:
        rise: of the cost there over that at the estimate.
        values: of all parameters.
        how: which search it was, in words.
    """

    rise: float
    values: Mapping[str, float]
    how: str


class Profiles:
    """(name, value) -> cost with that parameter held and the others refitted, of the experiments that it reaches;
    infinite where these have no answer.

    Attributes:
        lower: where refits and paths ended lower than the minimum.
    """

    def __init__(self, problem: FitProblem, u: Array, refitter: str, moved: Array) -> None:
        """Around the minimum u (free,) of a problem.

        Args:
            refitter: optimizer of refits.
            moved: (free,) internal, from the minimum to the estimate, where that was moved to the limit of short
                substeps. Combined runs would take three times as long, so that the profile is that of single runs, and
                moves along.
        """
        self.lower: list[Elsewhere] = []
        self._problem, self._u, self._refitter, self._moved = problem, u, refitter, moved
        self._values = problem.parameters.to_physical(u)
        self._parts: dict[str, FitProblem] = {}  # by name
        self._here: dict[FitProblem, tuple[float, float]] = {}  # by part: cost at the minimum, and residual variance
        self._ends: dict[str, dict[float, Array]] = {}  # by name and value held: where the others ended, all internal
        self._linear: dict[FitProblem, Linear | None] = {}  # by part

    def __reduce__(self) -> tuple[Any, ...]:
        return Profiles, (self._problem, self._u, self._refitter, self._moved)

    def __call__(self, name: str, value: float) -> float:
        parameter, by = self._problem.parameters[name], self._moved[self._problem.parameters.free.index(name)]
        if by != 0.0:
            value = parameter.to_physical(parameter.to_internal(value) - by)
        value = float(np.clip(value, parameter.lower, parameter.upper))
        part = self._part(name)
        if part.parameters.free == (name,):
            return part.cost(part.parameters.to_internal({name: value}))
        held = part.holding(name, value)
        mean, sd = parameter.prior or (value, 1.0)
        pull = (parameter.to_internal(value) - parameter.to_internal(mean)) / sd
        at = parameter.to_internal(value)
        start = {parameter.to_internal(self._values[name]): held.parameters.to_internal(self._values)}
        known = self._ends.setdefault(name, start)
        start_at, cost = self._nearest(held, part, name, at)
        if not np.isfinite(cost):
            return np.inf
        try:
            end = refit(held, start_at, self._refitter, 50, min(PROFILE_TOLERANCE / part.core.data_rows, 1e-5))
        except SheetbendError:
            return np.inf
        known[at] = end.u
        cost = end.cost + 0.5 * pull**2
        self._is_lower(name, part, {**held.parameters.to_physical(end.u), name: value}, cost)
        return cost

    def each(self, wanted: Sequence[Wanted]) -> list[Profile]:
        """The profiles of several parameters; workers share them."""
        if self._problem.estimates_corrections or current() is None:  # corrections go on from the last evaluation
            return [self.profile(one) for one in wanted]
        profiles = []
        for profile, lower, (evaluations, jacobians) in Common(self).map(_profiled, wanted):
            profiles.append(profile)
            self.lower += lower
            count(evaluations, jacobians)
        return profiles

    def profile(self, wanted: Wanted) -> Profile:
        """The profile of a parameter: both ends from the path along it, and from refits on the sides where the path
        does not settle."""
        name, part = wanted.name, self._part(wanted.name)
        linear, parameters = self._picture(part), part.parameters
        if linear is None:
            return Profile((math.nan, math.nan))
        parameter, column = parameters[name], parameters.free.index(name)
        by = self._moved[self._problem.parameters.free.index(name)]
        limits, longest = parameters.limits(), step_limits(parameters)
        kinked = any(e.scene.compiled.bends_over_values for e in part.experiments)
        path = ProfilePath(part.evaluate, linear, column, wanted.reach, limits, longest, kinked)
        first = min(wanted.reach, 1.0) if parameter.log else wanted.reach
        told = path.ends(first)
        rose, there = path.lowest()
        cost = 0.5 * float(linear.r @ linear.r)
        if self._is_lower(name, part, parameters.to_physical(there), cost + rose):
            told = (math.nan, math.nan)
        at = float(linear.u[column]) + by
        sides = tuple(side for side, end in zip((-1.0, 1.0), told, strict=True) if math.isnan(end))
        refitted: Ends = (None, None)
        asked: dict[float, float] = {}
        if sides:
            refitted = profile_interval(
                partial(self._remembered, name, asked),
                parameter.to_physical(at),
                path.rise,
                step=first,
                lower=parameter.lower,
                upper=parameter.upper,
                log=parameter.log,
                sides=sides,
            )
        ends: list[float | None] = []
        curve = [(0.0, 0.0)]
        for side, end, other in zip((-1.0, 1.0), told, refitted, strict=True):
            if math.isnan(end):
                last = math.inf if other is None or math.isnan(other) else abs(parameter.to_internal(other) - at)
                points = [(parameter.to_internal(value) - at, height - cost) for value, height in asked.items()]
                curve += [(t, rise / path.rise) for t, rise in points if 0.0 < t * side < last and math.isfinite(rise)]
                curve += [(side * last, 1.0)] if math.isfinite(last) else []
                found = other
            else:
                curve += path.curve(side, end)
                found = None if math.isinf(end) else parameter.to_physical(at + end)
            ends.append(None if found is None else min(max(found, parameter.lower), parameter.upper))
        away, rises = zip(*sorted(curve), strict=True)
        return Profile((ends[0], ends[1]), tuple(map(float, away)), tuple(map(float, rises)), wanted.reach)

    def _remembered(self, name: str, asked: dict[float, float], value: float) -> float:
        asked[value] = self(name, value)
        return asked[value]

    def _picture(self, part: FitProblem) -> Linear | None:
        """The linear picture of a part at the minimum; None where its physics has no answer."""
        if part not in self._linear:
            u = part.parameters.to_internal(self._values) if part is not self._problem else self._u
            ok, r, J = part.evaluate_exactly(u)
            self._linear[part] = Linear(u, r, J) if ok else None
        return self._linear[part]

    def _part(self, name: str) -> FitProblem:
        if name not in self._parts:
            part = self._problem.around(name)
            self._parts |= dict.fromkeys(part.parameters.free, part)  # which is tied to the others as they are to it
        return self._parts[name]

    def _nearest(self, held: FitProblem, part: FitProblem, name: str, at: float) -> tuple[Array, float]:
        """A start for the refit with a parameter held at an internal value, and the cost there: where the others ended
        at the nearest known value, or on the line through two of these (of the linear picture, where there is one
        alone)."""
        known = self._ends[name]
        near, *others = sorted(known, key=lambda other: abs(other - at))
        if others:
            slope = (known[others[0]] - known[near]) / (others[0] - near)
        else:
            _, _, J = part.evaluate(part.parameters.to_internal(self._values))
            column = part.parameters.free.index(name)
            slope = -solved(np.delete(J, column, axis=1), J[:, column])
        ahead = np.clip(known[near] + (at - near) * slope, *held.parameters.limits())
        return min(((u, held.cost(u)) for u in (ahead, known[near])), key=lambda pair: pair[1])

    def _is_lower(self, name: str, part: FitProblem, there: Mapping[str, float], cost: float) -> bool:
        """Whether a point is lower than the minimum by more than the residual variance; if so, keep it."""
        if part not in self._here:
            _, r, _ = part.evaluate(part.parameters.to_internal(self._values))  # which is known there
            here = 0.5 * float(r @ r)
            self._here[part] = (here, here / max(part.core.data_rows - len(part.parameters.free), 1))
        here, variance = self._here[part]
        lower = cost < here - variance and variance > NOISELESS
        if lower:
            self.lower.append(Elsewhere(cost - here, {**self._values, **there}, f"a fit with {name} held"))
        return lower


def _profiled(profiles: Profiles, wanted: Wanted) -> tuple[Profile, list[Elsewhere], tuple[int, int]]:
    """Compute a profile in a worker; return it with the lower minima on its way and the simulations that it took."""
    known, before = len(profiles.lower), counted()
    profile = profiles.profile(wanted)
    after = counted()
    return profile, profiles.lower[known:], (after[0] - before[0], after[1] - before[1])
