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


def test_a_limit_of_the_scene_says_what_to_change():
    """No configuration can widen it: the links of a lead stretch by no more."""
    times = np.arange(26) / 50

    def hanging(lead: float) -> sb.Scene:
        """The first marker, as given, is 0.1 m below the hand's place."""
        down, segments = np.tile([0, 0, -1.0], (26, 1)), round((0.5 + lead) / 0.05)
        place = np.stack([0.05 * np.sin(5 * times), 0 * times, 0.03 * np.sin(3 * times) - 0.1 + lead], axis=1)
        hand = sb.Grip(times, place, down, np.tile([1.0, 0, 0], (26, 1)))
        scene, points = sb.Scene("hanging"), np.array([place[0], [0, 0, -0.6]])
        sb.add_rope(scene, segments=segments, points=points, density=0.05, EI=1e-3, grip_start=hand, start_lead=lead)
        return scene

    true = sb.simulate(hanging(0.1), times, SOLVER, {"rope_start_lead": 0.05})
    guess = hanging(0.05)
    experiment = sb.Experiment(
        scene=guess,
        recording=sb.Recording(positions=true.positions[:, [4, 8, 12]], times=times, name="swing"),
        markers=[sb.on_particle(i) for i in (3, 7, 11)],
        solver=SOLVER,
        sigma=1e-4,
    )
    fit = sb.fit(experiment, parameters=["rope_start_lead"], refine=False, profiles=False)
    words = fit["rope_start_lead"].words
    assert fit["rope_start_lead"].verdict == "at a bound"
    assert (
        "give the grip another `lead`" in words
        and "a lead of 0.05 m changes by no more" in words
        and "widen" not in words
    )
