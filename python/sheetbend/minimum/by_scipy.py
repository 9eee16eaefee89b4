"""SciPy's trust region on a compiled problem, for installations without Ceres."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..optional import require
from ..problem.counts import counted
from ..problem.problem import FitProblem
from .progress import Best, Minimum


def search(problem: FitProblem, u: np.ndarray, max_iterations: int, tolerance: float, best: Best) -> Minimum:
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
