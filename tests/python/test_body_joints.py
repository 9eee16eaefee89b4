"""Joints between rigid bodies: what they hold, how they start, springs, servos and motors, linkages against oracles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sheetbend as sb
from random_mechanisms import gaps as exact

INERTIA = sb.Inertia.box(0.3, (0.1, 0.06, 0.04))
AT, AXIS = np.array([0.1, 0.02, 0.01]), np.array([0.2, 1.0, 0.3])
Join = Callable[[sb.Body, sb.Body], sb.Joint]


def pair(join: Join) -> tuple[sb.Scene, sb.Body, sb.Body, sb.Joint]:
    """Two bodies that fly, joined beside both of their centers."""
    scene = sb.Scene("pair")
    given = {"of": INERTIA.moved((0.01, 0.005, 0.0)), "velocity": (0.3, 0.0, 0.5)}
    upper = scene.add_body("upper", rotation=(0.1, 0.2, -0.3), spin=(2.0, -1.0, 3.0), **given)
    lower = scene.add_body("lower", at=(0.2, 0.03, 0.0), rotation=(0.5, -0.2, 0.1), spin=(1.0, 2.0, -3.0), **given)
    return scene, upper, lower, join(upper, lower)


CASES: dict[str, tuple[Join, int]] = {
    "ball": (lambda u, v: sb.ball(u, v, at=AT), 3),
    "hinge": (lambda u, v: sb.hinge(u, v, at=AT, axis=AXIS, rate=4.0), 5),
    "slider": (lambda u, v: sb.slider(u, v, at=AT, axis=AXIS, rate=0.3), 5),
    "cylinder": (lambda u, v: sb.cylinder(u, v, at=AT, axis=AXIS, rate=0.3, turn_rate=4.0), 4),
    "fixed": (lambda u, v: sb.fixed(u, v, at=AT), 6),
}


def gaps(joint: sb.Joint, motion: sb.Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Of the two places (frames, 3) m along the upper body's three directions, and how the lower one is turned in
    them, (frames, 3, 3)."""
    from sheetbend.quantities.expression import numbers

    (o, a), (p, b) = joint.upper.pose(motion), joint.lower.pose(motion)
    known = joint.upper.values()
    first, second = (numbers(place, known) for place in joint.places)
    a, p, o, b = a @ joint.axes[0].T, p + b @ second, o + a @ first, b @ joint.axes[1].T
    return np.einsum("fa,fab->fb", p - o, a), np.einsum("fab,fac->fbc", a, b)


@pytest.mark.parametrize("kind", CASES)
def test_joint_holds_what_it_says_and_leaves_the_rest_free(kind: str) -> None:
    join, rows = CASES[kind]
    scene, upper, lower, joint = pair(join)
    motion = sb.simulate(scene, [0.0, 1e-3, 0.1], sb.Solver(h=1e-3))
    way, turn = gaps(joint, motion)
    slides, turns = kind in ("slider", "cylinder"), kind in ("hinge", "cylinder")
    assert abs(way[:, 1:]).max() < 1e-12
    assert (abs(way[:, 0]).max() < 1e-12) is not slides
    if kind != "ball":
        assert abs(turn[:, 0, 1:]).max() < 1e-12
        assert (abs(turn - np.eye(3)).max() < 1e-12) is not turns
    if turns:
        assert joint.angle(motion)[:2] == pytest.approx([0.0, 4e-3], rel=0.05, abs=1e-12)
    momentum = upper.momentum(motion) + lower.momentum(motion)
    assert np.allclose(momentum - momentum[0], np.outer(motion.times, [0.0, 0.0, -9.81 * 0.6]), atol=2e-5)
    spin = sum(b.angular_momentum(motion, about=(0.0, 0.0, 0.0)) for b in (upper, lower))
    places = [b.pose(motion)[0] for b in (upper, lower)]
    assert np.isfinite(spin).all() and len(places) == 2
    assert scene.compiled.core.rows == 12 + rows


