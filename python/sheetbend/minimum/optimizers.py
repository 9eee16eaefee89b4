"""Levenberg-Marquardt on a compiled problem: Ceres where it was built in, SciPy's trust region otherwise. Both see the
same function."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ..errors import InputError, SheetbendError
from ..optional import require
from ..quantities.wording import short
from ..statistics.gauge import RANK_TOLERANCE
from .approach import Approach, inside
from .conditioning import Condition
from .counts import count, counted
from .geometric import GeometricSteps
from .problem import FitProblem

OPTIMIZERS = ("auto", "ceres", "scipy")
WALK, WALK_PROMISE = 20, 1e-3  # steps before a search at most, and of the cost what a step must promise to go on
LOST = 0.1  # of the cost: a slope that promises so much is no end
STUCK = 1e-5  # of the cost: a third of a standard error where residuals are ten thousand
ROUNDING = 1e-12  # of the first cost: residuals of data without noise end as rounding errors, which have any slope


@dataclass(frozen=True)
class Progress:
    """One iteration: its number, the cost (half the sum of squares), the internal point, and the length [s] of the
    window that is fitted first, if one is. Before the first step it has the number 0 and the condition there; while
    many starts are raced it is the end of one of them, (its number, of how many)."""

    iteration: int
    cost: float
    u: np.ndarray
    window: float | None = None
    condition: Condition | None = None
    start: tuple[int, int] | None = None


@dataclass(frozen=True)
class Minimum:
    """Where an optimizer ended; `interrupted` by Ctrl-C, with its best so far. `first` is the cost where it began,
    `doubt` says what speaks against its being a minimum. `evaluations` simulated all experiments, `jacobians` of these
    with derivatives; `windows` [s] were fitted before. `group` is the number of the raced starts that it speaks for."""

    u: np.ndarray
    cost: float
    iterations: int
    evaluations: int
    converged: bool
    interrupted: bool
    message: str
    first: float | None = None
    doubt: str = ""
    jacobians: int = 0
    windows: tuple[float, ...] = ()
    group: int = 0


Observer = Callable[[Progress], None]


def walked(problem: FitProblem, u: np.ndarray, observe: Observer | None) -> np.ndarray:
    """(free,) where a walk from u ends that leaves the last steps to a search."""
    walk = Approach(problem, u)
    while walk.iterations < WALK and walk.step():
        if observe is not None:
            observe(Progress(walk.iterations, walk.cost, walk.u.copy()))
        if walk.promised < WALK_PROMISE:
            break
    return walk.u


def has_ceres() -> bool:
    """Whether the Ceres module was built, and loads."""
    return importlib.util.find_spec("sheetbend._ceres") is not None and not ceres_trouble()


@cache
def ceres_trouble() -> str:
    """Why a Ceres module that was built does not load, as where its library is of another version; else empty."""
    try:
        importlib.import_module("sheetbend._ceres")
    except ModuleNotFoundError:
        return ""
    except ImportError as error:
        return str(error)
    return ""


def named(optimizer: str) -> str:
    """The optimizer that a name stands for.

    Raises:
        InputError: unknown, or Ceres asked for and not built.
    """
    if optimizer not in OPTIMIZERS:
        raise InputError("optimizer", "is unknown", optimizer, f"use one of: {', '.join(OPTIMIZERS)}")
    if optimizer == "ceres" and not has_ceres():
        raise InputError(
            "optimizer",
            f"does not load: {ceres_trouble()}" if ceres_trouble() else "was not built into this installation",
            "ceres",
            "install Ceres (libceres-dev) and rebuild, or use 'scipy'",
        )
    return optimizer if optimizer != "auto" else "ceres" if has_ceres() else "scipy"


def minimize(
    problem: FitProblem,
    u: np.ndarray,
    optimizer: str = "auto",
    max_iterations: int = 200,
    tolerance: float = 1e-10,
    observe: Observer | None = None,
    first: float | None = None,
) -> tuple[Minimum, str]:
    """Minimize half the sum of squared residuals from u (free,), in the problem's coordinates, inside their limits and
    by steps no longer than they allow; also returns the optimizer's name.

    Args:
        first: the cost at u, where it is known.

    Raises:
        InputError: see `named`.
        SheetbendError: the start itself has no answer (divergence, no equilibrium).
    """
    name = named(optimizer)
    if first is None:
        ok, r, _ = problem.evaluate(u, jacobian=False)
        if not ok:
            raise SheetbendError(f"the fit cannot start: {problem.failure}")
        first = 0.5 * float(r @ r)
    run = _ceres if name == "ceres" else _scipy
    end = run(problem, np.array(u, dtype=float), max_iterations, tolerance, _Best(observe, u, first))
    return replace(end, first=first), name


def judged(problem: FitProblem, end: Minimum, first: float) -> Minimum:
    """An optimizer's end after a first cost: in doubt where the cost has still a slope, and no convergence where that
    promises a good part of the cost. Optimizers also stop where steps are small and take little off, as they are
    wherever no step lowers the cost: at a kink, or where gradients are off."""
    if not end.converged:
        return end
    left = promised(problem, end.u)
    if left <= STUCK or left * end.cost <= ROUNDING * first:
        return end
    words = f"no step lowers the cost, though its slope promises {short(100 * left, 2)} % less (a kink, a rough motion)"
    return replace(end, converged=left < LOST, message=f"{words}: {end.message}", doubt=words)


def promised(problem: FitProblem, u: np.ndarray) -> float:
    """Share of the cost that a Gauss-Newton step from u inside the bounds would take off, were the residuals linear in
    the problem's coordinates."""
    ok, r, J = problem.evaluate(u)
    lower, upper = problem.coordinates.limits()
    u = problem.coordinates.into(u)
    J = problem.coordinates.jacobian(J, u)
    slope, size = J.T @ r, np.linalg.norm(J, axis=0)
    free = (size > RANK_TOLERANCE * np.linalg.norm(r)) & ~((u <= lower) & (slope > 0)) & ~((u >= upper) & (slope < 0))
    if not ok or not free.any() or not r.any():
        return 0.0
    if problem.coordinates.charts:  # near a limit the linear model would go on for ever
        longest = problem.coordinates.longest
        step = inside(J, r, np.zeros(len(u)), np.maximum(lower - u, -longest), np.minimum(upper - u, longest))
        return float(1.0 - np.sum((r + J @ step) ** 2) / (r @ r))
    columns = J[:, free] / size[free]
    step = np.linalg.lstsq(columns, r, rcond=RANK_TOLERANCE)[0]
    return float(np.sum((columns @ step) ** 2) / (r @ r))


