"""The second half of an interval: what a finer discretization would move.

A parameter is physical only if the next mesh and the next time step agree about it. By default the estimate is moved to
the limit of short substeps (see `time_step`). The mesh counts where a finer one can be made: by a refit, which costs
more than the fit itself, or by linear refinement, two simulations of the finer mesh and two Gauss-Newton steps with the
Jacobian of the fit. A halving removes 1 - 2^-p of an error of order p, so what it moves is multiplied up to the limit
(Richardson): by 4/3 for meshes, by 2 for sweeps. The estimate is moved to the limit of fine meshes too where the mesh
is fine enough for that (see `fine_meshes`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..result.result import Refit
from ..statistics.profile import FARTHEST
from .fine_meshes import left_open, two_steps
from .linear_step import gauss_newton, moves, one_step, residuals_there
from .optimizers import refit
from .progress import Minimum
from .refuted import refuted, words
from .time_step import SECOND_ORDER, SWEEPS, TIME_STEP, Settled, combined, settle

MESH, FINER_MESH = "mesh", "finer mesh"


@dataclass(frozen=True)
class Refinement:
    """How a fit is repeated on a finer time step and mesh.

    Example: `sb.Refinement(finer=lambda: [model(80)])`, where `model(40)` makes the experiment that is fitted.

    Attributes:
        halve_step: extrapolate the estimate to the limit of short substeps; intervals include the error that remains.
        finer: function that makes the same experiments with twice the nodes. The estimate is then also extrapolated to
            the limit of fine meshes. None = the intervals do not include the error of the mesh.
        linear: use Gauss-Newton steps with the Jacobian of the fit instead of a second fit on the finer mesh.
    """

    halve_step: bool = True
    finer: Callable[[], Sequence[Experiment]] | None = None
    linear: bool = False


AUTO = Refinement(linear=True)
NONE = Refinement(halve_step=False)


def wanted_refinement(given: Refinement | str | bool | None) -> Refinement:
    """What `refine` of `fit` means.

    Raises:
        InputError: none of the forms that it may have.
    """
    if isinstance(given, Refinement):
        return given
    if given is True or (isinstance(given, str) and given == "auto"):
        return AUTO
    if given is None or given is False:
        return NONE
    fix = "give 'auto', False or a Refinement"
    raise InputError("refine", "is not a way to refine", given, fix)


def settled(
    refinement: Refinement,
    experiments: Sequence[Experiment],
    problem: FitProblem,
    end: Minimum,
    optimizer: str | None,
) -> tuple[Settled, Sequence[Experiment]]:
    """The fit with its discretization counted, and all experiments as the estimate explains them; Ctrl-C passes.

    Args:
        optimizer: of refits; None after Ctrl-C, where nothing is counted any more.
    """
    if optimizer is None:
        return Settled(problem, end.u, not_counted=_left_out(NONE, problem.experiments)), experiments
    missing = _left_out(refinement, problem.experiments)
    found = Settled(problem, end.u)
    if refinement.halve_step and any(not e.static for e in problem.experiments):
        if end.converged:
            found = settle(problem, end.u, optimizer)
        else:
            missing = (f"{TIME_STEP} not counted: the fit did not converge", *missing)
    refits, failed, warnings = refined_estimates(refinement, experiments, problem, end.u, found.u, optimizer)
    whole = replace(
        found,
        refits=(*found.refits, *refits),
        not_counted=(*found.not_counted, *missing, *failed),
        warnings=(*found.warnings, *warnings),
    )
    return whole, combined(experiments) if found.problem is not problem else experiments


def _left_out(refinement: Refinement, experiments: Sequence[Experiment]) -> tuple[str, ...]:
    """What intervals are not asked to count although the experiments have it."""
    found = []
    if not refinement.halve_step and any(not e.static for e in experiments):
        found.append(f"{TIME_STEP} not counted")
    if refinement.finer is None and any(e.scene.ropes or e.scene.sheets for e in experiments):
        found.append(f"{MESH} not counted")
    return tuple(found)


def refined_estimates(
    refinement: Refinement,
    experiments: Sequence[Experiment],
    problem: FitProblem,
    u: np.ndarray,
    at: np.ndarray,
    optimizer: str,
) -> tuple[tuple[Refit, ...], tuple[str, ...], tuple[str, ...]]:
    """By how much each refit moves each free parameter, in its unit; what could not be counted, with its cause; and
    warnings where the data speak against a refinement. Ctrl-C passes through.

    Args:
        problem: of the fit, at the substep of the experiments; u: its minimum.
        at: where the estimate is by now, from which the same internal steps are told.
    """
    made: list[Refit] = []
    failed: list[str] = []
    warnings: list[str] = []
    for name, refined, to_limit in _refits(refinement, experiments):
        try:
            finer = FitProblem(refined(), problem.given, threads=problem.threads)
            rest: np.ndarray | float = 0.0
            if name == SWEEPS:
                end = one_step(problem, finer, u)
            elif refinement.linear:
                end, rest = two_steps(problem, finer, u)
            else:
                end = _refitted(problem, finer, u, optimizer)
        except SheetbendError as error:
            failed.append(f"{name} not counted: {error}")
            continue
        left: dict[str, float] = {}  # all of it
        if name != SWEEPS:
            ok, there, _ = finer.evaluate(end, jacobian=False)
            if ok and refuted(problem, u, there):
                warnings.append(words("fine meshes", "on the same mesh", "double_segments = false in a configuration"))
            else:
                left = left_open(problem.parameters, at, to_limit * (end - u), to_limit * rest)
        made.append(Refit(name=name, to_limit=to_limit, moved=moves(problem.parameters, at, at + end - u), left=left))
    return tuple(made), tuple(failed), tuple(warnings)


def _refitted(problem: FitProblem, finer: FitProblem, u: np.ndarray, optimizer: str) -> np.ndarray:
    """The minimum of a finer problem. The search starts where `one_step` leads from the minimum u of the fit, if the
    cost is lower there: that is near the end, and takes no Jacobian of the finer problem."""
    there = residuals_there(problem, finer, u)
    _, r, J = problem.evaluate(u)
    step = gauss_newton(problem.parameters, u, J, there - r)
    start, first = min(((u, 0.5 * float(there @ there)), (step, finer.cost(step))), key=lambda each: each[1])
    return refit(finer, start, optimizer, first=first).u


def to_the_limit(refits: Iterable[Refit], parameters: Parameters, values: Mapping[str, float]) -> dict[str, float]:
    """By how much each parameter would still move up to the limit, in its unit: root sum of squares over the refits.

    A logarithmic one moves by a factor, and its size is that of the factor upward: from 1 to 0.4 is 1.5, as to 2.5;
    nothing is told apart from a factor of a million.
    """
    total: dict[str, float] = {}
    for made in refits:
        for name, moved in made.moved.items():
            open_, factor = (made.left[name], 1.0) if name in made.left else (moved, made.to_limit)
            log = parameters[name].log
            step = math.log(max(1.0 + open_ / values[name], math.exp(-FARTHEST))) if log else open_
            total[name] = math.hypot(total.get(name, 0.0), factor * step)
    return {
        name: values[name] * math.expm1(min(size, FARTHEST)) if parameters[name].log else size
        for name, size in total.items()
    }


def _refits(
    refinement: Refinement, experiments: Sequence[Experiment]
) -> list[tuple[str, Callable[[], list[Experiment]], float]]:
    """What is refined, what makes the finer experiments, and the factor from what they move to the limit."""
    fitted = [e for e in experiments if e.predict is None]
    moving = [e for e in fitted if not e.static]
    refits: list[tuple[str, Callable[[], list[Experiment]], float]] = []
    if refinement.halve_step and any(e.solver.method == "gauss_seidel" for e in moving):
        refits.append((SWEEPS, lambda: [_swept(e) for e in fitted], 2.0))
    if refinement.finer is not None:
        make = refinement.finer
        refits.append((FINER_MESH, lambda: [e for e in make() if e.predict is None], SECOND_ORDER))
    return refits


def _swept(e: Experiment) -> Experiment:
    """With twice as many sweeps."""
    if e.solver.method != "gauss_seidel":
        return e
    return replace(e, solver=replace(e.solver, iterations=2 * e.solver.sweeps))