@pytest.mark.parametrize("kind", ["hinge", "cylinder"])
def test_any_values_start_in_the_joint_and_have_exact_gradients(kind: str) -> None:
    scene, _, _, _ = pair(CASES[kind][0])
    changed = {f"{kind}_angle": 0.4, f"{kind}_upper_x": 0.13, f"{kind}_lower_y": 0.01, "upper_turn_z": 0.5}
    changed |= {"lower_center_x": 0.02, "lower_axes_turn_y": 0.3, f"{kind}_rate": -2.0}
    start = sb.simulate(scene, [0.0, 1e-3], sb.Solver(h=1e-3), changed)
    C = sb.constraint_values(scene, start.nodes[0], changed)
    assert max(abs(c).max() for c in C.values()) < 1e-14
    report = sb.check_gradients(scene, [0.01, 0.02], samples=1, values=changed)
    assert report.passed, str(report)


def test_universal_joint_keeps_two_axes_across_each_other() -> None:
    scene = sb.Scene("cardan")
    fork = scene.add_body("fork", of=INERTIA, spin=(0.0, 0.0, 5.0))
    cross = scene.add_body("cross", of=INERTIA, at=(0.0, 0.0, -0.1), spin=(0.0, 0.0, 5.0))
    joint = sb.universal(fork, cross, at=(0.0, 0.0, -0.05), axes=[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=1e-3))
    way, turn = gaps(joint, motion)
    assert abs(way).max() < 1e-12
    assert abs(turn[:, 0, 1]).max() < 1e-12
    with pytest.raises(sb.SceneError, match="not across each other"):
        sb.universal(fork, cross, at=(0.0, 0.0, 0.0), axes=[(1.0, 0.0, 0.0), (1.0, 1.0, 0.0)], name="no")


def wheel(**options: object) -> tuple[sb.Scene, sb.Joint]:
    """A body on a hinge through its center, about z."""
    scene = sb.Scene("wheel")
    body = scene.add_body("wheel", of=INERTIA)
    return scene, sb.hinge(None, body, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), **options)  # type: ignore[arg-type]


def test_torsion_spring_has_its_period_and_viscosity_its_decay() -> None:
    moment = INERTIA.matrix[2, 2]
    scene, joint = wheel(stiffness=0.05, rest=0.2)
    w = np.sqrt(0.05 / moment)
    times = np.round(np.array([0.5, 1.0]) * 2.0 * np.pi / w, 3)
    motion = sb.simulate(scene, times, sb.Solver(h=5e-4))
    assert joint.angle(motion) == pytest.approx(0.2 - 0.2 * np.cos(w * times), abs=4e-4)
    scene, joint = wheel(viscosity=1e-3, rate=2.0)
    motion = sb.simulate(scene, [0.2], sb.Solver(h=1e-3))
    tau = moment / 1e-3
    assert joint.angle(motion) == pytest.approx([2.0 * tau * (1.0 - np.exp(-0.2 / tau))], rel=2e-3)


def tray(**options: object) -> tuple[sb.Scene, sb.Joint]:
    """A body on an upright slider beside its center, in a frame that leans."""
    scene = sb.Scene("tray")
    body = scene.add_body("tray", of=INERTIA.moved((0.01, 0.02, -0.01)), rotation=(0.3, -0.2, 0.5), at=(0.1, 0.0, 0.2))
    return scene, sb.slider(None, body, at=AT, axis=(0.0, 0.0, 1.0), **options)  # type: ignore[arg-type]


def hung(t: np.ndarray, k: float, c: float, rest: float) -> np.ndarray:
    """m, the shift of a mass of 0.3 kg on a spring and a damper, from rest in gravity."""
    w, decay = np.sqrt(k / 0.3 - (c / 0.6) ** 2), c / 0.6
    end = rest - 0.3 * 9.81 / k
    return np.asarray(end * (1.0 - np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))))


