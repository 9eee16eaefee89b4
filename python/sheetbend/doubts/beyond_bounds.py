"""Doubts about parameters beside one that stopped at a bound while the data ask for a value beyond it.

The intervals of the other parameters take the bound as the true value, so they do not say where these parameters would
go without it.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..result.estimate import Estimate
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import at_far_limit, reach_of
from ..statistics.least_squares import solved

ASKED = 6.63
"""Fall of chi-square without the bound from which on the data ask for a value beyond it: the 1 % level."""
FAR = 0.5
"""Half-widths that another parameter would move by: an interval that is off by so much contains the truth in 84 instead
of 95 of 100 cases."""


def beyond_bounds(problem: FitProblem, u: Array, judged: Identifiability) -> dict[str, str]:
    """By parameter, which other one stopped at a bound, and how far this parameter would move without that bound.

    Both follow from a Gauss-Newton step with the last Jacobian, without a simulation.

    Args:
        problem: of the fit.
        u: (free,) internal, the point at which the fit ended.
        judged: verdicts and intervals there.
    """
    names = problem.parameters.free
    bounded = [e for e in judged.estimates if e.verdict == "at a bound" and _stopped(problem, e)]
    others = [e for e in judged.estimates if e.half_width is not None and e not in bounded]
    if not bounded or not others:
        return {}
    _, r, J = problem.evaluate(u)
    columns = [names.index(e.name) for e in others]
    held, cost = _step(J[:, columns], r)
    noise = judged.autocorrelation_time * float(r @ r) / max(len(r) - len(names), 1)
    far: dict[str, tuple[float, str]] = {}
    for stopped in bounded:
        column = names.index(stopped.name)
        freed, lower = _step(J[:, [*columns, column]], r)
        if not _beyond(problem, u, column, freed[-1]) or 2.0 * (cost - lower) < ASKED * noise:
            continue
        for e, by in zip(others, np.abs(freed[:-1] - held), strict=True):
            reach = reach_of(problem.parameters[e.name], e)
            if by > max(FAR, far.get(e.name, (0.0, ""))[0]) * reach and reach > 0.0:
                far[e.name] = (float(by) / reach, f"{stopped.name} = {short(stopped.value)} {stopped.unit}".rstrip())
    return {
        name: f"{bound} is its bound, and the data ask for a value beyond it: without that bound this would move by "
        f"some {short(by, 2)} half-widths"
        for name, (by, bound) in far.items()
    }


def _stopped(problem: FitProblem, e: Estimate) -> bool:
    """Whether a bound stopped the parameter, and not the end of the range of the search or a limit of sums."""
    parameter = problem.parameters[e.name]
    near = 1e-6 * max(abs(e.value), parameter.scale or 0.0)
    at_bound = min(e.value - parameter.lower, parameter.upper - e.value) <= near
    return at_bound and not at_far_limit(parameter, e.value)


def _step(J: Array, r: Array) -> tuple[Array, float]:
    """The Gauss-Newton step (columns,) of a Jacobian (rows, columns), and the cost that it leaves."""
    step = -solved(J, r)
    left = r + J @ step
    return step, 0.5 * float(left @ left)


def _beyond(problem: FitProblem, u: Array, column: int, step: float) -> bool:
    """Whether a step of a parameter at a bound goes beyond that bound."""
    lower, upper = (bound[column] for bound in problem.parameters.bounds())
    return math.isfinite(step) and (step < 0.0 if u[column] - lower < upper - u[column] else step > 0.0)
