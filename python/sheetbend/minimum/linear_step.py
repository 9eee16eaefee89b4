"""One Gauss-Newton step with the Jacobian of a fit: a refit to first order in what the residuals change."""

from __future__ import annotations

import numpy as np

from ..errors import InputError, SheetbendError
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..statistics.least_squares import solved
from ..statistics.profile import FARTHEST


def one_step(problem: FitProblem, finer: FitProblem, u: np.ndarray) -> np.ndarray:
    """The minimum to first order, if the residuals were those of a finer problem; parameters at a bound stay there.

    Raises:
        SheetbendError: the finer problem has no answer at u, or other rows.
    """
    _, r, J = problem.evaluate(u)
    return gauss_newton(problem.parameters, u, J, residuals_there(problem, finer, u) - r)


def residuals_there(problem: FitProblem, finer: FitProblem, u: np.ndarray) -> np.ndarray:
    """(rows,) residuals of a finer problem.

    Raises:
        SheetbendError: it has no answer at u, or other rows.
    """
    ok, there, _ = finer.follow(problem).evaluate(u, jacobian=False)
    if not ok:
        raise SheetbendError(f"the refinement cannot start: {finer.failure}")
    if len(there) != problem.core.rows:
        fix = "make them of the same recordings, with the same markers"
        raise InputError("refine.finer", "makes experiments with other residuals", (len(there), problem.core.rows), fix)
    return there


def gauss_newton(parameters: Parameters, u: np.ndarray, J: np.ndarray, change: np.ndarray) -> np.ndarray:
    """u moved by the least-squares answer to a change of the residuals, inside the bounds; what is at one stays.

    So does a logarithmic parameter that would have to move by a factor of more than a million: the residuals hardly
    know it.
    """
    lower, upper = parameters.bounds()
    log = np.array([parameters[name].log for name in parameters.free], dtype=bool)
    free = (u > lower) & (u < upper)
    while True:
        step = np.zeros(len(u))
        step[free] = -solved(J[:, free], change)
        far = log & (np.abs(step) > FARTHEST)
        if not far.any():
            return np.clip(u + step, lower, upper)
        free &= ~far


def moves(parameters: Parameters, start: np.ndarray, end: np.ndarray) -> dict[str, float]:
    """The changes of the free parameters between two internal points, in their units."""
    here, there = parameters.to_physical(start), parameters.to_physical(end)
    return {name: there[name] - here[name] for name in parameters.free}
