"""Whether the cost still has a slope where an optimizer ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.gauge import RANK_TOLERANCE
from .approach import inside
from .progress import Minimum

LOST = 0.1  # of the cost: a slope that promises so much is no end
STUCK = 1e-5  # of the cost: a third of a standard error where residuals are ten thousand
ROUNDING = 1e-12  # of the first cost: residuals of data without noise end as rounding errors, which have any slope


def judged(problem: FitProblem, end: Minimum, first: float) -> Minimum:
    """An optimizer's end after a first cost: in doubt where the cost has still a slope, and no convergence where that
    promises a good part of the cost. Optimizers also stop where steps are small and take little off, as they are
    wherever no step lowers the cost: at a kink, or where gradients are off."""
    if not end.converged:
        return end
    left = promised(problem, end.u)
    if left <= STUCK or left * end.cost <= ROUNDING * first:
        return end
    words = f"no step lowers the cost, but its gradient promises {short(100 * left, 2)} % less (a kink, a rough motion)"
    return replace(end, converged=left < LOST, message=f"{words}: {end.message}", doubt=words)


def promised(problem: FitProblem, u: np.ndarray) -> float:
    """Share of the cost that a Gauss-Newton step from u inside the bounds would take off, were the residuals linear in
    the problem's coordinates."""
    ok, r, J = problem.evaluate(u)
    lower, upper = problem.coordinates.limits()
    u = problem.coordinates.into(u)
    J = problem.coordinates.jacobian(J, u)
    slope, size = J.T @ r, np.linalg.norm(J, axis=0)
    free = (size > RANK_TOLERANCE * np.linalg.norm(r)) & ~((u <= lower) & (slope > 0)) & ~((u >= upper) & (slope < 0))
    if not ok or not free.any() or not r.any():
        return 0.0
    if problem.coordinates.charts:  # near a limit the linear model would go on for ever
        longest = problem.coordinates.longest
        step = inside(J, r, np.zeros(len(u)), np.maximum(lower - u, -longest), np.minimum(upper - u, longest))
        return float(1.0 - np.sum((r + J @ step) ** 2) / (r @ r))
    columns = J[:, free] / size[free]
    step = np.linalg.lstsq(columns, r, rcond=RANK_TOLERANCE)[0]
    return float(np.sum((columns @ step) ** 2) / (r @ r))
