"""Limits of hinges and sliders: the law of a stop, where it lets a joint rest, and what a motion shows of it."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

MASS, BELOW, G = 0.3, 0.1, 9.81  # kg; m from the hinge to the center of mass; m/s^2
BAR = sb.Inertia.box(MASS, (0.2, 0.02, 0.02))
MOMENT = float(BAR.matrix[1, 1]) + MASS * BELOW**2  # kg m^2 about the hinge
SOLVER = sb.Solver(h=1e-3)


def pendulum(g: float = G, **options: object) -> tuple[sb.Scene, sb.Joint]:
    """A bar on a hinge at its end, given as it points along x; its angle grows as it falls."""
    scene = sb.Scene("pendulum", gravity=(0.0, 0.0, -g))
    bar = scene.add_body("bar", of=BAR, at=(BELOW, 0.0, 0.0))
    return scene, sb.hinge(None, bar, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), **options)  # type: ignore[arg-type]


def carriage(**options: object) -> tuple[sb.Scene, sb.Body]:
    """A weight that falls along a vertical line."""
    scene = sb.Scene("carriage")
    body = scene.add_body("weight", of=BAR, rotation=(0.1, 0.2, -0.3))
    sb.slider(None, body, at=(0.01, 0.02, 0.0), axis=(0.0, 0.0, 1.0), **options)  # type: ignore[arg-type]
    return scene, body


def ramp(beyond: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """q and its slope, as joint_stops.h says."""
    t = np.maximum(beyond, 0.0)
    s = np.minimum(t / depth, 1.0)
    return depth * (s**2 - s**3 / 3.0) + np.maximum(t - depth, 0.0), s * (2.0 - s)


def energies(
    scene: sb.Scene, joint: sb.Joint, motion: sb.Trajectory, high: float, k: float, depth: float
) -> np.ndarray:
    q, _ = ramp(joint.angle(motion) - high, depth)
    return scene.bodies["bar"].energy(motion) + 0.5 * k * q**2


@pytest.mark.parametrize("depth", [1e-3, 0.02])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_pendulum_rests_on_a_stop_where_torques_balance(depth: float, side: float) -> None:
    """k q q' = m g l cos(angle)."""
    k = 20.0
    limits = (-0.1, 0.6) if side > 0 else (-0.6, 0.1)
    scene = sb.Scene("rests")
    bar = scene.add_body("bar", of=BAR, at=(BELOW, 0.0, 0.0))
    options = {"limits": limits, "limit_stiffness": k, "limit_depth": depth, "viscosity": 0.05}
    joint = sb.hinge(None, bar, at=(0.0, 0.0, 0.0), axis=(0.0, side, 0.0), **options)  # type: ignore[arg-type]
    motion = sb.simulate(scene, [0.0, 4.0], SOLVER)
    shape = sb.equilibrium(scene, motion.nodes[-1])
    low, high = 0.6, 0.7
    for _ in range(200):  # by bisection
        angle = 0.5 * (low + high)
        q, slope = ramp(np.array(angle - 0.6), depth)
        low, high = (low, angle) if k * q * slope > MASS * G * BELOW * np.cos(angle) else (angle, high)
    assert angle - 0.6 > 0.01
    assert side * joint.angle(motion)[-1] == pytest.approx(angle, abs=1e-9)
    assert side * joint.angle(shape.nodes) == pytest.approx(angle, abs=1e-9)


def test_a_carriage_rests_on_a_stop_where_forces_balance() -> None:
    scene, body = carriage(limits=(-0.05, 0.1), limit_stiffness=2000.0, limit_damping=20.0, limit_depth=1e-3)
    motion = sb.simulate(scene, [0.0, 2.0], SOLVER)
    fallen = body.pose(motion)[0][:, 2]
    assert fallen[-1] - fallen[0] == pytest.approx(-0.05 - 1e-3 / 3.0 - MASS * G / 2000.0, abs=1e-9)


@pytest.mark.parametrize(("method", "integrator"), [("direct", "bdf2"), ("direct", "bdf1"), ("implicit", "bdf2")])
@pytest.mark.parametrize(("damping", "depth"), [(None, 1e-3), (None, 0.02), (0.1, 0.02)])
def test_a_bounce_takes_energy_and_never_gives_any(
    method: str, integrator: str, damping: float | None, depth: float
) -> None:
    scene, joint = pendulum(limits=(-2.0, 0.6), limit_damping=damping, limit_depth=depth)
    k = scene.quantities["hinge_limit_stiffness"].value
    assert k == pytest.approx(MOMENT * (np.pi / 0.02) ** 2)
    solver = sb.Solver(h=5e-4, method=method, integrator=integrator)
    motion = sb.simulate(scene, np.arange(1201) * 5e-4, solver)
    energy = energies(scene, joint, motion, 0.6, k, depth)
    fall = MASS * G * BELOW * np.sin(0.6)
    angle = joint.angle(motion)
    assert 0.62 < angle.max() < 0.68  # it has touched, at 9 rad/s
    assert angle[np.argmax(angle) :].min() < 0.59  # and has left
    assert energy.max() - energy[0] < 1e-3 * fall
    kept = (energy[-1] - energy[0]) / fall
    if damping is None and integrator == "bdf2":
        assert abs(kept) < 0.01
    elif damping is not None:
        assert kept < -0.15


