"""A fit as a problem of pyPESTO, for its optimizers, profiles and samplers.

`sheetbend.fit` does not need it. Use it to compare with another optimizer, or to draw samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from .arrays.types import Array
from .errors import InputError, SheetbendError
from .experiment.experiment import Experiment
from .experiment.wanted import ParameterLike, as_parameters
from .fitting.experiments import experiments_of
from .minimum.continuity import joined
from .minimum.starts import drawn
from .optional import require
from .problem.problem import FitProblem
from .quantities.parameters import Parameter, Parameters
from .recording.recording import Recording
from .scene.scene import Scene

FAR = 1e3  # a factor, or natural scales: bounds about the initial value of a parameter that has none


def problem(
    scene: Scene | Experiment | Sequence[Experiment],
    recording: Recording | None = None,
    parameters: Mapping[str, ParameterLike] | Iterable[str | Parameter] = (),
    *,
    threads: int = 1,
    **experiment: Any,
) -> Any:
    """Return the least-squares problem of `sheetbend.fit` as a `pypesto.Problem`.

    The objective is half the sum of squared residuals, those of priors included. It has an exact gradient, the
    Gauss-Newton matrix J'J as its Hessian, and residuals with their exact Jacobian. Where a simulation diverges, the
    objective is infinite.

    Coordinates are those of the fit: the natural logarithm of parameters with `log`, which pyPESTO is told as their
    scale. pyPESTO needs finite bounds, so a parameter without a bound gets one: a factor of 1,000 from its initial
    value, or 1,000 times its natural scale. The first start is the initial value; the others are those of
    `sb.fit(starts=...)`.

    pyPESTO takes residuals as independent. Intervals from its profiles and samples do not contain their
    autocorrelation, nor the errors of time step, mesh and given values. `sb.fit` counts all of these.

    Args:
        scene, recording, parameters, threads, experiment: as for `sheetbend.fit`.

    Raises:
        InputError: anything inconsistent.
        SheetbendError: the initial values have no answer.
        MissingExtraError: pyPESTO is not installed.
    """
    pypesto = require("pypesto", "pesto")
    experiments = experiments_of(scene, recording, experiment)
    if over_time := [e.name for e in experiments if e.scene.over_time]:
        raise InputError("scene", "has unknown inputs over time", over_time[:5], "use sheetbend.fit")
    wanted = as_parameters(parameters, experiments)
    experiments, expanded, stopped = joined(experiments, wanted, threads)
    if stopped:
        raise KeyboardInterrupt
    fitted = [e for e in experiments if e.predict is None]
    found = FitProblem(fitted, wanted, threads=threads, expanded=expanded)
    found.check_start()
    function = _Function(found)
    if not math.isfinite(function.cost(found.parameters.initial())):
        raise SheetbendError(f"the fit cannot start: {found.failure}")
    objective = pypesto.Objective(
        fun=function.cost,
        grad=function.gradient,
        hess=function.hessian,
        res=function.residuals,
        sres=function.jacobian,
        x_names=list(found.parameters.free),
    )
    lower, upper = _bounds(found.parameters)
    return pypesto.Problem(
        objective,
        lower,
        upper,
        x_guesses=[found.parameters.initial()],
        x_scales=["log" if found.parameters[name].log else "lin" for name in found.parameters.free],
        copy_objective=False,
        startpoint_method=partial(_starts, found.parameters),
    )


class _Function:
    """What pyPESTO asks for one after the other at the same point, which is evaluated once."""

    def __init__(self, problem: FitProblem) -> None:
        self._problem = problem
        self._last: tuple[Array, tuple[bool, Array, Array]] | None = None

    def _at(self, u: Array, jacobian: bool) -> tuple[bool, Array, Array]:
        u = np.asarray(u, dtype=float)
        if self._last is None or not np.array_equal(self._last[0], u) or (jacobian and not len(self._last[1][2])):
            self._last = u.copy(), self._problem.evaluate(u, jacobian)
        return self._last[1]

    def residuals(self, u: Array) -> Array:
        ok, r, _ = self._at(u, False)
        return r if ok else np.full(len(r), np.inf)

    def jacobian(self, u: Array) -> Array:
        ok, _, J = self._at(u, True)
        return J if ok else np.full(J.shape, np.nan)

    def cost(self, u: Array) -> float:
        ok, r, _ = self._at(u, False)
        return 0.5 * float(r @ r) if ok else math.inf

    def gradient(self, u: Array) -> Array:
        J = self.jacobian(u)
        return np.asarray(J.T @ self._at(u, True)[1])

    def hessian(self, u: Array) -> Array:
        J = self.jacobian(u)
        return np.asarray(J.T @ J)


def _starts(parameters: Parameters, n_starts: int, lb: Array, ub: Array, **_: Any) -> Array:
    """(n_starts, free) those of `sheetbend.fit`, without the initial values, which are a guess of the problem."""
    return np.clip(drawn(parameters, n_starts + 1)[1:], lb, ub)


def _bounds(parameters: Parameters) -> tuple[Array, Array]:
    """(free,) each, finite."""
    start, (lower, upper) = parameters.initial(), parameters.bounds()
    free = [parameters[name] for name in parameters.free]
    far = np.array([math.log(FAR) if p.log else FAR * (p.scale or abs(p.initial or 0.0) or 1.0) for p in free])
    return np.where(np.isfinite(lower), lower, start - far), np.where(np.isfinite(upper), upper, start + far)
