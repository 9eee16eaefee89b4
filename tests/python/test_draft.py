"""What a draft changes of a motion whose air was taken to stand still."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.given import premises
from sheetbend.doubts.told import Told, told_numbers
from sheetbend.doubts.told_words import words_of
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.optimizers import minimize
from sheetbend.problem.problem import FitProblem

SOLVER, TIMES = sb.Solver(h=1 / 400), np.arange(31) / 100
DRAFT = np.array([2e-3, -1e-3, 3e-3])  # m/s


def thrown(wind: np.ndarray, **options: Any) -> sb.Scene:
    """A free rope in air that moves at `wind`, seen by who moves along with the air."""
    scene, line = sb.Scene("rope"), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
    start = np.array([[0.0, 0.4, 1.0], [0.2, -0.3, 0.6]]) - wind
    sb.add_rope(scene, "rope", points=line, segments=6, density=0.05, EI=1e-4, velocity=start, **options)
    return scene


def problem_of(scene: sb.Scene, measured: np.ndarray, *names: str) -> FitProblem:
    particles = scene.ropes["rope"].particles.tolist()
    recording = sb.Recording(positions=measured, times=TIMES, name="thrown")
    places = [sb.on_particle(p) for p in particles]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=1e-3)
    return FitProblem([e], as_parameters(names or ["rope_EI"], [e]))


def drafts_of(problem: FitProblem) -> list[Told]:
    told, why = told_numbers(problem, problem.parameters.initial())
    assert not why
    return [one for one in told if one.name == "draft"]


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize(
    "drags", [{"drag_linear": 0.03}, {"drag_quadratic": 0.05}, {"drag_linear": 0.02, "drag_quadratic": 0.03}]
)
def test_a_draft_moves_markers_as_seen_by_who_moves_along_with_the_air(drags: dict[str, float], loaded: bool) -> None:
    """The motion in moving air is the one in still air that begins at the velocity in that air, carried along. Forces
    that the scene has already stay."""

    def blown(wind: np.ndarray) -> sb.Scene:
        scene = thrown(wind, **drags)
        if loaded:
            knots = np.linspace(0.0, 0.3, 31)
            scene.add_force([2], np.cos(20 * knots)[:, None, None] * [0.0, 2e-3, 1e-3], knots)
        return scene

    still = problem_of(blown(np.zeros(3)), np.zeros((31, 7, 3)))
    u, columns = still.parameters.initial(), drafts_of(still)
    assert [one.label for one in columns] == [f"draft along {axis}" for axis in "xyz"]
    assert words_of(columns[0], -0.3, still, [0]) == "the air moved at 0.3 m/s along -x"
    _, r, _ = still.evaluate(u, jacobian=False)
    _, there, _ = problem_of(blown(DRAFT), np.zeros((31, 7, 3))).evaluate(u, jacobian=False)
    carried = np.broadcast_to(TIMES[:, None, None] * DRAFT / 1e-3, (31, 7, 3)).ravel()
    change = sum(w * one.column for w, one in zip(DRAFT, columns, strict=True))
    expected = there + carried - r
    assert np.linalg.norm(change - expected) < 0.02 * np.linalg.norm(expected)


def test_nothing_feels_a_draft_without_drag_or_beside_a_wind() -> None:
    assert drafts_of(problem_of(thrown(np.zeros(3)), np.zeros((31, 7, 3)))) == []
    scene = thrown(np.zeros(3), drag_linear=0.03)
    scene.add_air([[0, 1, 2]], 0.6, 0.0, wind=(1.0, 0.0, 0.0))
    assert drafts_of(problem_of(scene, np.zeros((31, 7, 3)))) == []


@pytest.mark.parametrize("knots", [3, 60])
def test_a_wind_over_time_is_told_as_it_is(knots: int) -> None:
    """Of many knots there is one quantity, `wind_strength`, whose change moves markers as it does in a simulation."""

    def blown(strength: float) -> FitProblem:
        scene, t = thrown(np.zeros(3), drag_linear=0.03), np.linspace(0.0, 0.3, knots)
        scene.set_wind(strength * np.column_stack([np.cos(9 * t), np.sin(7 * t), t]), t)
        return problem_of(scene, np.zeros((31, 7, 3)))

    u = blown(1.0).parameters.initial()
    told, why = told_numbers(blown(1.0), u)
    assert not why and not any(one.name in ("draft", "clamp_direction") for one in told)
    (found,) = (one for one in told if one.name == "wind_strength")
    ends = [blown(1.0 + d).evaluate(u, jacobian=False)[1] for d in (1e-4, -1e-4)]
    assert found.column == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-5, abs=1e-6)


def test_drag_rests_on_still_air_as_much_as_a_fit_to_moving_air_says() -> None:
    def found(wind: float) -> tuple[FitProblem, np.ndarray]:
        blown = np.array([0.0, 0.0, wind])
        x = sb.simulate(thrown(blown, drag_linear=0.03), TIMES, SOLVER).positions + TIMES[:, None, None] * blown
        problem = problem_of(thrown(np.zeros(3), drag_linear=0.03), x, "rope_drag_linear")
        return problem, minimize(problem, problem.parameters.initial())[0].u

    problem, u = found(0.0)
    (along,) = (p for p in premises(problem, u, {"draft": 0.1}, told_numbers(problem, u)[0]) if p.name.endswith("z"))
    assert along.words == "0.2 m/s" and along.sd == 0.1 and along.off_by == 0.2
    exact = premises(problem, u, {"draft": 0.0}, told_numbers(problem, u)[0])
    assert exact and not any(p.name.startswith("draft") for p in exact)
    moved = 0.03 * np.expm1(found(0.02)[1][0] - u[0])
    assert moved == pytest.approx(-0.1 * along.moved["rope_drag_linear"], rel=0.03)
