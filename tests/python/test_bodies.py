"""Rigid bodies: motion against oracles, gradients, the frames of users, drag, held bodies, markers."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.arrays.rotations import quaternions_of, rotation_matrix
from sheetbend.quantities.expression import numbers, rotation

TURN = np.array([0.3, -0.5, 0.8])
MATRIX = np.array([[2e-3, 1e-4, 0.0], [1e-4, 3e-3, 2e-4], [0.0, 2e-4, 4e-3]])
CENTER = np.array([0.01, 0.02, -0.01])


def tossed(gravity: float = 9.81, **changes: object) -> tuple[sb.Scene, sb.Body]:
    scene = sb.Scene("toss", gravity=(0.0, 0.0, -gravity))
    given: dict[str, object] = {"mass": 0.4, "inertia": MATRIX, "center": CENTER, "at": (1.0, 2.0, 3.0)}
    given |= {"rotation": TURN, "velocity": (0.1, 0.2, 0.3), "spin": (1.0, 5.0, -2.0)}
    return scene, scene.add_body("box", **{**given, **changes})  # type: ignore[arg-type]


def test_free_box_turns_over_as_the_oracle_says_with_second_order() -> None:
    wanted = [
        (0.6748674, 0.0021918, -0.7379358),
        (0.0075491, -0.9999638, 0.0039339),
        (-0.7379004, -0.0082256, -0.6748595),
    ]
    errors = []
    for rate in (240, 480):
        scene = sb.Scene("box", gravity=(0.0, 0.0, 0.0))
        box = scene.add_body(of=sb.Inertia.box(1.0, (0.1, 0.2, 0.3)), spin=(1e-3, 5.0, 1e-3))
        motion = sb.simulate(scene, [0.0, 6.0], sb.Solver(h=1 / rate))
        frame = box.pose(motion)[1][-1]
        errors.append(abs(frame - wanted).max())
        assert abs(frame.T @ frame - np.eye(3)).max() < 1e-14
    assert errors[0] < 1.7e-2
    assert errors[1] < 4.1e-3
    assert 3.8 < errors[0] / errors[1] < 4.5


def test_kept_spin_turns_the_box_as_a_finer_substep_would(tmp_path: Path) -> None:
    scene = sb.Scene("box", gravity=(0.0, 0.0, 0.0))
    given = {"of": sb.Inertia.box(1.0, (0.1, 0.2, 0.3)), "spin": (1e-3, 5.0, 1e-3)}
    box = scene.add_body(**given, keep_spin=True)  # type: ignore[arg-type]
    motion = sb.simulate(scene, [0.0, 6.0], sb.Solver(h=1 / 240))
    assert abs(box.pose(motion)[1][-1][0] - [0.6748674, 0.0021918, -0.7379358]).max() < 3.3e-3
    spin = np.linalg.norm(box.angular_momentum(motion), axis=1)
    assert spin[1] == pytest.approx(spin[0], rel=1e-9)
    sb.save_scene(scene, tmp_path / "box.sheetbend")
    again = sb.simulate(sb.load_scene(tmp_path / "box.sheetbend"), [0.0, 6.0], sb.Solver(h=1 / 240))
    assert (again.positions == motion.positions).all()


def test_center_of_mass_falls_and_momenta_are_kept() -> None:
    scene, box = tossed()
    motion = sb.simulate(scene, np.linspace(0.0, 0.2, 5), sb.Solver(h=1e-3))
    origin, frame = box.pose(motion)
    center = origin + frame @ CENTER
    first = np.array([0.1, 0.2, 0.3]) + np.cross([1.0, 5.0, -2.0], rotation_matrix("", TURN) @ CENTER)
    t = motion.times[:, None]
    fall = center[0] + t * first + 0.5 * t**2 * [0.0, 0.0, -9.81]
    assert abs(center - fall).max() < 1.1e-5  # the first substep is of first order: h^2 g/2 and its rate
    assert np.allclose(origin[0], [1.0, 2.0, 3.0], atol=1e-14)
    assert np.allclose(frame[0], rotation_matrix("", TURN), atol=1e-14)
    assert np.allclose(box.angular_velocity(motion)[0], [1.0, 5.0, -2.0], atol=1e-13)
    spin = box.angular_momentum(motion)
    assert np.allclose(spin[0], frame[0] @ MATRIX @ frame[0].T @ [1.0, 5.0, -2.0], rtol=1e-12)
    assert abs(spin - spin[0]).max() < 3e-5 * np.linalg.norm(spin[0])  # (|w| h)^2, of the first substep
    assert np.allclose(box.energy(motion), box.energy(motion)[0], rtol=2e-4)
    assert np.allclose(box.momentum(motion)[0], 0.4 * first, rtol=1e-12)


def test_all_quantities_have_exact_gradients() -> None:
    scene, _ = tossed(drag=0.02, turn_drag=1e-3)
    report = sb.check_gradients(scene, [0.01, 0.03], samples=1)
    assert report.passed, str(report)
    assert {f"box_{q}" for q in ("mass", "center_z", "inertia_3", "axes_turn_y", "spin_x", "drag", "turn_drag")} <= set(
        scene.quantities
    )


def test_body_moves_alike_whatever_frame_its_user_chose() -> None:
    """The same body in a frame elsewhere on it, turned, and with the principal axes found from a full matrix."""
    solver, times, shift = sb.Solver(h=1e-3), [0.0, 0.05, 0.1], np.array([0.03, -0.02, 0.05])
    scene, box = tossed()
    motion = sb.simulate(scene, times, solver)
    origin, frame = box.pose(motion)
    other = rotation_matrix("", [-1.0, 0.4, 2.0])
    first, spin = frame[0], np.array([1.0, 5.0, -2.0])
    inertia = sb.Inertia(0.4, MATRIX, CENTER).moved(-other.T @ shift, other.T)
    again, second = tossed(
        mass=None,
        inertia=None,
        of=inertia,
        center=(0.0, 0.0, 0.0),
        at=origin[0] + first @ shift,
        rotation=first @ other,
        velocity=np.array([0.1, 0.2, 0.3]) + np.cross(spin, first @ shift),
    )
    moved, turned = second.pose(sb.simulate(again, times, solver))
    assert np.allclose(moved, origin + frame @ shift, atol=1e-12)
    assert np.allclose(turned, frame @ other, atol=1e-11)


def test_force_at_a_point_changes_both_momenta() -> None:
    """A force in the world's axes on a point that turns with the body, and another on a second point."""
    scene, box = tossed(0.0)
    point, knots = np.array([0.05, -0.02, 0.03]), [0.0, 0.1]
    push = np.array([[0.5, -1.0, 2.0], [1.5, 1.0, -0.5]])
    scene.add_force(box.point(point), push, knots, name="thrust")
    scene.add_force(box.point((0.0, 0.0, 0.1)), (0.0, 0.3, 0.0), knots)
    times = np.arange(201) * 5e-4
    motion = sb.simulate(scene, times, sb.Solver(h=5e-4))
    frame = box.pose(motion)[1]
    f = np.stack([np.interp(times, knots, push[:, k]) for k in range(3)], axis=1)
    second = np.array([0.0, 0.3, 0.0])
    gained = box.momentum(motion)[-1] - box.momentum(motion)[0]
    assert gained == pytest.approx(np.trapezoid(f + second, times, axis=0), rel=1e-3)
    torque = np.cross(frame @ (point - CENTER), f) + np.cross(frame @ ([0.0, 0.0, 0.1] - CENTER), second)
    turned = box.angular_momentum(motion)[-1] - box.angular_momentum(motion)[0]
    assert turned == pytest.approx(np.trapezoid(torque, times, axis=0), abs=2e-3 * np.linalg.norm(turned))
    assert scene.quantities["thrust_z_1"].value == -0.5
    scene, box = tossed()
    scene.add_force(box.point(point, name="nozzle"), (0.5, -1.0, 2.0), name="thrust")
    report = sb.check_gradients(scene, [0.01, 0.02], samples=1)
    assert report.passed and {"thrust_x", "nozzle_y"} <= set(scene.quantities), str(report)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"forces": (1.0, 0.0)}, "forces"),
        ({"forces": np.zeros((60, 3)), "times": np.arange(60.0), "name": "thrust"}, "too many knots"),
        ({"forces": (1.0, 0.0, 0.0), "times": [1.0, 0.0]}, "times"),
    ],
)
def test_bad_forces_on_points_are_refused(given: dict[str, object], match: str) -> None:
    scene, box = tossed()
    with pytest.raises(sb.SceneError, match=match):
        scene.add_force(box.point(), **given)  # type: ignore[arg-type]
    with pytest.raises(sb.SceneError, match="another scene"):
        sb.Scene("other").add_force(box.point(), (1.0, 0.0, 0.0))
    with pytest.raises(sb.SceneError, match="force on particles"):
        scene.add_force(box.particles[:1], (1.0, 0.0, 0.0), name="thrust")


