"""Profiles of the cost around a minimum, by a path along each and by refits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays.timeseries import Array
from ..errors import SheetbendError
from ..minimum.approach import step_limits
from ..minimum.optimizers import refit
from ..minimum.problem import FitProblem
from ..minimum.profile_path import ProfilePath
from ..statistics.gauge import RANK_TOLERANCE

PROFILE_TOLERANCE = 0.02
"""Of the cost of one row: what an interval's end rises by is a hundred times that. A relative tolerance of all rows
together would waste steps on few rows, and stop too early on many."""
NOISELESS = 1e-18  # of sigma squared: data without noise, whose residuals are rounding errors


@dataclass(frozen=True)
class Elsewhere:
    """Where another search of the same minimum ended.

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

    def path(self, name: str, rise: float, first: float) -> tuple[float, float]:
        """Internal distances of both ends of an interval from the estimate, see `ProfilePath.ends`.

        Args:
            rise: of the cost at the ends.
            first: half-width of the linear interval.
        """
        part = self._part(name)
        parameters = part.parameters
        u = parameters.to_internal(self._values) if part is not self._problem else self._u
        ok, r, J = part.evaluate_exactly(u)
        if not ok:
            return math.nan, math.nan
        column, limits = parameters.free.index(name), parameters.limits()
        path = ProfilePath(part.evaluate, u, r, J, column, rise, limits, step_limits(parameters))
        ends = path.ends(first)
        rose, there = path.lowest()
        lower = self._is_lower(name, part, parameters.to_physical(there), 0.5 * float(r @ r) + rose)
        return (math.nan, math.nan) if lower else ends

    def _part(self, name: str) -> FitProblem:
        if name not in self._parts:
            part = self._problem.around(name)
            whole = len(part.experiments) == len(self._problem.experiments)
            self._parts[name] = self._problem if whole else part
        return self._parts[name]

    def _nearest(self, held: FitProblem, part: FitProblem, name: str, at: float) -> tuple[Array, float]:
        """Where to begin with a parameter held at an internal value, and the cost there: where the others ended at the
        nearest value known, or on the line through two of these (of the linear picture, where there is but one)."""
        known = self._ends[name]
        near, *others = sorted(known, key=lambda other: abs(other - at))
        if others:
            slope = (known[others[0]] - known[near]) / (others[0] - near)
        else:
            _, _, J = part.evaluate(part.parameters.to_internal(self._values))
            column = part.parameters.free.index(name)
            rest = np.delete(J, column, axis=1)
            size = np.maximum(np.linalg.norm(rest, axis=0), np.finfo(float).tiny)
            slope = -np.linalg.lstsq(rest / size, J[:, column], rcond=RANK_TOLERANCE)[0] / size
        ahead = np.clip(known[near] + (at - near) * slope, *held.parameters.limits())
        return min(((u, held.cost(u)) for u in (ahead, known[near])), key=lambda pair: pair[1])

    def _is_lower(self, name: str, part: FitProblem, there: Mapping[str, float], cost: float) -> bool:
        """Whether a point is lower than the minimum by more than the residual variance; if so, keep it."""
        if part not in self._here:
            here = part.cost(part.parameters.to_internal(self._values))
            self._here[part] = (here, here / max(part.core.data_rows - len(part.parameters.free), 1))
        here, variance = self._here[part]
        lower = cost < here - variance and variance > NOISELESS
        if lower:
            self.lower.append(Elsewhere(cost - here, {**self._values, **there}, f"a fit with {name} held"))
        return lower