def refit(
    problem: FitProblem,
    u: np.ndarray,
    optimizer: str,
    max_iterations: int = 200,
    tolerance: float = 1e-10,
    first: float | None = None,
) -> Minimum:
    """`minimize` for a step of larger work (a profile, a refinement), which Ctrl-C ends as a whole.

    Raises:
        KeyboardInterrupt: an interrupted end is worth nothing to the caller.
    """
    end, _ = minimize(problem, u, optimizer, max_iterations, tolerance, first=first)
    if end.interrupted:
        raise KeyboardInterrupt
    return end


class _Best:
    """Keeps the best point seen and passes progress on."""

    def __init__(self, observe: Observer | None, u: np.ndarray, cost: float) -> None:
        self.observe, self.u, self.cost = observe, np.array(u, dtype=float), cost

    def __call__(self, iteration: int, cost: float, u: Sequence[float] | np.ndarray) -> None:
        if cost <= self.cost:
            self.u, self.cost = np.array(u, dtype=float), cost
        if self.observe is not None:
            self.observe(Progress(iteration, cost, np.array(u, dtype=float)))


def _ceres(problem: FitProblem, u: np.ndarray, max_iterations: int, tolerance: float, best: _Best) -> Minimum:
    """Ceres, with coordinates that rest at a limit held there, from the start or from where they come to it: it
    searches along every step that it projects, and comes near a minimum beside a limit by small steps only. Steps that
    become a geometric series are summed up."""
    w = np.clip(problem.coordinates.into(u), *problem.coordinates.limits())
    held = _resting(problem, w)
    spent = [0, 0, 0]
    watch = sums = True
    while True:
        left = max_iterations - spent[0]
        steps = GeometricSteps(wanted=sums and not problem.estimates_corrections)
        end, stopped = _ceres_holding(problem, w, held, left, tolerance, best, watch, steps, spent[0])
        spent = [a + b for a, b in zip(spent, (end.iterations, end.evaluations, end.jacobians), strict=True)]
        end = replace(end, iterations=spent[0], evaluations=spent[1], jacobians=spent[2])
        if end.interrupted or (stopped is None and not held):
            return end
        if stopped is not None and steps.sum is not None:
            w = np.clip(steps.sum, *problem.coordinates.limits())
            sums = problem.cost(problem.coordinates.out(w)) < end.cost
            spent[1] += 1
            w = w if sums else stopped
            continue
        w = problem.coordinates.into(end.u) if stopped is None else stopped
        resting = _resting(problem, w)
        if stopped is not None:
            watch = bool(resting - held)
            held |= resting
        elif resting >= held:
            return end
        else:
            held, watch = frozenset(), False


def _resting(problem: FitProblem, w: np.ndarray) -> frozenset[int]:
    """Coordinates that lie at a limit and would go beyond it; not all of them."""
    lower, upper = problem.coordinates.limits()
    if not ((w <= lower) | (w >= upper)).any():
        return frozenset()
    ok, r, J = problem.evaluate(problem.coordinates.out(w))
    if not ok:
        return frozenset()
    slope = problem.coordinates.jacobian(J, w).T @ r
    resting = np.flatnonzero(((w <= lower) & (slope > 0.0)) | ((w >= upper) & (slope < 0.0)))
    return frozenset(resting.tolist()) if len(resting) < len(w) else frozenset()