def test_rotational_drag_slows_a_ball_as_its_torque_says() -> None:
    scene = sb.Scene("ball", gravity=(0.0, 0.0, 0.0))
    inertia = sb.Inertia.ball(0.2, 0.05)
    ball = scene.add_body("ball", of=inertia, spin=(0.0, 0.0, 3.0), turn_drag=4e-4, drag=0.1, velocity=(1.0, 0.0, 0.0))
    motion = sb.simulate(scene, [0.0, 0.5], sb.Solver(h=1e-3))
    decay = np.exp(-4e-4 * 0.5 / inertia.matrix[0, 0])
    assert ball.angular_velocity(motion)[-1] == pytest.approx([0.0, 0.0, 3.0 * decay], rel=2e-4, abs=1e-12)
    assert ball.momentum(motion)[-1, 0] == pytest.approx(0.2 * np.exp(-0.1 * 0.5 / 0.2), rel=1e-4)


def test_inertia_outside_of_what_bodies_have_is_refused_by_name() -> None:
    scene, _ = tossed()
    with pytest.raises(sb.SceneError, match="axis 1 of the body 'box' negative"):
        sb.simulate(scene, [0.0, 0.01], values={"box_inertia_1": 8e-3})


def test_markers_and_quantities_find_the_center_and_the_ratios_of_inertia() -> None:
    """A flight without torque shows ratios of the moments; the center of mass where the frame's origin is not."""
    points = 0.05 * np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    times, solver = np.arange(30) * 0.01, sb.Solver(h=5e-3)
    truth, true = tossed(inertia=(2e-3, 3e-3, 4e-3), spin=(6.0, 5.0, -4.0))
    motion = sb.simulate(truth, times, solver)
    origin, _ = true.pose(motion)
    seen = sb.Recording.from_poses(times, origin, true.quaternions(motion), points)
    scene, box = tossed(inertia=(2e-3, 3.2e-3, 3.8e-3), spin=(6.0, 5.0, -4.0), center=(0.0, 0.0, 0.0))
    names = ["box_inertia_2", "box_inertia_3", "box_center_x", "box_center_y", "box_center_z"]
    names += [f"box_{k}_{a}" for k in ("velocity", "spin") for a in "xyz"]
    found = sb.fit(
        scene, seen, names, markers=sb.on_body(box, points), solver=solver, start_time=0.0, sigma=1e-4, refine=False
    )
    assert found.values["box_inertia_2"] == pytest.approx(3e-3, rel=1e-6)
    assert found.values["box_inertia_3"] == pytest.approx(4e-3, rel=1e-6)
    assert [found.values[f"box_center_{a}"] for a in "xyz"] == pytest.approx(CENTER, abs=1e-8)


