"""Intervals from data that are drawn at random, with replacement."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from scipy.optimize import least_squares
from sheetbend.doubts.bootstrap import _drawn, _parts, bootstrap, check_bootstrap, wider
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

SIGMA = 1e-3
TIMES = np.arange(160) / 160
SOLVER = sb.Solver(h=1 / 320)
NAMES = ["rope_EI", "rope_drag_linear"]
PLAIN: dict[str, Any] = {"refine": False, "beginnings": False, "profiles": False}


def rope(EI: float = 1e-3) -> sb.Scene:
    return sb.rope(0.6, 12, density=0.05, EI=EI, bend_damping=3e-3, drag_linear=1e-2, clamp_start=(1, 0, 0))


def fallen(seed: int, EI: float = 1e-3, frames: int = 160, correlation: float = 0.0) -> sb.Experiment:
    """A falling rope seen by five markers with noise."""
    scene = rope(EI)
    line = scene.ropes["rope"].particles
    at = [int(line[k]) for k in (3, 5, 8, 10, 12)]
    places = [sb.on_particle(p) for p in at]
    x = sb.simulate(scene, TIMES[:frames], SOLVER).positions[:, at]
    noise = np.random.default_rng(seed).standard_normal(x.shape)
    for k in range(1, frames):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    seen = sb.Recording(positions=x + SIGMA * noise, times=TIMES[:frames], name=f"fall {seed}")
    return sb.Experiment(scene=rope(), recording=seen, solver=SOLVER, markers=places, sigma=SIGMA, name=f"fall {seed}")


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_intervals_of_noise_are_those_of_residuals(correlation: float) -> None:
    """Where residuals are noise, white or not, the bootstrap over stretches of one recording agrees with them."""
    ratios = []
    for seed in range(3):
        fit = sb.fit(fallen(seed, correlation=correlation), parameters=NAMES, bootstrap=100, **PLAIN)
        found = fit.result.bootstrap
        assert found is not None and found.lost == 0 and "stretches of" in found.drawn
        for one in found.intervals:
            assert one.lower < fit[one.name].value < one.upper
            ratios.append(0.5 * (one.upper - one.lower) / (fit[one.name].statistical or 0.0))
        assert not any("bootstrap" in w for w in fit.result.warnings)
    assert 0.8 < np.mean(ratios) < 1.2


def test_recordings_that_differ_are_drawn_whole() -> None:
    """Ten ropes whose EI scatters by 10 %: the bootstrap knows their mean to that over the root of ten. Their drag is
    one and the same. Intervals from residuals take what is left for slow noise of both."""
    scatter = np.random.default_rng(3).standard_normal(10)
    ropes = [fallen(k, EI=1e-3 * (1 + 0.1 * s), frames=80) for k, s in enumerate(scatter)]
    fit = sb.fit(ropes, parameters=NAMES, bootstrap=100, **PLAIN)
    found = fit.result.bootstrap
    assert found is not None and found.drawn == "10 recordings"
    half = {one.name: 0.5 * (one.upper - one.lower) for one in found.intervals}
    expected = 1.96 * 1e-4 / np.sqrt(10)
    assert 0.5 * expected < half["rope_EI"] < 1.5 * expected
    assert half["rope_drag_linear"] < 0.2 * (fit["rope_drag_linear"].statistical or 0.0)
    report = fit.report()
    assert "Bootstrap" in report and "100 fits to 10 recordings, drawn with replacement" in report


def test_wider_intervals_are_told() -> None:
    fit = sb.fit(fallen(0), parameters=NAMES, bootstrap=50, **PLAIN)
    found = fit.result.bootstrap
    assert found is not None and wider(found, fit.result.estimates) == ()
    EI = found.intervals[0]
    wide = replace(EI, lower=EI.lower - 1.5 * (EI.upper - EI.lower))
    (words,) = wider(replace(found, intervals=(wide, *found.intervals[1:])), fit.result.estimates)
    assert found.drawn in words
    assert "times of rope_EI" in words and "rope_drag" not in words


def test_each_draw_is_a_fit_to_its_data() -> None:
    """A draw against SciPy's minimum of the same weighted residuals."""
    problem = FitProblem([fallen(0)], as_parameters(NAMES, [fallen(0)]))
    u = least_squares(lambda v: problem.evaluate(v)[1], problem.parameters.initial(), xtol=1e-12).x
    _, r, J = problem.evaluate(u)
    parts = _parts(problem, 1.0)
    errors = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    for number in range(3):
        weight = np.sqrt(parts.weights(np.random.default_rng([0, number])))
        assert 0.0 in weight and weight @ weight == pytest.approx(len(r), rel=0.3)
        found = _drawn((problem, u, r, J, parts), number)
        assert found is not None
        exact = least_squares(lambda v, w=weight: w * problem.evaluate(v)[1], u, xtol=1e-12, x_scale=errors).x
        assert np.abs(exact - u).max() > 0.2 * errors.max()
        np.testing.assert_array_less(np.abs(found - exact) / errors, 0.1)


def test_workers_give_the_same_bits(tmp_path: Path) -> None:
    fit = sb.fit(fallen(0), parameters=NAMES, bootstrap=50, **PLAIN)
    with ProcessPoolExecutor(2) as pool:
        shared = sb.fit(fallen(0), parameters=NAMES, bootstrap=50, executor=pool, **PLAIN)
    assert fit.result.bootstrap == shared.result.bootstrap
    fit.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json").bootstrap == fit.result.bootstrap


def test_intervals_move_with_the_estimates() -> None:
    """To the limit of short substeps."""
    long = replace(fallen(0), solver=sb.Solver(h=1 / 160))
    fit = sb.fit(long, parameters=NAMES, bootstrap=50, beginnings=False, profiles=False)
    found = fit.result.bootstrap
    assert found is not None
    assert any(e.moved != 0 for e in fit.result.estimates)
    for one in found.intervals:
        assert one.lower < fit[one.name].value < one.upper


def test_what_cannot_be_drawn_is_refused() -> None:
    with pytest.raises(sb.InputError, match=r"bootstrap.*at least 50"):
        sb.fit(fallen(0), parameters=NAMES, bootstrap=10, **PLAIN)
    hand = SimpleNamespace(name="hand", driven_sigma="estimate", shooting=None, start="given")
    with pytest.raises(sb.InputError, match=r"bootstrap.*`driven_sigma` of 'hand'"):
        check_bootstrap(50, SimpleNamespace(experiments=[hand]))  # type: ignore[arg-type]


def test_few_stretches_are_no_data_to_draw_from() -> None:
    problem = FitProblem([fallen(0)], as_parameters(NAMES, [fallen(0)]))
    found, why = bootstrap(problem, problem.parameters.initial(), 50, 8.0)
    assert found is None and "5 stretches of 0.2 s, and 8 are needed" in why