@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_a_slider_with_spring_and_damper_swings_as_the_closed_form(method: str) -> None:
    scene, joint = tray(stiffness=120.0, rest=0.01, viscosity=0.8)
    times = np.linspace(0.0, 0.4, 9)
    motion = sb.simulate(scene, times, sb.Solver(h=5e-4, method=method))
    assert joint.shift(motion) == pytest.approx(hung(times, 120.0, 0.8, 0.01), abs=3e-5)
    moved = sb.simulate(scene, times, sb.Solver(h=5e-4, method=method), values={"slider_lower_z": 0.03})
    assert abs(joint.shift(moved) - joint.shift(motion)).max() > 1e-3  # with the scene's place: of another point
    assert joint.shift(moved, {"slider_lower_z": 0.03}) == pytest.approx(joint.shift(motion), abs=1e-9)
    report = sb.check_gradients(scene, [0.0, 2e-3, 4e-3], sb.Solver(h=5e-4, method=method), samples=1)
    assert report.passed, str(report)
    scene, joint = tray(viscosity=0.8)
    t, tau = 0.3, 0.3 / 0.8
    fallen = -9.81 * tau * (t - tau * (1.0 - np.exp(-t / tau)))
    assert joint.shift(sb.simulate(scene, [t], sb.Solver(h=5e-4, method=method))) == pytest.approx([fallen], rel=1e-3)


def test_a_slider_gives_its_spring_rest_and_damper_from_its_motion() -> None:
    solver, times, truth = sb.Solver(h=1e-3), np.arange(41) / 100, (120.0, 0.01, 0.8)
    names = ["slider_stiffness", "slider_rest", "slider_viscosity"]
    scene, joint = tray(stiffness=truth[0], rest=truth[1], viscosity=truth[2])
    x = joint.lower.pose(sb.simulate(scene, times, solver))[0][:, None]
    scene, joint = tray(stiffness=100.0, viscosity=0.5)
    seen = sb.on_body(joint.lower, [(0.0, 0.0, 0.0)])
    recording = sb.Recording(x, times)
    found = sb.fit(scene, recording, names, markers=seen, solver=solver, sigma=1e-4, start_time=0.0, refine=False)
    assert [found.values[name] for name in names] == pytest.approx(truth, rel=1e-6)


def test_servo_follows_and_a_torque_turns_body_and_rotor() -> None:
    moment = INERTIA.matrix[2, 2]
    times = np.linspace(0.0, 0.4, 21)
    scene, joint = wheel(servo=(times, np.sin(4.0 * times)))
    motion = sb.simulate(scene, [0.2, 0.4], sb.Solver(h=1e-3))
    assert joint.angle(motion) == pytest.approx(np.sin([0.8, 1.6]), abs=1e-10)
    scene, joint = wheel(torque=([0.0, 0.4], [0.01, 0.01]), rotor=1e-4)
    motion = sb.simulate(scene, [0.2], sb.Solver(h=1e-3))
    assert joint.angle(motion) == pytest.approx([0.5 * 0.01 / (moment + 1e-4) * 0.2**2], rel=2e-3)
    report = sb.check_gradients(scene, [0.01, 0.02], samples=1)
    assert report.passed and "hinge_torque_1" in scene.quantities
    with pytest.raises(sb.SceneError, match="rotor"):
        wheel(torque=([0.0], [1.0]))


