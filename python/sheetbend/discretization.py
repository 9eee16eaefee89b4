"""The second half of an interval: what a finer discretization would move.

A parameter is physical only if the next mesh and the next time step agree about it. The refits start at the estimate
and cost about as much as the fit itself; a single Gauss-Newton step with the Jacobian of the fit costs one simulation,
and is right to first order in what the residuals change. A halving removes 1 - 2^-p of an error of order p, so what it
moves is carried on to the limit (Richardson): 4/3 of it for meshes and BDF2, twice for BDF1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .errors import SheetbendError
from .experiment import Experiment
from .gauge import RANK_TOLERANCE
from .optimizers import refit
from .parameters import Parameters
from .problem import FitProblem
from .profile import FARTHEST
from .result import Refit

_SECOND_ORDER = 4.0 / 3.0


@dataclass(frozen=True)
class Refinement:
    """How to refine.

    Attributes:
        halve_step: refit motions at half the substep.
        finer: makes the same experiments with twice the nodes; None = the mesh is not refined.
        linear: one Gauss-Newton step with the Jacobian of the fit stands for each refit.
    """

    halve_step: bool = True
    finer: Callable[[], Sequence[Experiment]] | None = None
    linear: bool = False


def refined_estimates(
    refinement: Refinement,
    experiments: Sequence[Experiment],
    parameters: Parameters,
    problem: FitProblem,
    u: np.ndarray,
    optimizer: str,
    threads: int = 1,
) -> tuple[Refit, ...]:
    """By how much each refit moves each free parameter, in its unit. Ctrl-C passes through.

    Raises:
        SheetbendError: the finer experiments have no answer at the estimate.
    """
    here = problem.parameters.to_physical(u)
    moved = []
    for name, refined, to_limit in _refits(refinement, experiments):
        finer = FitProblem(refined, parameters, threads=threads)
        start = finer.parameters.to_internal(here)
        end = _one_step(problem, finer, u) if refinement.linear else refit(finer, start, optimizer).u
        there = finer.parameters.to_physical(end)
        moves = {key: there[key] - here[key] for key in problem.parameters.free}
        moved.append(Refit(name=name, to_limit=to_limit, moved=moves))
    return tuple(moved)


def to_the_limit(refits: Iterable[Refit], parameters: Parameters, values: Mapping[str, float]) -> dict[str, float]:
    """By how much each parameter would move up to the limit, in its unit: root sum of squares over the refits.

    A logarithmic one moves by a factor, and its size is that of the factor upward: from 1 to 0.4 is 1.5, as to 2.5;
    nothing is told apart from a factor of a million.
    """
    total: dict[str, float] = {}
    for made in refits:
        for name, moved in made.moved.items():
            log = parameters[name].log
            step = math.log(max(1.0 + moved / values[name], math.exp(-FARTHEST))) if log else moved
            total[name] = math.hypot(total.get(name, 0.0), made.to_limit * step)
    return {
        name: values[name] * math.expm1(min(size, FARTHEST)) if parameters[name].log else size
        for name, size in total.items()
    }


def _one_step(problem: FitProblem, finer: FitProblem, u: np.ndarray) -> np.ndarray:
    """Where the minimum goes to first order; parameters at a bound stay there."""
    _, r, J = problem.evaluate(u)
    ok, there, _ = finer.evaluate(u, jacobian=False)
    if not ok:
        raise SheetbendError(f"the refinement cannot start: {finer.core.failure or 'a residual is not finite'}")
    lower, upper = problem.parameters.bounds()
    inside = (u > lower) & (u < upper)
    size = np.maximum(np.linalg.norm(J[:, inside], axis=0), np.finfo(float).tiny)
    step = np.linalg.lstsq(J[:, inside] / size, r - there, rcond=RANK_TOLERANCE)[0] / size
    end = u.copy()
    end[inside] += step
    return np.clip(end, lower, upper)


def _refits(refinement: Refinement, experiments: Sequence[Experiment]) -> list[tuple[str, list[Experiment], float]]:
    """What is refined, the finer experiments, and the factor from what they move to the limit."""
    fitted = [e for e in experiments if e.predict is None]
    moving = [e for e in fitted if not e.static]
    refits = []
    if refinement.halve_step and moving:
        first_order = any(e.solver.integrator == "bdf1" for e in moving)
        finer = [replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in fitted]
        refits.append(("half the step", finer, 2.0 if first_order else _SECOND_ORDER))
    if refinement.finer is not None:
        refits.append(("finer mesh", [e for e in refinement.finer() if e.predict is None], _SECOND_ORDER))
    return refits
