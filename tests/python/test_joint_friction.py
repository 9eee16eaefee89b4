"""Dry friction in hinges of bodies: closed forms, arms with the same numbers, gradients, a fit, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx

G, MASS, CENTER, OWN = 9.81, 0.4, 0.2, 4e-3  # m/s^2, kg, m, kg m^2 about the center of mass
WEIGHT, MOMENT = MASS * G * CENTER, OWN + MASS * CENTER**2  # N m over the sine of the angle; kg m^2 about the hinge


def pendulum(rate: float = 0.0, gravity: float = G, **options: object) -> tuple[sb.Scene, sb.Joint]:
    """A body on a hinge about y, whose angle counts from straight down towards +x."""
    scene = sb.Scene("pendulum", gravity=(0.0, 0.0, -gravity))
    body = scene.add_body("bar", mass=MASS, inertia=[OWN] * 3, center=(0.0, 0.0, -CENTER))
    joint = sb.hinge(None, body, at=(0.0, 0.0, 0.0), axis=(0.0, -1.0, 0.0), rate=rate, **options)  # type: ignore[arg-type]
    return scene, joint


def swing(times: np.ndarray, h: float, angle: float, **options: object) -> np.ndarray:
    """(frames,) rad, from an angle at rest."""
    scene, joint = pendulum(**options)  # type: ignore[arg-type]
    return joint.angle(sb.simulate(scene, times, sb.Solver(h=h), {"hinge_angle": angle}))


def test_each_half_swing_is_smaller_by_the_same_angle() -> None:
    """By 2 friction/weight, as Coulomb's friction asks of small swings."""
    friction = 0.002 * WEIGHT
    times = np.arange(2400) * 2e-3
    turned = swing(times, 5e-4, 0.05, friction=friction, slip_angle=1e-5)
    before, at, after = turned[:-2], turned[1:-1], turned[2:]
    turns = np.flatnonzero((at - before) * (after - at) < 0)
    slope, bend = (after - before)[turns] / 2, (after - 2 * at + before)[turns]
    sizes = np.abs(at[turns] - slope**2 / (2 * bend))
    falls = -np.diff(np.concatenate([[0.05], sizes]))
    assert len(falls) >= 8
    assert falls == approx(np.full(len(falls), 2 * friction / WEIGHT), rel=5e-3)


def test_a_wheel_slows_down_steadily_over_many_turns() -> None:
    friction, rate = 0.02, 20.0
    times = np.arange(1, 301) * 5e-3
    scene, joint = pendulum(rate=rate, gravity=0.0, friction=friction)
    turned = np.unwrap(joint.angle(sb.simulate(scene, times, sb.Solver(h=2.5e-4))))
    assert turned[-1] > 6 * math.pi
    assert rate * times - turned == approx(0.5 * friction / MOMENT * times**2, abs=3e-3)


def test_it_sticks_where_the_weight_is_less() -> None:
    friction, slip = 0.05 * WEIGHT, 1e-3
    end = swing(np.array([0.0, 2.0, 4.0]), 1e-3, 0.02, friction=friction, slip_angle=slip, viscosity=0.2)[-1]
    assert 0.02 - end == approx(slip * WEIGHT * math.sin(end) / friction, rel=1e-3)


def test_at_rest_it_bears_its_torque_beside_a_spring() -> None:
    scene = sb.Scene("bar")
    bar = scene.add_body("bar", mass=MASS, inertia=[OWN] * 3, center=(CENTER, 0.0, 0.0))
    joint = sb.hinge(None, bar, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), friction=0.5, stiffness=0.2)
    angle = float(joint.angle(sb.equilibrium(scene).nodes))
    assert WEIGHT * math.cos(angle) == approx(0.5 + 0.2 * angle, rel=1e-12)