def test_motors_and_forces_may_have_knots_of_their_own() -> None:
    knots = np.array([0.0, 0.05, 0.1, 0.2, 0.3])

    def moved(own: bool) -> np.ndarray:
        scene = sb.Scene("arm")
        torques = ([0.0, 0.1, 0.3], [0.0, 0.3, -0.2]), ([0.0, 0.05, 0.2], [0.1, -0.1, 0.2])
        first, second = (torque if own else (knots, np.interp(knots, *torque)) for torque in torques)
        of = sb.Inertia.box(0.2, (0.1, 0.02, 0.02))
        upper, lower = (scene.add_body(name, of=of, at=(x, 0, 0)) for name, x in (("upper", 0.05), ("lower", 0.15)))
        sb.hinge(None, upper, at=(0, 0, 0), axis=(0, 1, 0), name="shoulder", torque=first, rotor=1e-3)
        sb.hinge(upper, lower, at=(0.1, 0, 0), axis=(0, 1, 0), name="elbow", torque=second, rotor=1e-3)
        push, times = ([[0.0, 0.0, 0.5]], [0.0]) if own else (np.tile([0.0, 0.0, 0.5], (5, 1)), knots)
        scene.add_force(lower.point((0.05, 0, 0)), push, times, name="push")
        if own:
            assert sb.check_gradients(scene, [0.0, 0.02], sb.Solver(h=1e-3)).passed
        return sb.simulate(scene, np.arange(31) * 0.01, sb.Solver(h=1e-3)).positions

    assert moved(own=True) == pytest.approx(moved(own=False), abs=1e-13)


def gate(g: float, **options: object) -> tuple[sb.Scene, sb.Body]:
    """A bar that stands out from a hinge with an upright axis."""
    scene = sb.Scene("gate", gravity=(0.0, 0.0, -g))
    bar = scene.add_body("bar", of=INERTIA, at=(0.1, 0.0, 0.0))
    sb.hinge(None, bar, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), **options)  # type: ignore[arg-type]
    return scene, bar


def test_an_axis_that_gives_way_sags_and_swings_like_a_torsion_spring() -> None:
    """At rest k sin(tilt) = m g l. A small swing is that of a damped oscillator, released without load."""
    k, c, weight = 5.0, 0.02, 0.3 * 9.81
    scene, bar = gate(9.81, tilt_stiffness=k)
    assert bar.pose(sb.equilibrium(scene).nodes)[0][2] == pytest.approx(-0.1 * weight * 0.1 / k, rel=1e-9)
    moment = INERTIA.matrix[1, 1] + 0.3 * 0.1**2
    scene, bar = gate(0.1, tilt_stiffness=k, tilt_damping=c)
    decay = 0.5 * c / moment
    w = np.sqrt(k / moment - decay**2)
    times = np.round(np.array([1.0, 2.0, 3.5]) * np.pi / w, 4)
    motion = sb.simulate(scene, times, sb.Solver(h=1e-4))
    free = np.exp(-decay * times) * (np.cos(w * times) + decay / w * np.sin(w * times))
    sag = 0.1 * 0.3 * 0.1 * 0.1 / k
    assert bar.pose(motion)[0][:, 2] == pytest.approx(-sag * (1.0 - free), rel=1e-3)


@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_an_axis_that_gives_way_has_exact_gradients(method: str) -> None:
    scene, _ = gate(9.81, tilt_stiffness=5.0, tilt_damping=0.02)
    report = sb.check_gradients(scene, [0.01, 0.02], samples=1, solver=sb.Solver(h=1e-3, method=method))
    assert report.passed, str(report)
    assert {"hinge_tilt_stiffness", "hinge_tilt_damping"} <= set(scene.quantities)


