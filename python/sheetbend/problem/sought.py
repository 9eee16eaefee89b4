"""What a fit looks for, and where its search begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from .problem import FitProblem
from .smooth import Field


@dataclass(frozen=True)
class Sought:
    """The parameters of a fit with their priors.

    Attributes:
        experiments: that are fitted.
        wanted: parameters, private ones not expanded.
        expanded: the same where the search begins; None = at the initial values.
        fields: smooth fields among them, with the size and the length of their priors.
        undone: what Ctrl-C left undone before the search, in words; empty if it did not come.
    """

    experiments: Sequence[Experiment]
    wanted: Parameters
    expanded: Parameters | None = None
    fields: tuple[Field, ...] = ()
    undone: str = ""

    def problem(self, threads: int) -> FitProblem:
        """The least-squares problem."""
        return FitProblem(self.experiments, self.wanted, threads=threads, expanded=self.expanded)
