"""The baseline for driven scenes: a shape that grips carry along is predicted without error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.experiment.carried import carried_baselines
from sheetbend.experiment.clock import lateness, outside, told_clocks
from sheetbend.fitting.fitted_motion import fitted_positions
from sheetbend.recording.baseline import baseline
from sheetbend.result.estimate import Estimate
from sheetbend.result.motions import RecordingFit

Array = np.ndarray
T = np.linspace(0.0, 1.0, 41)
LATE = 0.1  # s
NEAR = 1e-8  # m: what decides between rotations that fit equally well moves the others by 1e-9 of an angle


def turned(angle: np.ndarray, axis: tuple[float, float, float]) -> np.ndarray:
    """Rotation matrices (frames, 3, 3) about a unit axis (Rodrigues)."""
    k = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle)[:, None, None] * k.T + (1 - np.cos(angle))[:, None, None] * (k.T @ k.T)


def poses(axis: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """(frames, 3, 3) and (frames, 3) m."""
    return turned(1.2 * np.sin(3 * T), axis), np.stack([0.1 * np.sin(4 * T), 0.05 * T, 0.2 * T**2], axis=1)


def placed(x: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    return np.einsum("fij,pj->fpi", turn, x) + shift[:, None]


def held_cloth(rows: list[list[int]], motions: list[tuple[np.ndarray, np.ndarray]]) -> tuple[sb.Scene, np.ndarray]:
    """A cloth of 5 x 4 vertices whose sets of vertices follow rigid motions; also all vertices, (20, 3) m."""
    mesh = sb.mesh.grid(0.4, 0.3, 4, 3, pattern="one_way")
    scene = sb.Scene("held")
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=100, shear=10, bending=1e-4)
    x = scene.positions[cloth.particles]
    for row, motion in zip(rows, motions, strict=True):
        scene.drive(cloth.particles[row], T, placed(x[row], *motion))
    return scene, x


def experiment(scene: sb.Scene, x: np.ndarray, free: list[int]) -> sb.Experiment:
    recording = sb.Recording(x[:, free], T, markers=[f"v{i}" for i in free])
    places = [sb.on_particle(i) for i in free]
    return sb.Experiment(scene=scene, recording=recording, markers=places, fit=(0.0, 0.5), held_out=(0.5, 1.0))


def predicted(e: sb.Experiment) -> dict[str, np.ndarray]:
    held = e.held()
    assert held is not None
    return carried_baselines(e, [(e, e.fitted())], held)


def test_a_shape_on_one_grip_is_carried_exactly() -> None:
    motion = poses((0.6, 0.0, 0.8))
    scene, x = held_cloth([[0, 1, 2, 5]], [motion])
    e = experiment(scene, placed(x, *motion), [8, 13, 19])
    found = predicted(e)
    assert set(found) == {"carried", "carried shape"}
    for prediction in found.values():
        assert np.abs(prediction - e.held().positions).max() < NEAR  # type: ignore[union-attr]


def test_particles_on_a_line_turn_by_the_smallest_rotation() -> None:
    """The grip is a row along x that turns about y: nothing turns about the row itself."""
    motion = poses((0.0, 1.0, 0.0))
    scene, x = held_cloth([[0, 1, 2]], [motion])
    e = experiment(scene, placed(x, *motion), [8, 13])
    assert np.abs(predicted(e)["carried"] - e.held().positions).max() < 1e-6  # type: ignore[union-attr]


def test_one_particle_only_translates() -> None:
    turn, shift = poses((0.0, 0.0, 1.0))
    still = np.broadcast_to(np.eye(3), turn.shape)
    scene, x = held_cloth([[0]], [(still, shift)])
    e = experiment(scene, placed(x, still, shift), [8, 13])
    assert np.abs(predicted(e)["carried"] - e.held().positions).max() < 1e-12  # type: ignore[union-attr]


def test_two_grips_share_a_marker_by_nearness() -> None:
    """One corner stays, the other is lifted: the middle of the edge between them rises half as far."""
    still = np.broadcast_to(np.eye(3), (len(T), 3, 3))
    lift = np.stack([0 * T, 0 * T, 1e-5 * T], axis=1)
    scene, x = held_cloth([[0], [4]], [(still, 0 * lift), (still, lift)])
    e = experiment(scene, placed(x, still, 0 * lift), [2, 1])
    up = predicted(e)["carried"][..., 2] - x[0, 2]
    times = e.held().times  # type: ignore[union-attr]
    expected = (times - times[0])[:, None] * 1e-5 * np.array([0.5, 0.25])
    assert np.abs(up - expected).max() < 1e-12


def test_the_report_takes_the_harder_baseline() -> None:
    motion = poses((0.6, 0.0, 0.8))
    scene, x = held_cloth([[0, 1, 2, 5]], [motion])
    noise = np.random.default_rng(1).normal(size=(len(T), len(x), 3))
    e = experiment(scene, placed(x, *motion) + 1e-3 * noise, [8, 13, 19])
    held = e.held()
    assert held is not None
    alone = baseline([e.fitted()], held)
    found = baseline([e.fitted()], held, predicted(e))
    assert found.kind == "carried shape" and found.rms < 2.5e-3 < 0.05 < alone.rms
    assert found.words == "carried shape: the mean shape of the fitted data moves rigidly with the grips"
    assert {*alone.errors, "carried", "carried shape"} == set(found.errors)


def test_nothing_is_carried_where_nothing_moves() -> None:
    mesh = sb.mesh.grid(0.4, 0.3, 4, 3, pattern="one_way")
    scene = sb.Scene("pinned")
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=100, shear=10, bending=1e-4)
    scene.pin(cloth.particles[[0, 4]])
    x = np.broadcast_to(scene.positions, (len(T), 20, 3))
    assert predicted(experiment(scene, x, [8, 13])) == {}


@pytest.mark.parametrize("inside", [{}, {"yield_curvature": 3.0, "yield_share": 0.4}], ids=["elastic", "yields"])
def test_a_rope_held_by_one_grip_with_direction(inside: dict[str, float]) -> None:
    """The grip of a rod drives a node, a ghost and a director: place, direction and roll carry the shape. What has slid
    in its joints is held by pinned nodes, which are no grips."""
    turn, shift = poses((0.0, 0.6, 0.8))
    grip = sb.Grip(T, shift, turn[:, :, 0], turn[:, :, 2])
    scene = sb.rod(0.4, 8, density=0.05, EI=1e-3, GJ=1e-3, start=grip, **inside)
    nodes = scene.ropes["rod"].particles
    x = np.zeros((len(T), scene.particle_count, 3))
    x[:, nodes] = placed(scene.positions[nodes] - scene.positions[nodes[0]], turn, shift)
    e = experiment(scene, x, [int(nodes[3]), int(nodes[8])])
    assert np.abs(predicted(e)["carried"] - e.held().positions).max() < NEAR  # type: ignore[union-attr]


def late_cloth(clock: float = 0.0) -> tuple[sb.Experiment, Array]:
    """A shape carried by a tool, seen by a camera that is 0.1 s late in a frame turned by 0.05 rad; the scene takes
    the clock for right, or knows it. Also the truth in the held-out part."""
    half = 0.6 * np.sin(3 * T)
    quaternions = np.stack([0 * T, np.sin(half), 0 * T, np.cos(half)], axis=1)
    tool = sb.Tool(T, 0.1 * np.stack([np.sin(4 * T), T, T**2], axis=1), quaternions, sb.HandEye("robot"))
    mesh = sb.mesh.grid(0.4, 0.3, 4, 3, pattern="one_way")
    scene = sb.Scene("held")
    x = tool.placed(mesh.vertices)
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=100, shear=10, bending=1e-4, positions=x)
    top = mesh.sets["top"]
    tool.drive(scene, cloth.particles[top], mesh.vertices[top])
    scene.add_quantity("clock", clock, "s", positive=False)
    free = [0, 3, 7]
    seen = tool.frame.corrected(tool.path(mesh.vertices[free]), {"robot_turn_x": 0.05})
    recording = sb.Recording(seen, T + LATE)
    places = [sb.on_particle(i) for i in free]
    e = sb.Experiment(
        scene=scene,
        recording=recording,
        markers=places,
        fit=(LATE, 0.5),
        held_out=(0.5, 1.12),
        start_time=0.0,
        time_offset="clock",
        solver=sb.Solver(h=1 / 50, method="newton"),
    )
    return e, seen[recording.times >= 0.5]


def test_the_baseline_knows_the_fitted_clock_and_frame() -> None:
    """Otherwise it is weak only because it looks at the grip at the wrong time."""
    e, truth = late_cloth()
    held = e.held()
    assert held is not None
    fitted = {e.name: {"clock": -LATE, "robot_turn_x": 0.05}}
    found = carried_baselines(e, [(e, e.fitted())], held, fitted)
    assert np.abs(found["carried shape"] - truth).max() < 1e-6
    uncorrected = carried_baselines(e, [(e, e.fitted())], held)
    assert np.abs(uncorrected["carried shape"] - truth).max() > 0.01


def test_every_report_of_a_driven_scene_shows_the_predictions_without_physics() -> None:
    """Beside "stays at its mean", with the harder one marked; on the fitted part where nothing is held out."""
    e, _ = late_cloth(-LATE)
    for one, part in ((e, "held out"), (replace(e, held_out=None), "fitted")):
        result = sb.fit(one, parameters=["robot_turn_x"], refine=False).result
        report, (row,) = result.report(), result.recordings
        assert set(row.without_physics) == {"rest", "hold", "carried", "carried shape"}
        best = min(row.without_physics, key=lambda kind: row.without_physics[kind])
        assert best.startswith("carried") and row.without_physics[best] < 0.2 * row.without_physics["rest"]
        (line,) = [text for text in report.splitlines() if part in text and "*" in text]
        assert f"{1e3 * row.without_physics[best]:.3g} *" in line
        assert sb.FitResult.from_dict(result.to_dict()) == result
        assert "its clock is 0.1 s late" in report
        if one is e:
            assert row.baseline == pytest.approx(row.without_physics[best], rel=1e-9)


def test_the_sign_of_a_clock_is_said_in_words() -> None:
    e, _ = late_cloth(-LATE)
    row = RecordingFit(name="seen", rows=1)
    told = "its clock is 0.100 +/- 0.020 s late: a frame stamped 1 s shows what happened at 0.9 s"
    (known,) = told_clocks([row], [e], {"clock": -0.1}, [estimate("clock", -0.1, 0.02)])
    assert (known.late, known.late_half_width) == (0.1, 0.02) and lateness(known) == told
    own = {"clock": -0.3, f"clock[{e.name}]": -0.1}
    (private,) = told_clocks([row], [e], own, [estimate(f"clock[{e.name}]", -0.1, 0.02)])
    assert lateness(private) == told
    early = replace(row, late=-0.2)
    assert lateness(early) == "its clock is 0.2 s early: a frame stamped 1 s shows what happened at 1.2 s"
    assert lateness(row) == ""


def estimate(name: str, value: float, half: float) -> Estimate:
    ends = {"lower": value - half, "upper": value + half, "half_width": half, "statistical": half}
    return Estimate(name=name, value=value, unit="s", discretization=0.0, verdict="identified", words="", **ends)


def test_frames_outside_of_the_motion_are_told() -> None:
    e, _ = late_cloth(-0.3)
    (words,) = outside([e], {})
    assert "0.2 s before the scene starts" in words and "start_time" in words
    assert list(outside([e], {"clock": -LATE})) == []
    (words,) = outside([e], {"clock": 0.2})
    assert "0.2 s behind the end" in words


def test_a_drawn_cloth_is_at_the_shifted_time() -> None:
    """Figures once showed measured markers beside a cloth at the camera's time instead of the scene's."""
    e, _ = late_cloth(-LATE)
    found = sb.fit(e, parameters=["robot_turn_x"], refine=False)
    (c,) = found.comparisons
    frame = len(c.recording.times) // 2
    (positions,) = fitted_positions(found, c, [frame])
    drawn = positions[[place.particles[0] for place in e.compared_places]]
    assert np.abs(drawn - c.simulated[frame]).max() < 0.02  # half a substep; at the camera's time it is 0.3
    assert e.scene_times(np.array([0.5]), {}) == pytest.approx([0.4])
    assert e.scene_times(np.array([0.5]), {"clock": 0.1}) == pytest.approx([0.6])