def test_driven_body_rides_on_poses_and_a_pinned_one_stays() -> None:
    times = np.linspace(0.0, 0.2, 21)
    turns = np.stack([rotation_matrix("", [0.0, 0.0, 2.0 * t]) for t in times])
    path = np.column_stack([times, 0.0 * times, times**2])
    scene = sb.Scene("held")
    hand = scene.add_body(
        "hand", mass=1.0, inertia=MATRIX, center=CENTER, poses=sb.Tool(times, path, quaternions_of(turns))
    )
    wall = scene.add_body("wall", mass=1.0, inertia=MATRIX, pinned=True, at=(5.0, 0.0, 0.0))
    scene.add_body("free", mass=1.0, inertia=MATRIX)
    motion = sb.simulate(scene, [0.0, 0.1, 0.2], sb.Solver(h=1e-3))
    origin, frame = hand.pose(motion)
    assert np.allclose(origin, path[[0, 10, 20]], atol=1e-12)
    assert np.allclose(frame, turns[[0, 10, 20]], atol=1e-12)
    assert np.allclose(wall.pose(motion)[0], [5.0, 0.0, 0.0])
    assert "hand_spin_x" not in scene.quantities
    assert "wall_turn_x" in scene.quantities
    with pytest.raises(sb.SceneError, match="taken"):
        tossed()[0].add_body("box", mass=1.0, inertia=MATRIX)


