"""A fit with further parameters beside its own."""

from __future__ import annotations

from collections.abc import Sequence

from ..minimum.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters


def with_parameter(problem: FitProblem, more: Parameter, expanded: Sequence[Parameter] | None = None) -> FitProblem:
    """The same problem with one more parameter at the end.

    Args:
        expanded: those of the single experiments, where it is private.
    """
    return FitProblem(
        problem.experiments,
        Parameters([*problem.given.values(), more]),
        problem.recordings,
        problem.threads,
        Parameters([*problem.parameters.values(), *([more] if expanded is None else expanded)]),
    )