def test_two_bodies_swing_as_two_arms_with_the_same_numbers() -> None:
    numbers = {"mass": MASS, "first_moment": MASS * CENTER, "inertia": MOMENT, "length": 0.3}
    arms = sb.Scene("arms")
    upper = sb.add_arm(arms, "upper", angle=0.9, friction=4e-3, **numbers)
    lower = sb.add_arm(arms, "lower", pivot=upper, angle=0.2, friction=2e-3, **numbers)
    times, solver = np.arange(41) * 0.025, sb.Solver(h=1e-3, iterations=3)
    x = sb.simulate(arms, times, solver).positions
    of_arms = [x[:, a.end] - x[:, a.pivot] for a in (upper, lower)]

    scene, top, above, bodies = sb.Scene("bodies"), np.zeros(3), None, []
    for name, angle, friction in (("upper", 0.9, 4e-3), ("lower", 0.2, 2e-3)):
        down, across = (np.array([math.sin(a), 0.0, -math.cos(a)]) for a in (angle, angle + math.pi / 2))
        frame = np.stack([down, [0.0, 1.0, 0.0], np.cross(down, [0.0, 1.0, 0.0])], axis=1)
        assert abs(frame[:, 2] @ across) == approx(1.0)
        body = scene.add_body(name, mass=MASS, inertia=[OWN] * 3, center=(CENTER, 0.0, 0.0), at=top, rotation=frame)
        sb.hinge(above, body, at=top, axis=(0.0, -1.0, 0.0), name=f"{name}_hinge", friction=friction)
        above, top = body, top + 0.3 * down
        bodies.append(body)
    motion = sb.simulate(scene, times, solver)
    for body, line in zip(bodies, of_arms, strict=True):
        found = body.pose(motion)[1][:, :, 0]
        assert np.abs(found - line / np.linalg.norm(line, axis=1)[:, None]).max() < 1e-4


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_gradients_are_exact(method: str, integrator: str) -> None:
    """While it slides and while it sticks."""
    scene, _ = pendulum(rate=0.3, gravity=30.0, friction=0.3, slip_angle=5e-3, viscosity=1e-3)
    times = np.arange(6) * 0.01
    solver = sb.Solver(h=2e-3, method=method, integrator=integrator)
    report = sb.check_gradients(scene, times, solver, samples=1)
    assert report.passed, str(report)
    rows = {row.name: row for row in report.rows}
    assert not rows["hinge_friction"].unfelt and not rows["hinge_angle"].unfelt


@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_lanes_have_the_bits_of_single_scenes(method: str) -> None:
    """Of motions and gradients; one of the hinges sticks while others slide."""
    compiled = pendulum(rate=1.0, friction=0.1)[0].compiled
    core, steps = sb.Solver(h=2e-3, method=method).core(compiled), [10, 40]
    inputs = np.stack([compiled.inputs(compiled.values({"hinge_friction": f})) for f in (0.02, 0.1, 1.0)])
    together = core.simulate_batch(inputs, steps, 0.0)
    bar = np.ones_like(together)
    gradients = core.vjp_batch(inputs, steps, bar, 0.0)
    for own, states, states_bar, found in zip(inputs, together, bar, gradients, strict=True):
        assert np.array_equal(core.states(own, steps, 0.0), states)
        _, tape = core.record(own, steps, 0.0)
        assert np.array_equal(core.vjp(own, tape, steps, states_bar, 0.0), found)


@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_a_wheel_stops_and_stays(method: str) -> None:
    friction, rate = 0.1, 5.0
    scene, joint = pendulum(rate=rate, gravity=0.0, friction=friction)
    stop = rate * MOMENT / friction
    times = [0.5 * stop, 1.5 * stop, 2.0 * stop]
    turned = joint.angle(sb.simulate(scene, times, sb.Solver(h=1e-3, method=method)))
    end = 0.5 * rate * stop
    assert turned == approx([0.75 * end, end, end], abs=3e-3)
    assert turned[2] == approx(turned[1], abs=1.1e-3)  # it swings in its slip angle


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"friction": 0.0}, "friction", "must be positive"),
        ({"friction": math.nan}, "friction", "must be positive"),
        ({"friction": 1e-3, "slip_angle": 0.0}, "slip_angle", "must be positive"),
    ],
)
def test_impossible_frictions_are_refused(change: dict, field: str, words: str) -> None:
    with pytest.raises(sb.SceneError, match=words) as caught:
        pendulum(**change)
    assert caught.value.field == f"hinge.{field}" and caught.value.fix


def test_extrapolation_in_time_refuses_it() -> None:
    scene, _ = pendulum(friction=0.1)
    with pytest.raises(sb.InputError, match="dry friction"):
        sb.simulate(scene, [0.0, 0.01], sb.Solver(extrapolate=2))