def test_the_range_may_lie_anywhere_on_the_circle() -> None:
    """A rate of 6 rad/s without weight, from 0 to limits beyond half a turn."""
    scene, joint = pendulum(g=0.0, limits=(-0.5, 4.0), rate=6.0)
    motion = sb.simulate(scene, np.arange(161) * 0.01, SOLVER)
    turned = np.unwrap(joint.angle(motion))
    assert 4.0 < turned.max() < 4.0 + 6.0 * 0.02
    assert -0.5 - 6.0 * 0.02 < turned.min() < -0.5
    assert np.argmax(turned) == pytest.approx(68, abs=2)


LEFT = 0.06  # s, when a pendulum that starts with 6 rad/s has left the stop at 0.1 rad again


@pytest.mark.parametrize("method", ["direct", "implicit", "gauss_seidel"])
@pytest.mark.parametrize("depth", [1e-3, 0.02])
def test_gradients_through_a_touch_are_exact(method: str, depth: float) -> None:
    damping = None if depth < 0.01 else 0.05
    scene, joint = pendulum(rate=6.0, limits=(-1.0, 0.1), limit_damping=damping, limit_depth=depth)
    solver = sb.Solver(h=2e-3, method=method)
    motion = sb.simulate(scene, np.arange(0.0, LEFT + 1e-9, 2e-3), solver)
    assert joint.angle(motion).max() > 0.12 and joint.angle(motion)[-1] < 0.1
    report = sb.check_gradients(scene, [LEFT], solver, samples=2)
    assert report.passed, str(report)
    felt = {row.name: row for row in report.rows if not row.unfelt}
    wanted = {"hinge_limit_high", "hinge_limit_stiffness", "hinge_limit_depth", "hinge_lower_x", "bar_mass"}
    wanted |= {"bar_inertia_2"} | ({"hinge_limit_damping"} if damping else set())
    assert wanted <= felt.keys()
    assert "hinge_limit_low" not in felt


def test_the_gradient_of_a_slider_through_a_touch_is_exact() -> None:
    scene, body = carriage(limits=(-0.05, 0.1), limit_damping=5.0)
    times = [0.1, 0.112, 0.2]
    z = body.pose(sb.simulate(scene, [0.0, *times], sb.Solver(h=2e-3)))[0][:, 2]
    assert z[2] - z[0] < -0.05 < z[3] - z[0]
    report = sb.check_gradients(scene, times, sb.Solver(h=2e-3), samples=2)
    assert report.passed, str(report)


def test_the_gradient_with_respect_to_a_limit_is_the_slope_of_the_motion() -> None:
    """Also where the substep in which the stop is met changes; between the ends of the secant it does so four times."""
    scene, joint = pendulum(limits=(-1.0, 0.6), limit_depth=0.1)
    at = 0.37
    solver = sb.Solver(h=1e-3)

    def angle(high: float) -> float:
        return float(joint.angle(sb.simulate(scene, [at], solver, {"hinge_limit_high": high}))[0])

    limits = np.linspace(0.58, 0.62, 9)
    secant = (angle(0.62) - angle(0.58)) / 0.04
    slopes = [(angle(a + 1e-6) - angle(a - 1e-6)) / 2e-6 for a in limits]
    assert max(abs(np.array(slopes) / np.mean(slopes) - 1.0)) < 0.1
    assert np.mean(slopes) == pytest.approx(secant, rel=0.05)


@pytest.mark.parametrize("method", ["direct", "implicit"])
def test_between_its_limits_a_joint_moves_as_without_them(method: str) -> None:
    times, solver = np.arange(21) * 0.01, sb.Solver(h=2e-3, method=method)
    free = sb.simulate(pendulum()[0], times, solver)
    held = sb.simulate(pendulum(limits=(-0.5, 2.5), limit_damping=0.1)[0], times, solver)
    assert free.positions[-1, 0, 2] < -0.05
    assert np.abs(held.nodes - free.nodes).max() < 1e-14
    slides = sb.simulate(carriage()[0], times, solver)
    assert np.abs(sb.simulate(carriage(limits=(-1.0, 1.0))[0], times, solver).nodes - slides.nodes).max() < 1e-14


