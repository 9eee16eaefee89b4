"""A parameter that stopped at a bound draws off the others: they are doubtful where the data ask for more."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

SOLVER = sb.Solver(h=1 / 400)


def rope() -> sb.Scene:
    return sb.rope(0.5, 6, density=0.05, EA=1e3, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0), drag_linear=5e-3)


def fitted(**drag: float) -> sb.FitResult:
    at = [2, 4, 6]
    clean = sb.simulate(rope(), np.arange(41) / 100, SOLVER)
    positions = clean.positions[:, at] + 1e-4 * np.random.default_rng(0).standard_normal((41, 3, 3))
    experiment = sb.Experiment(
        scene=rope(),
        recording=sb.Recording(positions=positions, times=clean.times, name="swing"),
        markers=[sb.on_particle(i) for i in at],
        solver=SOLVER,
        sigma=1e-4,
    )
    parameters = {"rope_EI": {"initial": 3e-3}, "rope_bend_damping": {}, "rope_drag_linear": drag}
    return sb.fit(experiment, parameters=parameters, refine=False)


@pytest.mark.parametrize("bound", ["lower", "upper"])
def test_what_a_bound_draws_off_is_doubtful_and_names_it(bound):
    """The damping takes up the drag that is too small or too large; it was identified beside a wrong number."""
    fit = fitted(**{bound: 1e-2 if bound == "lower" else 2e-3, "initial": 1.5e-2 if bound == "lower" else 1e-3})
    damping, drag = fit["rope_bend_damping"], fit["rope_drag_linear"]
    assert drag.verdict == "at a bound"
    assert abs(damping.value - 0.02) > damping.half_width
    assert damping.verdict == "doubtful"
    assert f"rope_drag_linear = {drag.value:g} N s/m^2 is its bound" in damping.words
    assert "rope_bend_damping" in fit.report().split("Warnings")[1]


def test_a_bound_that_noise_alone_comes_to_draws_nothing_off():
    fit = fitted(upper=4.99e-3, initial=3e-3)
    assert [e.verdict for e in fit.result.estimates if e.name != "rope_drag_linear"] == ["identified", "identified"]


def test_far_bounds_draw_nothing_off():
    fit = fitted(lower=1e-4, upper=1.0, initial=1e-2)
    assert {e.verdict for e in fit.result.estimates} == {"identified"}
