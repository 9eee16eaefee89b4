"""Levenberg-Marquardt on a compiled problem: Ceres where it was built in, SciPy's trust region otherwise. Both see the
same function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InputError, SheetbendError
from ..problem.problem import FitProblem
from . import by_ceres, by_scipy
from .approach import Approach
from .by_ceres import ceres_trouble, has_ceres
from .progress import Best, Minimum, Observer, Progress

OPTIMIZERS = ("auto", "ceres", "scipy")
WALK, WALK_PROMISE = 20, 1e-3  # steps before a search at most, and of the cost what a step must promise to go on


def walked(problem: FitProblem, u: np.ndarray, observe: Observer | None) -> np.ndarray:
    """(free,) where a walk from u ends that leaves the last steps to a search."""
    walk = Approach(problem, u)
    while walk.iterations < WALK and walk.step():
        if observe is not None:
            observe(Progress(walk.iterations, walk.cost, walk.u.copy()))
        if walk.promised < WALK_PROMISE:
            break
    return walk.u


def named(optimizer: str) -> str:
    """The optimizer that a name stands for.

    Raises:
        InputError: unknown, or Ceres asked for and not built.
    """
    if not isinstance(optimizer, str) or optimizer not in OPTIMIZERS:
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
    search = by_ceres.search if name == "ceres" else by_scipy.search
    end = search(problem, np.array(u, dtype=float), max_iterations, tolerance, Best(observe, u, first))
    return replace(end, first=first), name


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
