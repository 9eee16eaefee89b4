"""sheetbend.pesto beside a fit of sheetbend: the same minimum, and profiles with the same ends."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.experiment.wanted import as_parameters
from sheetbend.optional import MissingExtraError
from sheetbend.pesto import _Function, problem
from sheetbend.problem.problem import FitProblem

TIMES, SOLVER = np.arange(20) / 50, sb.Solver(h=0.005)
WANTED = {"rope_EI": {}, "rope_bend_damping": {"prior": (5e-3, 1.0)}}


def rope(EI: float, damping: float) -> sb.Scene:
    return sb.rope(0.5, 6, density=0.05, EI=EI, bend_damping=damping, clamp_start=(1, 0, 0))


def taken() -> sb.Experiment:
    """A rope that falls, with 1 mm of noise."""
    motion = sb.simulate(rope(2e-3, 0.01), TIMES, SOLVER).positions
    noisy = motion + 1e-3 * np.random.default_rng(1).standard_normal(motion.shape)
    return sb.Experiment(scene=rope(1e-3, 5e-3), recording=sb.Recording(noisy, TIMES), solver=SOLVER, sigma=1e-3)


def compiled(e: sb.Experiment) -> FitProblem:
    return FitProblem([e], as_parameters(WANTED, [e]))


def test_derivatives_are_those_of_differences() -> None:
    function = _Function(compiled(taken()))
    u, step = np.log([1.5e-3, 8e-3]), 1e-5
    for k in range(2):
        ahead, behind = (u + sign * step * np.eye(2)[k] for sign in (1, -1))
        assert function.gradient(u)[k] == approx((function.cost(ahead) - function.cost(behind)) / (2 * step), rel=1e-6)
        column = (function.residuals(ahead) - function.residuals(behind)) / (2 * step)
        assert function.jacobian(u)[:, k] == approx(column, rel=1e-4, abs=1e-5)
    J = function.jacobian(u)
    assert function.hessian(u) == approx(J.T @ J)
    assert function.cost(u) == approx(0.5 * np.sum(function.residuals(u) ** 2))


def test_a_point_is_evaluated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled_problem, made = compiled(taken()), list[bool]()
    evaluate = FitProblem.evaluate

    def counted(self: FitProblem, u: np.ndarray, jacobian: bool = True) -> Any:
        made.append(jacobian)
        return evaluate(self, u, jacobian)

    monkeypatch.setattr(FitProblem, "evaluate", counted)
    function, u = _Function(compiled_problem), np.log([1.5e-3, 8e-3])
    function.cost(u), function.residuals(u), function.gradient(u), function.hessian(u), function.cost(u)
    assert made == [False, True]


def test_where_a_motion_diverges_the_cost_is_infinite(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled_problem = compiled(taken())
    monkeypatch.setattr(
        FitProblem, "evaluate", lambda self, u, jacobian=True: (False, np.zeros(9), np.zeros((9 * jacobian, 2)))
    )
    function = _Function(compiled_problem)
    assert function.cost(np.zeros(2)) == math.inf
    assert np.isposinf(function.residuals(np.zeros(2))).all()
    assert np.isnan(function.gradient(np.zeros(2))).all()


def test_without_pypesto_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pypesto", None)
    with pytest.raises(MissingExtraError, match=r"sheetbend\[pesto\]"):
        problem(taken(), parameters=WANTED)


@pytest.mark.filterwarnings("ignore")
def test_pypesto_finds_the_minimum_and_the_profiles_of_a_fit() -> None:
    pypesto = pytest.importorskip("pypesto")
    optimize, profile = pytest.importorskip("pypesto.optimize"), pytest.importorskip("pypesto.profile")
    e = taken()
    fit = sb.fit(e, parameters=WANTED, refine=False)
    made = problem(e, parameters=WANTED)
    assert made.x_names == list(WANTED) and made.x_scales == ["log", "log"]
    found = optimize.minimize(
        made, optimize.ScipyOptimizer("ls_trf"), n_starts=4, progress_bar=False, filename=None, ids=list("abcd")
    )
    best = found.optimize_result[0]
    assert np.exp(best.x) == approx([fit.values[name] for name in WANTED], rel=1e-4)
    assert best.fval == approx(fit.result.cost, rel=1e-8)
    found = profile.parameter_profile(
        made, found, optimize.ScipyOptimizer("L-BFGS-B"), profile_index=[1], progress_bar=False, filename=None
    )
    path, ratio = found.profile_result.list[0][1], profile.chi2_quantile_to_ratio(0.95)
    lower, upper = profile.calculate_approximate_ci(path.x_path[1], path.ratio_path, ratio)
    low, high = fit["rope_bend_damping"].lower, fit["rope_bend_damping"].upper
    assert low is not None and high is not None
    # pyPESTO takes sigma at its word, and sheetbend the deviation that residuals have.
    residuals = 2.0 * fit.result.cost / (7 * 3 * 20 - 3 * 20 - 2)
    assert upper - lower == approx(math.log(high / low) / math.sqrt(residuals), rel=0.03)
    assert isinstance(made, pypesto.Problem)