def _ceres_holding(
    problem: FitProblem,
    w: np.ndarray,
    held: frozenset[int],
    max_iterations: int,
    tolerance: float,
    best: _Best,
    watch: bool,
    steps: GeometricSteps,
    first: int = 0,
) -> tuple[Minimum, np.ndarray | None]:
    """One run, whose iterations count on from `first`. It ends, and also returns that point, where its steps have a
    sum, and if it is to watch, where coordinates that are not held have been at a limit for two iterations."""
    from .. import _ceres as ceres

    coordinates = problem.coordinates
    lower, upper = coordinates.limits()
    interrupted = False
    before, stopped = np.zeros(len(w), dtype=bool), None

    def observe(iteration: int, cost: float, step: float, gradient: float, at: list[float]) -> bool:
        nonlocal before, stopped
        here = np.array(at)
        best(first + iteration, cost, coordinates.out(here))
        limited = (here <= lower) | (here >= upper)
        limited[list(held)] = False
        if steps.add(here) and not limited.any():
            stopped = here
        elif watch and iteration > 1 and (limited & before).any():
            stopped, steps.sum = here, None
        before = limited
        return stopped is None

    out: dict[str, Any] = {}
    try:
        out = ceres.minimize(
            evaluation=problem.evaluator.capsule(coordinates, problem.known_at(w)),
            u=w,
            lower=lower,
            upper=upper,
            longest_step=coordinates.longest,
            held=sorted(held),
            residual_seconds=problem.seconds.get(False, 0.0),
            max_iterations=max_iterations,
            tolerance=tolerance,
            observe=observe,
        )
    except KeyboardInterrupt:
        interrupted = True
    count(out.get("evaluations", 0), out.get("jacobians", 0))  # which do not come through the problem
    if interrupted or (out["stopped"] and stopped is None):
        left = Minimum(
            best.u,
            best.cost,
            out.get("iterations", 0),
            out.get("evaluations", 0),
            False,
            True,
            "interrupted: the best point so far",
            jacobians=out.get("jacobians", 0),
        )
        return left, None
    if not 0.0 <= out["cost"] < np.inf:  # Ceres tells a cost of -1 where its first point has no derivatives
        counts = out["iterations"], out["evaluations"]
        return Minimum(best.u, best.cost, *counts, False, False, out["message"], jacobians=out["jacobians"]), None
    end = coordinates.out(np.array(out["u"]))
    if "jacobian" in out and not coordinates.charts:
        problem.keep(end, out["residual"], out["jacobian"])
    found = Minimum(
        end,
        out["cost"],
        out["iterations"],
        out["evaluations"],
        out["converged"],
        False,
        out["message"],
        jacobians=out["jacobians"],
    )
    return found, stopped


def _scipy(problem: FitProblem, u: np.ndarray, max_iterations: int, tolerance: float, best: _Best) -> Minimum:
    optimize = require("scipy.optimize", "fit")
    coordinates = problem.coordinates
    bounds, limits, longest = coordinates.bounds(), coordinates.limits(), coordinates.longest
    last: dict[str, Any] = {"u": None}
    left: np.ndarray | None = None  # where the step began
    tried, before = 0, counted()

    def evaluated(at: np.ndarray, jacobian: bool) -> dict[str, Any]:
        nonlocal tried, left
        too_far = left is not None and bool((np.abs(at - left) > longest).any())
        if not jacobian and (too_far or (at < limits[0]).any() or (at > limits[1]).any()):
            return {"r": np.full(problem.core.rows, np.inf), "J": None}  # SciPy shortens its step
        if jacobian:
            left = at.copy()
        if last["u"] is None or not np.array_equal(last["u"], at) or (jacobian and last["J"] is None):
            tried += 1
            jacobian |= problem.cheap_jacobian  # most steps are taken, and then it is needed anyway
            ok, r, J = problem.evaluate(coordinates.out(at), jacobian)
            slopes = coordinates.jacobian(J, at) if jacobian and ok else None
            last.update(u=at.copy(), r=r if ok else np.full(problem.core.rows, np.inf), J=slopes)
            if ok:
                best(tried, 0.5 * float(r @ r), coordinates.out(at))
        return last

    try:
        out = optimize.least_squares(
            lambda at: evaluated(at, False)["r"],
            np.clip(coordinates.into(u), *limits),
            jac=lambda at: evaluated(at, True)["J"],
            bounds=bounds,
            x_scale="jac",
            ftol=max(tolerance, 1e-15),
            xtol=max(tolerance, 1e-15),
            gtol=max(tolerance, 1e-15),
            max_nfev=max_iterations,
        )
    except KeyboardInterrupt:
        made, words = counted(), "interrupted: the best point so far"
        counts = tried, made[0] - before[0]
        return Minimum(best.u, best.cost, *counts, False, True, words, jacobians=made[1] - before[1])
    made = counted()
    found = (
        coordinates.out(out.x),
        float(out.cost),
        int(out.njev),
        made[0] - before[0],
        out.status > 0,
        False,
        out.message,
    )
    return Minimum(*found, jacobians=made[1] - before[1])
