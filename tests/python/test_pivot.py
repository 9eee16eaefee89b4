"""What slows arms down, against closed forms: dry friction, viscosity and the drag of the air."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.objects.arm import add_arm, add_pendulum
from sheetbend.objects.arm_data import Arm

G, LENGTH, MASS = 9.81, 0.25, 0.4
WEIGHT = MASS * G * LENGTH  # N m, restoring torque over the sine of the angle
INERTIA = MASS * LENGTH**2


def pendulum(**resistance: float) -> tuple[sb.Scene, Arm]:
    scene = sb.Scene("pendulum")
    return scene, add_pendulum(scene, "arm", length=LENGTH, mass=MASS, **resistance)


def angles(motion: sb.Trajectory, arm: Arm) -> np.ndarray:
    """(frames,) rad from straight down towards +x."""
    line = motion.positions[:, arm.end] - motion.positions[:, arm.pivot]
    return np.unwrap(np.arctan2(line[:, 0], -line[:, 2]))


def turning_points(times: np.ndarray, swing: np.ndarray) -> np.ndarray:
    """Angles where the swing turns, by a parabola through the three frames about each."""
    before, at, after = swing[:-2], swing[1:-1], swing[2:]
    turns = np.flatnonzero((at - before) * (after - at) < 0)
    slope, bend = (after - before)[turns] / 2, (after - 2 * at + before)[turns]
    return at[turns] - slope**2 / (2 * bend)


def test_amplitudes_fall_by_four_times_friction_over_stiffness_in_each_period() -> None:
    friction = 0.002 * WEIGHT
    scene, arm = pendulum(angle=0.05, friction=friction, slip_angle=1e-5)
    times = np.arange(2400) * 2e-3
    sizes = np.abs(turning_points(times, angles(sb.simulate(scene, times, sb.Solver(h=5e-4)), arm)))
    falls = -np.diff(np.concatenate([[0.05], sizes]))
    assert len(falls) == 9
    assert falls == approx(np.full(9, 2 * friction / WEIGHT), rel=4e-3)  # a swing is half a period


def test_the_energy_lost_is_friction_times_the_angle_travelled() -> None:
    friction, slip = 0.01, 1e-4
    scene, arm = pendulum(angle=1.3, friction=friction, slip_angle=slip)
    times = np.arange(1200) * 2e-3
    turns = turning_points(times, angles(sb.simulate(scene, times, sb.Solver(h=2.5e-4)), arm))
    sizes = np.abs(np.concatenate([[1.3], turns]))
    lost = WEIGHT * np.diff(np.cos(sizes))
    travelled = sizes[:-1] + sizes[1:]
    travelled[0] -= slip / 2  # it starts unstrained, ...
    travelled[1:] -= 2 * slip  # ... and gives back what it stored at each turn
    assert len(lost) == 4 and lost == approx(friction * travelled, rel=2e-4)


def test_friction_holds_what_viscosity_lets_go() -> None:
    """Where the weight's torque is below the friction the joint stays, and the spring of the slip angle bears it."""
    friction, slip = 0.05 * WEIGHT, 1e-3
    times = np.arange(201) * 0.02

    def ends(angle: float, **dry: float) -> float:
        scene, arm = pendulum(angle=angle, viscosity=0.2, **dry)
        return float(angles(sb.simulate(scene, times, sb.Solver(h=1e-3)), arm)[-1])

    stuck = ends(0.02, friction=friction, slip_angle=slip)
    assert 0.02 - stuck == approx(slip * WEIGHT * math.sin(stuck) / friction, rel=1e-4)
    assert ends(0.1, friction=friction, slip_angle=slip) == approx(0.05, abs=0.01)
    assert ends(0.02) == approx(0.0, abs=1e-5)


def test_friction_is_the_same_over_many_turns() -> None:
    friction, rate = 0.004, 20.0
    scene = sb.Scene("weightless", gravity=(0.0, 0.0, 0.0))
    arm = add_pendulum(scene, "arm", length=LENGTH, mass=MASS, rate=rate, friction=friction)
    times = np.arange(401) * 5e-3
    turned = angles(sb.simulate(scene, times, sb.Solver(h=2.5e-4)), arm)
    assert turned[-1] > 12 * math.pi
    assert rate * times - turned == approx(0.5 * friction / INERTIA * times**2, abs=2e-3)


def test_drag_lets_the_inverse_amplitude_grow_by_the_same_in_each_period() -> None:
    drag = 0.3 * INERTIA
    scene, arm = pendulum(angle=0.05, drag=drag)
    times = np.arange(2400) * 2e-3
    sizes = np.abs(turning_points(times, angles(sb.simulate(scene, times, sb.Solver(h=5e-4)), arm)))
    growth = np.diff(1.0 / np.concatenate([[0.05], sizes]))
    assert growth == approx(np.full(len(growth), 4.0 / 3.0 * drag / INERTIA), rel=0.02)


def test_friction_acts_between_the_two_arms() -> None:
    """Two arms that turn as one body: the lower hinge takes nothing. Its friction on the upper arm alone would."""
    body = {"mass": 0.1, "first_moment": 0.01, "inertia": 0.00125, "length": 0.2}
    scene = sb.Scene("double", gravity=(0.0, 0.0, 0.0))
    upper = add_arm(scene, "upper", rate=3.0, **body)
    add_arm(scene, "lower", pivot=upper, rate=3.0, friction=0.05, **body)
    times = np.arange(101) * 0.01
    rigid = angles(sb.simulate(scene, times, sb.Solver(h=5e-4)), upper)
    assert rigid == approx(3.0 * times, abs=2e-3)


