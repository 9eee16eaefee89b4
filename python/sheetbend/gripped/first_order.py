"""What a rung of small offsets would improve, to first order: a derivative instead of a descent.

A rope's tilts and shifts in its grips and the places of its markers are small, and motions are nearly linear in them.
One Gauss-Newton step then tells what they take off the errors of the recordings that are fitted, and of those that
judge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.types import Array
from ..minimum.approach import RIDGE, inside
from ..problem.coordinates import step_limits
from ..problem.problem import FitProblem
from .judging import Errors, Split, Verdict, verdict
from .model import RopeModel
from .pieces import numbered, problem_of
from .slid import window_of

PART = 1e-3  # of the step, along which the recordings that judge change


def first_order(
    fitted: FitProblem, larger: RopeModel, values: Mapping[str, float], split: Split, threads: int = 1
) -> Verdict | None:
    """The verdict on one step of a model that starts where a smaller one is; None where there is nothing to judge by,
    or no answer.

    Args:
        fitted: of windows of what is fitted, with the larger model.
        values: of the smaller one.
    """
    if not split.judged:
        return None
    windows = [window_of(larger, m, None, values) for m in split.judged]
    judged = problem_of(numbered(windows), list(fitted.given.values()), values, threads)
    u = fitted.parameters.initial()
    (ok, r, J), (answers, r2, _) = fitted.evaluate(u), judged.evaluate(u, jacobian=False)
    if not (ok and answers and np.isfinite(J).all()):
        return None
    longest, (lower, upper) = step_limits(fitted.parameters), fitted.parameters.limits()
    ridge = math.sqrt(RIDGE * float(r @ r)) / longest
    step = inside(J, r, ridge, np.maximum(lower - u, -longest), np.minimum(upper - u, longest))
    answers, along, _ = judged.evaluate(u + PART * step, jacobian=False)  # forty derivatives for the price of one
    if not answers:
        return None
    smaller, stepped = (
        Errors(
            _errors(fitted, a, [0] * len(fitted.experiments), 1)[:, 0], _errors(judged, b, split.since, split.pieces)
        )
        for a, b in ((r, r2), (r + J @ step, r2 + (along - r2) / PART))
    )
    return verdict(stepped, smaller)


def _errors(problem: FitProblem, r: Array, since: Sequence[int], pieces: int) -> Array:
    """(experiments, pieces) mean absolute residuals, from a frame of each on; NaN where no marker is seen."""
    layout, size = problem.rows_layout(), np.abs(r[: problem.core.data_rows])
    found = []
    for i, first in enumerate(since):
        mine = (layout.recording == i) & (layout.frame >= first)
        at, off = layout.frame[mine], size[mine]
        parts = [np.isin(at, part) for part in np.array_split(np.arange(first, int(at.max(initial=first)) + 1), pieces)]
        found.append([float(off[part].mean()) if part.any() else np.nan for part in parts])
    return np.array(found)
