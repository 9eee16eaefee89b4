"""Moves an estimate to the limit of short substeps, once, at the end of a fit.

Runs at h and h/2 are combined (see `extrapolation`), and Gauss-Newton steps go to the minimum of the combination's
residuals. What the combination of h/2 and h/4 would move it further is the uncertainty of that limit. Where the runs
cannot be combined, the estimate stays, and all that half the substep moves counts in its interval.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import RESTS
from ..result.result import Refit
from ..statistics.least_squares import solved, unexplained
from .linear_step import gauss_newton, moves, one_step, residuals_there
from .optimizers import refit
from .refuted import refuted, words

TIME_STEP, SWEEPS = "time step", "twice the sweeps"
TANGENTS = 3  # evaluations with tangents at most
THERE = 0.1  # standard errors, in the mean of all parameters: a step shorter than this has arrived
APART = 0.5  # standard errors, by which the limit wants a parameter elsewhere
AT = 1e-6  # of the size of a parameter that is no logarithm: so near a limit it has run off
SEARCHED, TOLERANCE = 50, 1e-8  # of a search of combined runs: iterations at most, and relative change of the cost
SECOND_ORDER, THIRD_ORDER = 4.0 / 3.0, 8.0 / 7.0  # from what a halving moves to the limit


@dataclass(frozen=True)
class Settled:
    """Where a fit's estimate stands once the time step is counted.

    Attributes:
        problem: of which u is the minimum: with runs combined, or as it was fitted.
        u: internal.
        moved: by how much, of each free parameter, in its unit; empty where nothing was moved.
        refits: what of the time step is left to count.
        not_counted: why nothing of it is, where it is not.
        warnings: where the data speak against a limit, or a parameter came back in it.
        searched: whether combined runs were fitted, because the first fit had left parameters at a limit.
    """

    problem: FitProblem
    u: np.ndarray
    moved: Mapping[str, float] = field(default_factory=dict)
    refits: tuple[Refit, ...] = ()
    not_counted: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    searched: bool = False

    @property
    def cost(self) -> float:
        """Half the sum of squares at u."""
        return 0.5 * float(np.sum(self.problem.evaluate(self.u)[1] ** 2))


def settle(problem: FitProblem, u: np.ndarray, optimizer: str = "auto") -> Settled:
    """Count the time step of a fit at its minimum u. Ctrl-C passes through.

    Args:
        optimizer: of a search of combined runs.
    """
    try:
        if all(map(can_be_combined, problem.experiments)):
            try:
                limit = problem.of(combined(problem.experiments))
                found = _to_short_substeps(problem, limit, u)
            except SheetbendError:  # a run at a fourth of the substep may have no answer where one at half has
                return _counted_whole(problem, u)
            try:
                return _back(problem, limit, u, found, optimizer)
            except SheetbendError as error:
                return replace(found, warnings=(*found.warnings, f"combined runs could not be fitted: {error}"))
        return _counted_whole(problem, u)
    except SheetbendError as error:
        return Settled(problem, u, not_counted=(f"{TIME_STEP} not counted: {error}",))


def can_be_combined(e: Experiment) -> bool:
    """Whether runs at several substeps give a limit: errors of a known order, iterations that converge, and one run so
    far."""
    solver = e.solver
    return e.static or (solver.extrapolate == 1 and solver.knows_order(e.scene.compiled) and not e.has_unknowns)


def combined(experiments: Sequence[Experiment]) -> list[Experiment]:
    """With runs at h and h/2, where they can be combined."""
    return [
        e if e.static or not can_be_combined(e) else replace(e, solver=replace(e.solver, extrapolate=2))
        for e in experiments
    ]


def _to_short_substeps(problem: FitProblem, limit: FitProblem, u: np.ndarray) -> Settled:
    there = residuals_there(problem, limit, u)  # raises where the combination has no answer at u
    _, r, J = problem.evaluate(u)
    first = gauss_newton(problem.parameters, u, J, there - r)
    before = float(np.sum(there**2))
    ok, there, _ = limit.evaluate(first, jacobian=False)
    if not (ok and float(np.sum(there**2)) <= before):
        whole = Refit(name=TIME_STEP, to_limit=1.0, moved=moves(problem.parameters, u, first))
        return Settled(problem, u, refits=(whole,))
    if _arrived(problem, there, J, gauss_newton(problem.parameters, first, J, there) - first) and refuted(
        problem, u, there
    ):
        return _stays(problem, u, first)
    onward = first
    for _ in range(TANGENTS):
        end = onward
        _, r, J = limit.evaluate(end)
        after, onward = float(np.sum(r**2)), gauss_newton(problem.parameters, end, J, r)
        if _arrived(problem, r, J, onward - end):
            break
        ok, there, _ = limit.evaluate(onward, jacobian=False)
        if not (ok and float(np.sum(there**2)) <= after):
            break  # what that step would move counts as open
    if refuted(problem, u, r):
        return _stays(problem, u, end)
    return Settled(limit, end, moves(problem.parameters, u, end), (_left(problem, limit, end, onward),))


def _left(problem: FitProblem, limit: FitProblem, end: np.ndarray, onward: np.ndarray) -> Refit:
    """What the limit leaves open at its minimum: what half the substep moves, and the step that was not taken."""
    finest = problem.of(combined(halved(problem.experiments)))
    left = np.abs(order_left(problem.experiments) * (one_step(limit, finest, end) - end)) + np.abs(onward - end)
    return Refit(name=TIME_STEP, to_limit=1.0, moved=moves(problem.parameters, end, end + left))


def _back(problem: FitProblem, limit: FitProblem, u: np.ndarray, found: Settled, optimizer: str) -> Settled:
    """Where a fit of combined runs ends, if the fit at u left parameters at a limit of its search and the combined runs
    want them elsewhere; else what was found."""
    lower, upper = problem.parameters.limits()
    log = np.array([problem.parameters[name].log for name in problem.parameters.free])
    near = np.where(log, RESTS, AT * np.maximum(np.abs(u), np.abs(problem.parameters.initial())))
    lost = (u - lower <= near) | (upper - u <= near)
    if lost.any():
        lost[lost] = _wanted_elsewhere(problem, u, limit, found.u, np.flatnonzero(lost))
    if not lost.any():
        return found
    end = refit(limit, np.where(lost, problem.parameters.initial(), found.u), optimizer, SEARCHED, TOLERANCE)
    if not end.cost < found.cost:
        return replace(found, searched=found.problem is limit)
    _, r, J = limit.evaluate(end.u)
    left = _left(problem, limit, end.u, gauss_newton(problem.parameters, end.u, J, r))
    told = (
        f"{', '.join(np.array(problem.parameters.free)[lost])} went to a limit at the substep of the fit, which "
        "combined runs at this substep and half of it do not confirm. So these were fitted, and intervals come from "
        "them. Use a shorter substep"
    )
    return Settled(limit, end.u, moves(problem.parameters, u, end.u), (left,), warnings=(told,), searched=True)


def _wanted_elsewhere(
    problem: FitProblem, u: np.ndarray, limit: FitProblem, at: np.ndarray, columns: Iterable[int]
) -> list[bool]:
    """Whether the Gauss-Newton steps of a fit at u and of the limit there, both without bounds, differ in each of these
    parameters by a good part of its standard error."""
    _, r, J = problem.evaluate(u)
    _, there, K = limit.evaluate(at)
    apart = solved(K, there) - solved(J, r)
    noise = np.sqrt(there @ there / max(len(there) - len(u), 1))
    own = {k: unexplained(np.delete(K, k, axis=1), K[:, k]) for k in columns}
    return [float(np.linalg.norm(apart[k] * column)) > APART * noise for k, column in own.items()]


def _arrived(problem: FitProblem, r: np.ndarray, J: np.ndarray, step: np.ndarray) -> bool:
    """Whether a step (free,) from where the residuals are r (rows,), with derivatives J, is too short to be taken."""
    scatter = float(r @ r) / max(len(r) - len(problem.parameters.free), 1)
    return float(np.sum((J @ step) ** 2)) <= THERE**2 * len(step) * scatter


def _stays(problem: FitProblem, u: np.ndarray, limit: np.ndarray) -> Settled:
    """Where the data speak against the limit (free,): all that it would move counts."""
    whole = Refit(name=TIME_STEP, to_limit=1.0, moved=moves(problem.parameters, u, limit))
    told = words("short substeps", "at the same substep", "refine=False, or halve_step = false in a configuration")
    return Settled(problem, u, refits=(whole,), warnings=(told,))


def _counted_whole(problem: FitProblem, u: np.ndarray) -> Settled:
    halves = problem.of(halved(problem.experiments))
    made = moves(problem.parameters, u, one_step(problem, halves, u))
    whole = Refit(name=TIME_STEP, to_limit=to_limit_of_steps(problem.experiments), moved=made)
    return Settled(problem, u, refits=(whole,))


def halved(experiments: Sequence[Experiment]) -> list[Experiment]:
    """The same at half the substep."""
    return [replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in experiments]


def order_left(experiments: Iterable[Experiment]) -> float:
    """Factor from what the combination at half the substep moves to the limit of short ones.

    Where something touches, it is that of an error of first order, though the combination has taken the first term out:
    what contacts leave changes with their place in a substep (measured: halvings shrink it by 1.7 to 3).
    """
    moving = [e for e in experiments if not e.static]
    if any(e.scene.compiled.contacts or e.scene.compiled.touches_itself for e in moving):
        return 2.0
    return SECOND_ORDER if any(e.solver.integrator == "bdf1" for e in moving) else THIRD_ORDER


def to_limit_of_steps(experiments: Iterable[Experiment]) -> float:
    """Factor from what half the substep moves to the limit of short ones."""
    first_order = any(e.solver.integrator == "bdf1" for e in experiments if not e.static)
    return 2.0 if first_order else SECOND_ORDER
