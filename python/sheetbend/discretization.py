"""The second half of an interval: what a finer discretization would move.

A parameter is physical only if the next mesh and the next time step agree about it. The refits start at the estimate and cost about as much
as the fit itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .experiment import Experiment
from .optimizers import minimize
from .parameters import Parameters
from .problem import FitProblem


@dataclass(frozen=True)
class Refinement:
    """How to refine.

    Attributes:
        halve_step: refit motions at half the substep.
        finer: makes the same experiments with twice the nodes; None = the mesh is not refined.
    """

    halve_step: bool = True
    finer: Callable[[], Sequence[Experiment]] | None = None


def refined_estimates(
    refinement: Refinement,
    experiments: Sequence[Experiment],
    parameters: Parameters,
    problem: FitProblem,
    u: np.ndarray,
    optimizer: str,
    threads: int = 1,
) -> dict[str, float]:
    """By how much each free parameter moves, in its unit: the root sum of squares over the refits."""
    moved: dict[str, float] = dict.fromkeys(problem.parameters.free, 0.0)
    here = problem.parameters.to_physical(u)
    for refined in _refits(refinement, experiments):
        finer = FitProblem(refined, parameters, threads=threads)
        end, _ = minimize(finer, finer.parameters.to_internal(here), optimizer)
        there = finer.parameters.to_physical(end.u)
        for name in moved:
            moved[name] = float(np.hypot(moved[name], there[name] - here[name]))
    return moved


def _refits(refinement: Refinement, experiments: Sequence[Experiment]) -> list[list[Experiment]]:
    fitted = [e for e in experiments if e.predict is None]
    refits = []
    if refinement.halve_step and any(not e.static for e in fitted):
        refits.append([replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in fitted])
    if refinement.finer is not None:
        refits.append([e for e in refinement.finer() if e.predict is None])
    return refits