def test_saved_scene_moves_with_the_same_bits(tmp_path: Path) -> None:
    scene, _ = tossed()
    sb.save_scene(scene, tmp_path / "toss.sheetbend")
    again = sb.load_scene(tmp_path / "toss.sheetbend")
    one, other = (sb.simulate(s, [0.05], sb.Solver(h=1e-3)).positions for s in (scene, again))
    assert (one == other).all()


def test_payload_weighed_by_a_wrist_against_newton_and_euler() -> None:
    """All ten numbers of a load that a driven gripper shakes, from force and torque without a simulation of ours."""
    times = np.arange(0, 4001) * 1e-4
    swing = 0.5 - 0.5 * np.cos(np.outer(times, 2.0 * np.pi * np.array([2.5, 3.5, 4.5, 3.0, 4.0, 2.5])))
    x, angles = 0.1 * swing[:, :3], swing[:, 3:] * [1.0, -0.9, 1.2]
    names = ["a", "b", "c"]
    turns = np.stack([numbers(rotation(names), dict(zip(names, a, strict=True))) for a in angles])
    rate = partial(np.gradient, axis=0, edge_order=2)
    center = x + turns @ CENTER
    force = 0.4 * (rate(rate(center, times), times) - np.array([0.0, 0.0, -9.81]))
    skew = rate(turns, times) @ np.swapaxes(turns, 1, 2)
    spin = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    momentum = np.einsum("fab,bc,fdc,fd->fa", turns, MATRIX, turns, spin)
    torque = rate(momentum, times) + np.cross(center - x, force)
    every, knots = slice(200, 3801, 100), slice(0, None, 20)
    wrist = sb.ForceRecording(times[every], force[every], torque[every], name="wrist")
    tool = sb.Tool(times[knots], x[knots], quaternions_of(turns[knots]))

    scene = sb.Scene("payload")
    hand = scene.add_body("hand", mass=1e-6, inertia=(1e-9, 1e-9, 1e-9), poses=tool)
    origin, frame = hand.pose(scene.nodes)
    moments, axes = sb.Inertia(0.4, MATRIX).principal()
    guess = axes @ np.diag(moments * [1.05, 0.97, 1.03]) @ axes.T
    load = scene.add_body("load", mass=0.45, inertia=guess, center=0.8 * CENTER, at=origin, rotation=frame)
    sb.fixed(hand, load)
    sensor = sb.ForceSensor(recording=wrist, at=hand.particles.tolist(), sigma=0.05, torque_sigma=2e-3)
    marked = sb.Recording(tool.path([[0.05, 0.0, 0.0]])[::10], tool.times[::10])
    wanted = dict(zip([f"load_inertia_{k}" for k in (1, 2, 3)], moments, strict=True)) | {"load_mass": 0.4}
    wanted |= {f"load_center_{a}": c for a, c in zip("xyz", CENTER, strict=True)}
    wanted |= {f"load_axes_turn_{a}": 0.0 for a in "xyz"}
    found = sb.fit(
        scene,
        marked,
        list(wanted),
        markers=sb.on_body(load, [[0.05, 0.0, 0.0]]),
        solver=sb.Solver(h=2e-3),
        forces=[sensor],
        start_time=0.0,
        refine=False,
    )
    for name, value in wanted.items():
        size = {"mass": 2e-3, "center": 2e-4, "inertia": 3e-5, "axes": 0.05}[name.split("_")[1]]
        assert found.values[name] == pytest.approx(value, abs=size), name
    assert found["load_mass"].verdict == "identified"