def test_gradients_with_respect_to_friction_and_drag() -> None:
    body = {"mass": 0.1475, "first_moment": 0.0218, "inertia": 0.00333, "length": 0.2}
    scene = sb.Scene("double")
    upper = add_arm(scene, "upper", angle=0.9, rate=0.5, friction=2e-3, slip_angle=1e-3, drag=2e-5, **body)
    add_arm(scene, "lower", pivot=upper, angle=-0.4, rate=1.0, friction=1e-3, viscosity=5e-5, drag=1e-5, **body)
    report = sb.check_gradients(scene, np.arange(6) * 0.01, sb.Solver(h=1.25e-3))
    assert {row.name for row in report.rows} >= {
        f"{name}_{q}" for name in ("upper", "lower") for q in ("friction", "slip_angle", "drag")
    }
    assert report.passed, str(report)


def test_a_fit_says_what_a_slip_angle_that_nobody_measured_moves() -> None:
    """The elastic part of dry friction speeds small swings up, which a length takes for its own. A fit that takes the
    slip angle as given tells so, and one that does not is right."""
    times, solver = np.arange(301) * 0.02, sb.Solver(h=0.02 / 16)
    scene, arm = pendulum(angle=0.4, friction=1e-2, slip_angle=2e-4)
    noise = np.random.default_rng(3).normal(0.0, 2e-5, (len(times), 1, 3)) * (1.0, 0.0, 1.0)
    recording = sb.Recording(sb.simulate(scene, times, solver).positions[:, [arm.end]] + noise, times, markers=["end"])
    start, body = pendulum(angle=0.39, friction=8e-3, slip_angle=2e-3)
    options = {"sigma": 2e-5, "axes": "xz", "solver": solver, "markers": {"end": body.place(LENGTH)}}
    names = ["arm_length", "arm_friction", "arm_angle"]
    experiment = sb.Experiment(scene=start, recording=recording, **options)

    def found(*more: str) -> sb.Fit:
        return sb.fit([experiment], parameters=dict.fromkeys([*names, *more]), refine=None, profiles=False, windows=())

    given, fitted = found(), found("arm_slip_angle")
    (premise,) = (p for p in given.result.premises if p.name == "arm_slip_angle")
    off = given["arm_length"].value - LENGTH
    assert premise.words == "100 %" and off > given["arm_length"].half_width
    assert premise.moved["arm_length"] == approx(off, rel=0.7)  # to first order
    assert fitted["arm_length"].lower < LENGTH < fitted["arm_length"].upper
    assert fitted["arm_slip_angle"].lower < 2e-4 < fitted["arm_slip_angle"].upper


def test_a_twin_gives_its_friction_viscosity_and_drag_back() -> None:
    true = {"friction": 1e-2, "viscosity": 4e-3, "drag": 3e-3}
    scene, arm = pendulum(angle=1.4, **true)
    times, solver = np.arange(201) * 0.025, sb.Solver(h=0.025 / 16)
    rng = np.random.default_rng(2)
    motion = sb.simulate(scene, times, solver)
    measured = motion.positions[:, [arm.end]] + rng.normal(0.0, 1e-4, (len(times), 1, 3)) * (1.0, 0.0, 1.0)
    recording = sb.Recording(measured, times, markers=["end"])
    start, body = pendulum(angle=1.4, friction=5e-3, viscosity=2e-3, drag=1e-3)
    places = {"end": body.place(LENGTH)}
    options = {"sigma": 1e-4, "axes": "xz", "solver": solver}
    experiment = sb.Experiment(scene=start, recording=recording, markers=places, **options)
    names = ["arm_friction", "arm_hinge_viscosity", "arm_drag", "arm_angle"]
    found = sb.fit([experiment], parameters=dict.fromkeys(names), refine=None, profiles=False, windows=())
    for name, value in zip(names, (*true.values(), 1.4), strict=True):
        estimate = found[name]
        assert estimate.verdict == "identified" and estimate.lower < value < estimate.upper, str(estimate)
    assert found["arm_friction"].value == approx(true["friction"], rel=0.05)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"friction": 0.0}, "friction", "must be positive"),
        ({"friction": math.nan}, "friction", "must be positive"),
        ({"friction": 1e-3, "slip_angle": 0.0}, "slip_angle", "must be positive"),
        ({"drag": -1e-5}, "drag", "must be zero or more"),
    ],
)
def test_impossible_resistances_are_refused(change: dict, field: str, words: str) -> None:
    with pytest.raises(sb.SceneError, match=words) as caught:
        pendulum(**change)
    assert caught.value.field == f"arm.{field}" and caught.value.fix


def test_a_friction_hinge_needs_a_compliance_and_a_yield_angle() -> None:
    scene = sb.Scene("bare")
    nodes = scene.add_particles([(0, 0, 1), (0, 0, 0), (0, 0, -1), (0, 0, 0)], 1.0)
    hinge = {"kind": "friction_hinge", "particles": [nodes], "normal": (0, 1, 0)}
    for given, field, words in (
        ({"compliance": 0.0, "rest": [1e-3]}, "compliance", "never slide"),
        ({"compliance": 1.0}, "rest", "is missing"),
        ({"compliance": 1.0, "rest": [0.0]}, "rest", "must be positive"),
    ):
        with pytest.raises(sb.SceneError, match=words) as caught:
            scene.add_constraints(**hinge, **given)
        assert caught.value.field == f"friction_hinge.{field}" and caught.value.fix
