"""Whether an optimizer ended in a minimum: else no verdict follows from where it ended."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..minimum.linear_step import gauss_newton
from ..minimum.progress import Minimum
from ..minimum.search import Search
from ..minimum.slope import ROUNDING, promised
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of

FAR = 1e-3
"""Share of the cost that a step may still promise where an optimizer was stopped: a few standard errors."""
HARDLY = 0.5  # of the first cost: an optimizer that took less off may never have moved
MISSED = 9.0  # times sigma squared: residuals for which ending near the start is suspicious
MOVES = 0.25
"""Half-widths: an interval that is off by so much holds the truth in 92 instead of 95 of 100 cases."""
NEARBY = 0.1  # of a parameter, or of its scale: where the cost must not be lower than at the end


def no_minimum(problem: FitProblem, end: Minimum) -> str:
    """Why the end of an optimizer is no minimum, in words; empty where it is one.

    An end above its own start is none: windows led away, and nothing on the whole motion leads back. An end that
    `slope.judged` refused is none. One that was stopped (by Ctrl-C, by the number of iterations) is none where a
    Gauss-Newton step promises more than `FAR` of the cost. One near its start with large residuals is none where a
    small change of a single parameter lowers the cost: two to four simulations for each, in that case alone.
    """
    if end.doubt and not end.converged:
        return end.doubt
    if not end.converged:
        left = promised(problem, end.u)
        stopped = "interrupted" if end.interrupted else "the optimizer stopped"
        if left > FAR and not _rounding(left * end.cost, end):
            return f"{stopped} early: its next step would lower the cost by {short(100 * left, 2)} %"
    if above_start(end):
        return f"the fit ended at {short(end.cost / (end.first or 1.0), 2)} times the cost of its own start"
    if not end.converged:
        return ""
    rows = problem.core.data_rows
    if end.first is None or end.cost <= HARDLY * end.first or 2 * end.cost <= MISSED * rows:
        return ""
    return _lower_nearby(problem, end)


def above_start(end: Minimum) -> bool:
    """Whether a search ended where the cost of the whole motion is higher than where it began."""
    return end.first is not None and end.first > 0.0 and end.cost > (1.0 + FAR) * end.first


def from_start(search: Search, problem: FitProblem, ends: Sequence[Minimum]) -> tuple[Minimum, ...]:
    """The ends of a search, best first, with that of a search on the whole motion from the start, if it is lower than
    an end above it. Ctrl-C passes through."""
    start = problem.parameters.initial()
    if not above_start(ends[0]) or not problem.cost(start) < ends[0].cost:
        return tuple(ends)
    try:
        other = search.onward(problem, start)
    except SheetbendError:
        return tuple(ends)
    if other.interrupted:
        raise KeyboardInterrupt
    return (other, *ends) if other.cost < ends[0].cost else tuple(ends)


def unfinished(problem: FitProblem, end: Minimum, judged: Identifiability) -> tuple[dict[str, str], str]:
    """What a step that was not taken would move, in half-widths: the doubts of parameters that it moves by a good part
    of one, and a warning where it moves none so far; both empty at a minimum that an optimizer has found.

    A share of the cost does not tell: with many residuals a thousandth of it is many standard errors.

    Args:
        end: of the search; it is none of those that `no_minimum` finds.
    """
    if end.converged:
        return {}, ""
    ok, r, J = problem.evaluate(end.u)
    if not ok or not np.isfinite(J).all():
        return {}, ""
    step = np.abs(gauss_newton(problem.parameters, end.u, J, r) - end.u)
    moved: dict[str, float] = {}
    for e in judged.estimates:
        reach = reach_of(problem.parameters[e.name], e)
        if 0.0 < reach < np.inf:
            moved[e.name] = float(step[problem.parameters.free.index(e.name)]) / reach
    how = (
        "the fit was interrupted"
        if end.interrupted
        else f"the optimizer stopped before its end ({end.message.rstrip('.')})"
    )
    found = {
        name: f"{how}, where its next step would move it by {short(by, 2)} half-widths"
        for name, by in moved.items()
        if by > MOVES
    }
    if found or not moved:
        return found, ""
    most = max(moved, key=lambda name: moved[name])
    return {}, f"the next step would move no parameter by more than {short(moved[most], 2)} half-widths ({most})"


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
                    return f"it hardly moved, although {name} = {value} alone lowers the cost by {short(less, 2)} %"
    return ""