SOFT = {"limit_damping": 0.05, "limit_depth": 0.1}


def swings(noise: float, high: float, until: float = 1.0) -> tuple[sb.Recording, list[list[float]]]:
    """Two markers on the bar of a pendulum that meets its stop at `high`, in noise of so many meters."""
    scene, _ = pendulum(limits=(-2.0, high), limit_stiffness=60.0, **SOFT)
    points = [[0.1, 0.0, 0.0], [0.0, 0.0, 0.02]]
    times = np.arange(round(until * 100) + 1) / 100
    origin, frame = scene.bodies["bar"].pose(sb.simulate(scene, times, sb.Solver(h=5e-4)))
    seen = origin[:, None] + np.einsum("fij,kj->fki", frame, points)
    return sb.Recording(seen + noise * np.random.default_rng(3).standard_normal(seen.shape), times), points


def fitted(recording: sb.Recording, points: list[list[float]], names: list[str], high: float) -> sb.Fit:
    scene, _ = pendulum(limits=(-2.0, high), limit_stiffness=40.0, **SOFT)
    places = sb.on_body(scene.bodies["bar"], points)
    return sb.fit(scene, recording, names, markers=places, solver=sb.Solver(h=1e-3), start_time=0.0, sigma=5e-4)


def test_a_fit_finds_the_limit_and_the_stiffness_of_a_stop() -> None:
    fit = fitted(*swings(5e-4, 0.6), ["hinge_limit_high", "hinge_limit_stiffness"], 0.65)
    limit, stiffness = fit.result.estimates
    assert limit.verdict == stiffness.verdict == "identified", fit.report()
    assert limit.lower < 0.6 < limit.upper
    assert limit.half_width < 0.01
    assert stiffness.lower < 60.0 < stiffness.upper


def test_a_stop_that_is_never_reached_is_not_identified() -> None:
    """The pendulum swings to 2.9 rad at most in this time; the recording says nothing of a limit of 3.1 rad."""
    recording, points = swings(5e-4, 3.1, until=0.3)
    fit = fitted(recording, points, ["hinge_limit_high", "hinge_limit_stiffness", "bar_center_x"], 3.1)
    verdicts = {e.name: e.verdict for e in fit.result.estimates}
    assert verdicts["bar_center_x"] == "identified", fit.report()
    for name in ("hinge_limit_high", "hinge_limit_stiffness"):
        assert verdicts[name] in ("not identifiable", "one-sided"), fit.report()


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"limits": (0.5, -0.5)}, r"hinge.limits: are not a range.*give \(low, high\)"),
        ({"limits": (0.5, 0.5)}, "are not a range"),
        ({"limits": (0.2, 0.5)}, "do not include 0.*0.2 rad outside"),
        ({"limits": (-0.5, -0.1)}, "do not include 0.*0.1 rad outside"),
        ({"limits": (-4.0, 4.0)}, "a whole turn or more"),
        ({"limits": (-1.0,)}, "hinge.limits"),
        ({"limits": (-1.0, float("nan"))}, "hinge.limits"),
        ({"limit_stiffness": 3.0}, "hinge.limit_stiffness: acts at limits, and there are none"),
        ({"limit_damping": 3.0}, "hinge.limit_damping: acts at limits"),
        ({"limit_depth": 3.0}, "hinge.limit_depth: acts at limits"),
        ({"limits": (-1, 1), "limit_stiffness": 0.0}, "hinge.limit_stiffness: must be positive.*N m/rad"),
        ({"limits": (-1, 1), "limit_damping": -1.0}, "hinge.limit_damping: must be zero or more"),
        ({"limits": (-1, 1), "limit_depth": float("inf")}, "hinge.limit_depth: must be positive"),
        ({"limits": (-1, 1), "limit_depth": 0.0}, "hinge.limit_depth: must be positive.*give it in rad"),
    ],
)
def test_bad_limits_are_refused(options: dict[str, object], match: str) -> None:
    with pytest.raises(sb.SceneError, match=match):
        pendulum(**options)


def test_values_that_make_no_range_are_refused() -> None:
    scene, _ = pendulum(limits=(-0.5, 0.5))
    with pytest.raises(sb.SceneError, match=r"hinge_limit"):
        sb.simulate(scene, [0.1], SOLVER, {"hinge_limit_low": 0.7})


def test_extrapolation_in_time_refuses_limits() -> None:
    scene, _ = pendulum(limits=(-0.5, 0.5))
    with pytest.raises(sb.InputError, match="joints with limits"):
        sb.simulate(scene, [0.1], sb.Solver(h=1e-3, extrapolate=2))
