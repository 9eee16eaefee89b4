"""Starts that a fit estimates along with the parameters (`start = "estimated"`)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.arrays.smoothing import state_at
from sheetbend.config import load
from sheetbend.experiment.found_start import settled, started
from sheetbend.experiment.wanted import as_parameters
from sheetbend.fitting.fitted_motion import fitted_positions
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
LENGTH, LINKS, NOISE, SOLVER = 0.6, 20, 1e-3, sb.Solver(h=1 / 240)
TRUE = {"rope_EI": 1e-3, "rope_bend_damping": 0.02, "rope_drag_linear": 5e-3}
WANTED = {"rope_EI": {"initial": 2e-3}, "rope_bend_damping": {"initial": 0.04}, "rope_drag_linear": {"initial": 8e-3}}
SEEN, NAMES = (5, 10, 15, 20), ("a", "b", "c", "d")
BEGUN, FRAMES, RATE = 30, 61, 60


def rope(points: Array, velocity: Array | None = None) -> sb.Scene:
    scene = sb.Scene("rope")
    values = {name.removeprefix("rope_"): value for name, value in TRUE.items()}
    made = sb.add_rope(scene, points=points, velocity=velocity, length=LENGTH, segments=LINKS, density=0.05, **values)
    scene.pin(made.particles[:1])
    return scene


@cache
def swing() -> tuple[Array, Array]:
    """(frames,) s and (frames, particles, 3) m, of a rope that is let go near the horizontal."""
    times = np.arange(BEGUN + FRAMES) / RATE
    return times, sb.simulate(rope(np.array([[0, 0, 0], [0.54, 0, -0.26]])), times, SOLVER).positions


def shown(seed: int, straight: bool = False, **fields: object) -> sb.Experiment:
    """Four markers from the middle of the swing on. The scene starts smoothly through them, or straight and at rest."""
    times, x = swing()
    positions = x[:, SEEN] + NOISE * np.random.default_rng(seed).standard_normal((len(times), len(SEEN), 3))
    recording = sb.Recording(positions[BEGUN:], times[BEGUN:], markers=NAMES, name="rope")
    place, velocity = state_at(recording.times, recording.positions, times[BEGUN], 0.1)
    pivot = np.zeros((1, 3))
    if straight:
        scene = rope(np.concatenate([pivot, place[-1:]]))
    else:
        scene = rope(np.concatenate([pivot, place]), np.concatenate([pivot, velocity]))
    at = [sb.on_particle(int(scene.ropes["rope"].particles[i])) for i in SEEN]
    given = {"markers": at, "solver": SOLVER, "sigma": NOISE, "start": "estimated"}
    return sb.Experiment(scene=scene, recording=recording, **(given | fields))


def problem_of(e: sb.Experiment) -> tuple[FitProblem, Array]:
    problem = FitProblem([e], as_parameters(WANTED, [e]))
    return problem, problem.parameters.to_internal(TRUE)


def test_the_start_is_where_the_data_and_its_prior_balance() -> None:
    """Half of the squared residuals, of motions from starts moved by hand, falls as fast as the prior rises."""
    e = shown(0)
    problem, u = problem_of(e)
    ok, r, J = problem.evaluate_exactly(u)
    b = problem.starts(u)["rope"]
    assert ok and len(r) == problem.core.data_rows + len(b) and r[problem.core.data_rows :] == approx(b)

    def cost(numbers: Array) -> float:
        held, _ = problem_of(started(e, numbers))
        return held.cost(u)

    assert cost(b) + 0.5 * b @ b == approx(0.5 * r @ r, rel=1e-12)
    rng = np.random.default_rng(0)
    for way in rng.standard_normal((2, len(b))):
        ahead, behind = (cost(b + step * way) + 0.5 * np.sum((b + step * way) ** 2) for step in (1e-4, -1e-4))
        slope, curvature = (ahead - behind) / 2e-4, (ahead + behind - r @ r) / 1e-8
        assert curvature > 1e3 and abs(slope / curvature) < 1e-6  # of a deviation of the prior, to the minimum
    moved = [problem.cost(u + step) for step in (1e-4 * np.eye(3)[0], -1e-4 * np.eye(3)[0])]
    assert (moved[0] - moved[1]) / 2e-4 == approx((J.T @ r)[0], rel=1e-4)


def test_a_settled_start_holds_rigid_links_and_moves_nothing_else() -> None:
    e = shown(0)
    assert e.estimated_start is not None
    b = 0.2 * np.random.default_rng(1).standard_normal(e.estimated_start.count)
    at = started(e, b)
    links = np.linalg.norm(np.diff(at.scene.nodes, axis=0), axis=1)
    assert np.abs(links / (LENGTH / LINKS) - 1.0).max() > 0.01  # or the test shows nothing
    nodes = settled(at, {})
    assert np.linalg.norm(np.diff(nodes, axis=0), axis=1) == approx(LENGTH / LINKS, rel=1e-9)
    problem, u = problem_of(at)
    first = problem.simulate(u)[0]
    again = sb.simulate(at.scene, at.fitted().times - at.t0, SOLVER, start=nodes).positions[:, SEEN]
    assert again == approx(first, abs=1e-6)


def test_a_rope_is_fitted_from_the_middle_of_its_motion() -> None:
    """As a fit is made by default. Pictures show the motion that was compared."""
    fit = sb.fit(shown(0), parameters={"rope_EI": {"initial": 1.2e-3}, "rope_bend_damping": {"initial": 0.02}})
    for name in ("rope_EI", "rope_bend_damping"):
        found, value = fit[name], TRUE[name]
        assert found.lower < value < found.upper and found.value == approx(value, rel=0.1)
        assert found.verdict == "identified"
    row = fit.result.recordings[0]
    assert row.rms == approx(np.sqrt(3) * NOISE, rel=0.1)
    assert row.start_moved is not None and "its start is estimated" in fit.report()
    (c,) = fit.comparisons
    assert fitted_positions(fit, c)[:, SEEN] == approx(c.simulated, abs=1e-8)


def test_a_straight_start_at_rest_is_far_enough() -> None:
    problem, u = problem_of(shown(0, straight=True))
    ok, r, _ = problem.evaluate(u, jacobian=False)
    assert ok and np.mean(r[: problem.core.data_rows] ** 2) < 1.2
    held, _ = problem_of(shown(0, straight=True, start="given"))
    assert np.mean(held.evaluate(u, jacobian=False)[1] ** 2) > 1e4


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"static": True}, "start: cannot be estimated for an equilibrium"),
        ({"predict": "mean"}, "start: cannot be estimated for a recording that is only predicted"),
        ({"shooting": "auto"}, "shooting: does not go with"),
        ({"start": "some"}, "start: is unknown"),
    ],
)
def test_what_does_not_go_with_an_estimated_start_is_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(sb.InputError, match=words):
        shown(0, **fields)


def test_a_start_needs_frames_markers_and_plain_runs() -> None:
    e = shown(0)
    with pytest.raises(sb.InputError, match="cannot be estimated from fewer than 3 frames"):
        problem_of(replace(e, fit=(e.t0, e.t0 + 1.5 / RATE)))
    with pytest.raises(sb.InputError, match=r"start: does not go with runs that are extrapolated"):
        problem_of(replace(e, solver=replace(SOLVER, extrapolate=2)))
    rod = sb.rod(0.5, 8, density=0.05, EI=1e-3, GJ=1e-3)
    places = [sb.on_particle(k) for k in range(2, 2 + len(e.markers))]
    with pytest.raises(sb.InputError, match=r"without markers on ropes or cloths.*not a rod"):
        sb.fit(replace(e, scene=rod, markers=places), parameters=["rod_EI"])
    with pytest.raises(sb.InputError, match="start: is not estimated of many recordings"):
        sb.fit_many([replace(e, name=str(k)) for k in range(20)], WANTED)
    with pytest.raises(sb.InputError, match="from a motion with `start`"):
        sb.fit(e, parameters=WANTED, bootstrap=50)


CONFIG = """
[experiment]
name = "swing"

[solver]
substeps = 4

[[scene.rope]]
name = "rope"
length = 0.6
segments = 20
density = 0.05
EI = 1e-3
bend_damping = 0.02
drag_linear = 5e-3
points = "recording"
velocity = "recording"
pinned = [0]

[[recording]]
file = "rope.npz"
start = "estimated"

[parameters.rope_EI]
"""


def test_a_configuration_estimates_a_start(tmp_path: Path) -> None:
    recording = shown(0).recording
    pivot = np.zeros((FRAMES, 1, 3))
    whole = sb.Recording(
        np.concatenate([pivot, recording.positions], axis=1), recording.times, markers=("pivot", *NAMES), name="rope"
    )
    whole.save(tmp_path / "rope.npz")
    (tmp_path / "swing.toml").write_text(CONFIG)
    (e,) = load(tmp_path / "swing.toml").experiments
    problem, u = problem_of(e)
    ok, r, _ = problem.evaluate(u, jacobian=False)
    assert ok and np.mean(r[: problem.core.data_rows] ** 2) < 1.2
