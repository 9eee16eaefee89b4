"""A way to a task whose loss is a sum of squares: the method of Gauss and Newton with a damping (Levenberg, Marquardt).

Residuals know which part of the rope is where, and what moves each. Their Jacobian takes a rollout for every eight
unknowns, and leads over kinks at which a descent along the gradient ends.
"""

from __future__ import annotations

import numpy as np
from motion import Array
from search import FAILURES, Search
from task import Task

DAMPING = 0.1  # at first, in unknowns, of which one of size 1 is a likely motion
STUCK = 1e4  # damping at which it stops
TRUSTED, LEFT, ENOUGH = 0.7, 0.25, 1e-3  # decreases over those that the residuals' tangents foresee
SMALL, SMALL_STEPS = 0.02, 2  # a relative decrease of the cost, and how many of these in a row end it


def gauss_newton(task: Task, seconds: float, start: Array | None = None, most: int = 1000) -> Search:
    """From no motion, until it settles, or the time or `most` motions are spent, or the target is reached.

    Raises:
        EmptyGradientError: the loss does not feel the control at the start.
        DivergenceError, UnbalancedError: the start cannot be simulated.
    """
    unknowns = np.zeros(task.size) if start is None else start
    search = Search("Gauss-Newton", unknowns)
    task.require_gradient(unknowns)
    outcome, rest, jacobian = task.outcome_and_residuals(unknowns)
    search.note(unknowns, outcome)
    damping, small = DAMPING, 0
    while damping < STUCK and small < SMALL_STEPS and not outcome.reached:
        if len(search.outcomes) + search.lost > most or search.seconds[-1] > seconds:
            break
        step = np.linalg.solve(jacobian.T @ jacobian + damping * np.eye(task.size), -jacobian.T @ rest)
        foreseen = outcome.cost - float(np.sum((rest + jacobian @ step) ** 2))
        try:
            tried = task.outcome(unknowns + step)
            share = (outcome.cost - tried.cost) / foreseen
            if share >= ENOUGH:  # nobody asks for the Jacobian elsewhere
                tried, *derived = task.outcome_and_residuals(unknowns + step)
        except FAILURES:
            search.lost += 1
            damping *= 4.0
            continue
        search.note(unknowns + step, tried)
        if share < ENOUGH:
            damping *= 3.0
            continue
        small = small + 1 if tried.cost > (1.0 - SMALL) * outcome.cost else 0
        damping *= 0.3 if share > TRUSTED else 1.0 if share > LEFT else 2.0
        unknowns, outcome, (rest, jacobian) = unknowns + step, tried, derived
    return search
