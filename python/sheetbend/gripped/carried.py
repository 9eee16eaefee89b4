"""The derivatives at the end of a fit, reused by the next rung: only those with respect to what it adds are computed.

Rungs of small offsets begin where the last fit ended, with the same windows. With fifty parameters their first
derivatives would cost as much as the last ones of that fit, and differ from them by what a short step changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from .pieces import problem_of

Windows = tuple[tuple[str, ...], int]


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of residuals.

    Attributes:
        windows: names of the windows, and how many rows of data they have.
        names: of the free parameters.
        columns: (data rows, free) with respect to the internal parameters.
    """

    windows: Windows
    names: tuple[str, ...]
    columns: Array


def slopes_of(problem: FitProblem, J: Array | None) -> Slopes | None:
    """The derivatives that a search ended with; None where it made none."""
    if J is None:
        return None
    return Slopes(_windows(problem), tuple(problem.parameters.free), J[: problem.core.data_rows])


def carry(problem: FitProblem, slopes: Slopes | None, added: Sequence[Parameter], values: Mapping[str, float]) -> None:
    """Let a problem begin with these derivatives, if they are of its windows, and with those of what is added.

    Args:
        added: parameters that are new.
        values: where the problem begins.
    """
    if slopes is None or slopes.windows != _windows(problem):
        return
    new = problem_of(problem.experiments, added, values, problem.threads)
    known = {name: slopes.columns[:, k] for k, name in enumerate(slopes.names)}
    if not set(problem.parameters.free) <= known.keys() | set(new.parameters.free):
        return
    ok, r, J = new.evaluate(new.parameters.initial())
    rows, u = problem.core.data_rows, problem.parameters.initial()
    if not ok:
        return
    known |= {name: J[:rows, k] for k, name in enumerate(new.parameters.free)}
    columns = np.column_stack([known[name] for name in problem.parameters.free])
    residuals = np.concatenate([r[:rows], problem.parameters.prior_residuals(u)])
    problem.keep(u, residuals, np.vstack([columns, problem.parameters.prior_jacobian()]))


def _windows(problem: FitProblem) -> Windows:
    """Of a problem. They stay the same where markers are moved by millimeters, which changes derivatives little."""
    return tuple(e.name for e in problem.experiments), problem.core.data_rows