@pytest.mark.parametrize("compliance", [1e-6, 1e-8, 1e-10, 1e-12, 1e-14])  # m/N
def test_stiff_mounts_balance_in_implicit_and_give_way_by_their_force(compliance: float) -> None:
    """From 1e-12 m/N down the forces did not balance: the coordinates tell a force by too few digits."""

    def swung(give: float | None) -> np.ndarray:
        scene = sb.Scene("bars")
        of = sb.Inertia.box(0.2, (0.1, 0.03, 0.02))
        upper = scene.add_body("upper", of=of, at=(0.05, 0.0, 0.0))
        lower = scene.add_body("lower", of=of, at=(0.15, 0.0, 0.0))
        sb.hinge(None, upper, at=(0, 0, 0), axis=(0, 1, 0), rate=3.0)
        sb.ball(upper, lower, at=(0.1, 0, 0), name="mount", compliance=give)
        solver = sb.Solver(h=2e-3, method="implicit")
        motion = sb.simulate(scene, np.arange(101) * 2e-3, solver)
        assert max(exact(scene, solver).values()) < 1e-8
        at = [o + R @ [end, 0.0, 0.0] for body, end in ((upper, 0.05), (lower, -0.05)) for o, R in [body.pose(motion)]]
        if give is not None:
            assert np.abs(at[0] - at[1] + give * motion.forces["mount_place"][:, 0])[1:].max() < 1e-15
        return lower.pose(motion)[0]

    assert np.abs(swung(compliance) - swung(None)).max() < 20.0 * compliance + 1e-11  # m, with forces of up to 9 N


@pytest.mark.parametrize(("mass", "slip"), [(1e-5, 1e-3), (1e-3, 1e-6)])
def test_dry_friction_of_a_light_body_slides_in_implicit(mass: float, slip: float) -> None:
    """It is stiff beside such a body, but a multiplier would be in the way of its bound."""
    scene = sb.Scene("light")
    light = scene.add_body("light", of=sb.Inertia.box(mass, (0.01, 0.01, 0.01)), at=(0.0, 0.0, 0.0))
    heavy = scene.add_body("heavy", of=sb.Inertia.box(0.3, (0.1, 0.03, 0.02)), at=(0.05, 0.0, 0.0))
    sb.hinge(None, light, at=(0, 0, 0), axis=(0, 1, 0), friction=0.05, slip_angle=slip)
    sb.fixed(light, heavy, at=(0.01, 0, 0))
    motion = sb.simulate(scene, np.arange(26) * 4e-3, sb.Solver(h=4e-3, method="implicit"))
    inertia = 0.3 * (0.1**2 + 0.02**2) / 12.0 + 0.3 * 0.05**2
    turned = 0.5 * (0.3 * 9.81 * 0.05 - 0.05) / inertia * 0.1**2  # rad, as gravity's arm hardly shortens
    assert heavy.pose(motion)[0][-1, 2] == pytest.approx(-0.05 * np.sin(turned), rel=0.1)


def arms(angles: list[float], solver: sb.Solver, until: float) -> np.ndarray:
    """Angles of the triple pendulum of the oracle, from bodies on hinges."""
    scene, top, upper, bodies = sb.Scene("triple"), np.zeros(3), None, []
    for k, (m, a, inertia) in enumerate(
        zip((0.23, 0.25, 0.22), (0.1, 0.1, 0.08), (1.0e-3, 1.1e-3, 0.9e-3), strict=True)
    ):
        d = np.array([np.sin(angles[k]), 0.0, -np.cos(angles[k])])
        frame = np.stack([d, np.cross([0.0, 1.0, 0.0], d), [0.0, 1.0, 0.0]], axis=1)
        arm = scene.add_body(f"arm{k}", mass=m, inertia=[inertia] * 3, center=(a, 0.0, 0.0), at=top, rotation=frame)
        sb.hinge(upper, arm, at=top, axis=(0.0, -1.0, 0.0), name=f"hinge{k}")
        upper, top = arm, top + 0.17 * d
        bodies.append(arm)
    motion = sb.simulate(scene, [0.0, until], solver)
    return np.array([np.arctan2(*(b.pose(motion)[1][-1][[0, 2], 0] * [1.0, -1.0])) for b in bodies])


def test_triple_pendulum_of_bodies_in_three_extrapolated_runs() -> None:
    found = arms([2.0, 1.2, 2.5], sb.Solver(h=1 / 960, extrapolate=3), 1.5)
    wanted = np.array([-0.2205024, 3.6357706, 12.4751056])
    assert abs(np.exp(1j * found) - np.exp(1j * wanted)).max() < 1e-3


