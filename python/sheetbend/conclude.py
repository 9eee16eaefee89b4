"""What follows from the minimum of a fit: verdicts and intervals of its parameters, and warnings of its course."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from .floors import solver_floors
from .identifiability import Identifiability, identify
from .judge import Nuisance
from .optimizers import Minimum, refit
from .problem import FitProblem

PROFILE_TOLERANCE = 1e-7  # relative, of the cost: an interval's rise is many times that
MISSED = 3.0  # sigmas: residuals so large are no noise
INACCURATE = 0.5  # a start whose cost exceeds the best by this share ended elsewhere


def judged_parameters(
    problem: FitProblem,
    u: np.ndarray,
    refined: Mapping[str, float],
    systematic: Mapping[str, float],
    refitter: str | None,
) -> Identifiability:
    """Verdicts and intervals; without a refitter the intervals are the linear ones."""
    _, r, J = problem.evaluate_exactly(u)
    rows, behind = problem.prior_rows
    return identify(
        problem.parameters,
        u,
        r[:rows],
        J[:rows],
        layout=problem.rows_layout(),
        floors=solver_floors(problem.experiments, problem.parameters),
        discretization=refined,
        systematic=systematic,
        profile=None if refitter is None or len(problem.parameters.free) == 1 else _profile(problem, u, refitter),
        cost=lambda at: _cost(problem, at),
        nuisance=Nuisance(J[behind:], sum(map(problem.core.absorbed, range(len(problem.experiments))))),
    )


def _cost(problem: FitProblem, u: np.ndarray) -> float:
    ok, r, _ = problem.evaluate(u, jacobian=False)
    return 0.5 * float(r @ r) if ok else np.inf


def _profile(problem: FitProblem, u: np.ndarray, refitter: str) -> Callable[[str, float], float]:
    """(name, value) -> cost with that parameter held and the others refitted, of the experiments that it reaches."""
    values = problem.parameters.to_physical(u)
    ends: dict[str, dict[float, np.ndarray]] = {}  # by name and value held: where the others ended, all internal

    def cost(name: str, value: float) -> float:
        part, parameter = problem.around(name), problem.parameters[name]
        if part.parameters.free == (name,):
            return _cost(part, part.parameters.to_internal({name: value}))
        held = part.holding(name, value)
        mean, sd = parameter.prior or (value, 1.0)
        pull = (parameter.to_internal(value) - parameter.to_internal(mean)) / sd
        at = parameter.to_internal(value)
        known = ends.setdefault(name, {parameter.to_internal(values[name]): held.parameters.to_internal(values)})
        start = known[min(known, key=lambda other: abs(other - at))]
        if not np.isfinite(_cost(held, start)):
            return np.inf  # the motion diverges: out of the question
        end = refit(held, start, refitter, 50, PROFILE_TOLERANCE)
        known[at] = end.u
        return end.cost + 0.5 * pull**2

    return cost


def course_warnings(ends: Sequence[Minimum], best: Minimum, interrupted: bool, rows: int) -> tuple[str, ...]:
    warnings = []
    missed = float(np.sqrt(2.0 * best.cost / rows))
    if missed > MISSED:
        warnings.append(
            f"residuals are {missed:.2g} times sigma: this motion is not the measured one, and values may be wrong by "
            "more than their intervals say. A start far off wants short pieces first (windows) or other starts; else "
            "see where it misses: what is held, places of markers, mesh, missing physics, or a sigma too small"
        )
    if best.converged and best.doubt:
        warnings.append(f"the fit ended where {best.doubt}; intervals take the cost as smooth")
    if interrupted:
        warnings.append(
            "interrupted: intervals are the linear ones, without profiles and without refits on a finer discretization"
        )
    elsewhere = [m for m in ends if m.cost > best.cost * (1.0 + INACCURATE)]
    if elsewhere:
        warnings.append(f"{len(elsewhere)} of {len(ends)} starts ended in a worse minimum: the cost has several")
    if not best.converged and not best.interrupted:
        warnings.append(f"the fit did not converge: {best.message}")
    return tuple(warnings)
