"""Whether an optimizer ended in a minimum: else no verdict follows from where it ended."""

from __future__ import annotations

import numpy as np

from ..arrays.timeseries import Array
from ..minimum.optimizers import ROUNDING, Minimum, promised
from ..minimum.problem import FitProblem
from ..quantities.wording import short

FAR = 1e-3
"""Share of the cost that a step may still promise where an optimizer was stopped: a few standard errors."""
HARDLY = 0.5  # of the first cost: an optimizer that took less off may never have moved
MISSED = 9.0  # times sigma squared: residuals for which ending near the start is suspicious
NEARBY = 0.1  # of a parameter, or of its scale: where the cost must not be lower than at the end


def no_minimum(problem: FitProblem, end: Minimum) -> str:
    """Why the end of an optimizer is no minimum, in words; empty where it is one.

    An end that `optimizers.judged` refused is none. One that was stopped (by Ctrl-C, by the number of iterations) is
    none where a Gauss-Newton step promises more than `FAR` of the cost. One near its start with large residuals is
    none where a small change of a single parameter lowers the cost: two to four simulations for each, in that case
    alone.
    """
    if end.doubt and not end.converged:
        return end.doubt
    if not end.converged:
        left = promised(problem, end.u)
        stopped = "interrupted" if end.interrupted else "the optimizer stopped"
        if left > FAR and not _rounding(left * end.cost, end):
            return f"{stopped} where a step still promises {short(100 * left, 2)} % less"
        return ""
    rows = problem.core.data_rows
    if end.first is None or end.cost <= HARDLY * end.first or 2 * end.cost <= MISSED * rows:
        return ""
    return _lower_nearby(problem, end)


def _rounding(decrease: float, end: Minimum) -> bool:
    return decrease <= ROUNDING * (end.cost if end.first is None else max(end.first, end.cost))


def _lower_nearby(problem: FitProblem, end: Minimum) -> str:
    _, _, J = problem.evaluate(end.u)
    rows = problem.core.data_rows
    lower, upper = problem.parameters.bounds()
    for column, name in enumerate(problem.parameters.free):
        parameter, at = problem.parameters[name], float(end.u[column])
        size = float(np.linalg.norm(J[:, column]))
        if not 0 < size < np.inf:
            continue
        alone = 2 * np.sqrt(2 * end.cost / rows) / size  # half-width, were the others known
        natural = NEARBY if parameter.log else NEARBY * (parameter.scale or abs(at))
        for step in sorted({min(alone, natural), natural} - {0.0}):
            for there in (max(at - step, lower[column]), min(at + step, upper[column])):
                u: Array = np.array(end.u, dtype=float)
                u[column] = there
                cost = problem.cost(u)
                if cost < end.cost * (1 - FAR):
                    less = 100 * (1 - cost / end.cost)
                    value = f"{short(parameter.to_physical(there))} {parameter.unit}".rstrip()
                    return f"it hardly moved, though {name} = {value} alone takes {short(less, 2)} % off the cost"
    return ""