def test_two_link_arm_gives_spring_viscosity_length_and_torques_to_1e_6() -> None:
    knots = np.linspace(0.0, 0.4, 20)
    torques = 0.02 * np.sin(2.0 * np.pi * knots / 0.3) + 0.01

    def arm(stiffness: float, viscosity: float, length: float, torque: np.ndarray) -> tuple[sb.Scene, list[sb.Place]]:
        scene = sb.Scene("arm")
        first = scene.add_body("first", of=INERTIA, at=(0.05, 0.0, 0.0))
        second = scene.add_body("second", of=INERTIA, at=(0.05 + length, 0.0, 0.0))
        axis = (0.0, -1.0, 0.0)
        sb.hinge(None, first, at=(0.0, 0.0, 0.0), axis=axis, name="shoulder", torque=(knots, torque), rotor=1e-5)
        spring = {"stiffness": stiffness, "viscosity": viscosity}
        sb.hinge(first, second, at=(length, 0.0, 0.0), axis=axis, name="elbow", **spring)
        return scene, [
            *sb.on_body(first, [[0.05, 0.0, 0.0]]),
            *sb.on_body(second, [[0.05, 0.0, 0.0], [0.0, 0.0, 0.02]]),
        ]

    solver, times = sb.Solver(h=2.5e-3), np.arange(41) * 0.01
    truth, places = arm(0.3, 2e-3, 0.1, torques)
    x = sb.simulate(truth, times, solver).nodes
    seen = []
    for place in places:
        body = place.body
        assert body is not None and place.offset is not None
        origin, frame = body.pose(x)
        seen.append(origin + frame @ np.array(place.offset))
    recording = sb.Recording(np.stack(seen, axis=1), times)
    scene, places = arm(0.35, 3e-3, 0.1, 0.5 * torques)
    names = ["elbow_stiffness", "elbow_viscosity", "elbow_upper_x", *(f"shoulder_torque_{k}" for k in range(20))]
    found = sb.fit(scene, recording, names, markers=places, solver=solver, start_time=0.0, sigma=1e-4, refine=False)
    assert found.values["elbow_stiffness"] == pytest.approx(0.3, rel=1e-6)
    assert found.values["elbow_viscosity"] == pytest.approx(2e-3, rel=1e-6)
    assert found.values["elbow_upper_x"] == pytest.approx(0.05, rel=1e-6)
    assert [found.values[n] for n in names[3:]] == pytest.approx(torques, abs=3e-8)


def test_bad_joints_are_refused() -> None:
    scene = sb.Scene("bad")
    body, other = scene.add_body("body", of=INERTIA), sb.Scene("other").add_body("body", of=INERTIA)
    with pytest.raises(sb.SceneError, match="upper one"):
        sb.ball(body, body, at=(0.0, 0.0, 0.0))
    with pytest.raises(sb.SceneError, match="another scene"):
        sb.ball(other, body, at=(0.0, 0.0, 0.0))
    with pytest.raises(sb.SceneError, match="is not a body"):
        sb.ball(None, 3, at=(0.0, 0.0, 0.0))  # type: ignore[arg-type]
    with pytest.raises(sb.SceneError, match="tilt_damping: acts where the axis gives way, and it is rigid"):
        gate(9.81, tilt_damping=0.1)
    with pytest.raises(sb.SceneError, match="tilt_stiffness: must be positive"):
        gate(9.81, tilt_stiffness=-1.0)
    with pytest.raises(sb.SceneError, match="viscosity: must not be negative"):
        gate(9.81, viscosity=-0.1)
    for make in (wheel, tray):
        with pytest.raises(sb.SceneError, match="rest: is that of a spring, and there is none"):
            make(rest=0.1)
        with pytest.raises(sb.SceneError, match="stiffness: must be positive"):
            make(stiffness=0.0)
