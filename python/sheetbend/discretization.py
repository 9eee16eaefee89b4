"""The second half of an interval: what a finer discretization would move.

A parameter is physical only if the next mesh and the next time step agree about it. The refits start at the estimate
and cost about as much as the fit itself. A halving removes 1 - 2^-p of an error of order p, so what it moves is
carried on to the limit (Richardson): 4/3 of it for meshes and BDF2, twice for BDF1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .experiment import Experiment
from .optimizers import refit
from .parameters import Parameters
from .problem import FitProblem

_SECOND_ORDER = 4.0 / 3.0


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
    """By how much each free parameter would move up to the limit, in its unit: root sum of squares over the refits.
    Ctrl-C passes through."""
    moved: dict[str, float] = dict.fromkeys(problem.parameters.free, 0.0)
    here = problem.parameters.to_physical(u)
    for refined, to_limit in _refits(refinement, experiments):
        finer = FitProblem(refined, parameters, threads=threads)
        end = refit(finer, finer.parameters.to_internal(here), optimizer)
        there = finer.parameters.to_physical(end.u)
        for name in moved:
            moved[name] = float(np.hypot(moved[name], to_limit * (there[name] - here[name])))
    return moved


def _refits(refinement: Refinement, experiments: Sequence[Experiment]) -> list[tuple[list[Experiment], float]]:
    """Finer experiments, and the factor from what they move to the limit."""
    fitted = [e for e in experiments if e.predict is None]
    moving = [e for e in fitted if not e.static]
    refits = []
    if refinement.halve_step and moving:
        first_order = any(e.solver.integrator == "bdf1" for e in moving)
        refits.append(
            (
                [replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in fitted],
                2.0 if first_order else _SECOND_ORDER,
            )
        )
    if refinement.finer is not None:
        refits.append(([e for e in refinement.finer() if e.predict is None], _SECOND_ORDER))
    return refits
