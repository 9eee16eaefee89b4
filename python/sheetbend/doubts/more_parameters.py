"""A fit with further parameters beside its own."""

from __future__ import annotations

from collections.abc import Sequence

from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters


def with_parameter(problem: FitProblem, more: Parameter, expanded: Sequence[Parameter] | None = None) -> FitProblem:
    """The same problem with one more parameter at the end.

    Quantities that are made for it have names that start with a bracket, which `Scene.add_quantity` refuses. So they
    never stand in the place of one that the scene has.

    Args:
        expanded: those of the single experiments, where it is private.
    """
    return problem.replaced(
        parameters=Parameters([*problem.given.values(), more]),
        expanded=Parameters([*problem.parameters.values(), *([more] if expanded is None else expanded)]),
    )
