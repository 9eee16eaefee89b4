"""Rollouts of one particle, one link and two links against closed forms: forward values, and derivatives by tangents
and by the adjoint."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import integration, pendulums
from oracles.calculus import derivative
from pytest import approx
from support import observed_orders, period, place, sensitivity, slope_along, step_factor, steps, tangents, twice

G = 9.81
ORDERS = {1: "bdf1", 2: "bdf2"}
X, Y, Z = 0, 1, 2


def solver(h: float, order: int, method: str = "direct", iterations: int | None = None) -> sb.Solver:
    return sb.Solver(h=h, integrator=ORDERS[order], method=method, iterations=iterations)


# --- O-1: free fall


def falling() -> sb.Scene:
    scene = sb.Scene("fall")
    scene.add_particles([[0.0, 0.0, 0.3]], 2.0, velocity=[[0.1, 0.0, -1.5]])
    return scene


@pytest.mark.parametrize("order", [1, 2])
def test_free_fall(order):
    times = steps(0.01, 100)
    fall = sb.simulate(falling(), times, solver(0.01, order))
    expected = [-integration.free_fall(n, 0.01, G, -0.3, 1.5, order) for n in range(101)]
    assert fall.positions[:, 0, Z] == approx(expected, rel=1e-13, abs=1e-13)
    assert fall.positions[:, 0, X] == approx(0.1 * times, abs=1e-13)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("what", ["gravity", "velocity", "position", "mass"])
def test_free_fall_derivatives(order, what):
    scene, times = falling(), steps(0.01, 100)
    expected = {"gravity": integration.free_fall_dg(100, 0.01, order), "velocity": 1.0, "position": 1.0, "mass": 0.0}[
        what
    ]
    direction = {"mass": [1.0]} if what == "mass" else {what: [0.0, 0.0, 1.0]}
    both = sensitivity(scene, times, solver(0.01, order), place(101, scene, 100, 0, Z), direction)
    assert both == approx(twice(expected), rel=1e-12, abs=1e-13)


# --- O-2, 3: one spring


def spring(damping: float | None = None, stretch: float = 0.5, velocity: float = 0.0, mass: float = 1.0) -> sb.Scene:
    scene = sb.Scene("spring", gravity=(0.0, 0.0, 0.0))
    scene.add_particles(
        [[0.0, 0.0, 0.0], [1.0 + stretch, 0.0, 0.0]], mass, velocity=[[0.0, 0.0, 0.0], [velocity, 0.0, 0.0]]
    )
    scene.add_constraints("distance", [[0, 1]], name="spring", rest=1.0, compliance=1e-3, damping=damping)
    scene.pin([0])
    return scene


@pytest.mark.parametrize("h", [1 / 60, 1 / 240, 1 / 1000])
@pytest.mark.parametrize(
    ("method", "iterations"), [("direct", 1), ("direct", 2), ("gauss_seidel", 1), ("gauss_seidel", 5)]
)
def test_spring_is_backward_euler(h, method, iterations):
    s = solver(h, 1, method, iterations)
    scene, times = spring(), steps(h, 10)
    shown = sb.simulate(scene, times, s).positions[:, 1, X]
    assert shown == approx([1.0 + integration.spring_stretch(1e-3, 1.0, h, n, 0.5) for n in range(11)], abs=1e-13)

    weights = place(11, scene, 10, 1, X)
    by_compliance = integration.spring_stretch_dcompliance(1e-3, 1.0, h, 10, 0.5)
    share = integration.spring_stretch(1e-3, 1.0, h, 10, 1.0)
    for direction, expected in (
        ("spring_compliance", by_compliance),
        ({"mass": [0.0, 1.0]}, by_compliance * 1e-3),
        ({"rest": [1.0]}, 1.0 - share),
        ({"position": [0, 0, 0, 1, 0, 0]}, share),
    ):
        assert sensitivity(scene, times, s, weights, direction) == approx(twice(expected), rel=1e-10)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("iterations", [1, 5])
def test_damped_spring(order, iterations):
    h, count = 1 / 240, 25
    numbers = {"compliance": 1e-3, "damping": 5.0, "mass": 1.3, "stretch": 0.5, "velocity": -2.0}

    def stretch(**changes):
        return integration.damped_spring(**(numbers | changes), h=h, steps=count, order=order)

    s = solver(h, order, iterations=iterations)
    scene, times = spring(damping=5.0, velocity=-2.0, mass=1.3), steps(h, count)
    assert sb.simulate(scene, times, s).positions[:, 1, X] == approx(1.0 + stretch(), abs=1e-13)

    by_stretch = derivative(lambda u: stretch(stretch=u)[-1], 0.5)
    for direction, expected in (
        ("spring_compliance", derivative(lambda a: stretch(compliance=a)[-1], 1e-3)),
        ("spring_damping", derivative(lambda b: stretch(damping=b)[-1], 5.0)),
        ({"mass": [0.0, 1.0]}, derivative(lambda m: stretch(mass=m)[-1], 1.3)),
        ({"velocity": [0, 0, 0, 1, 0, 0]}, derivative(lambda v: stretch(velocity=v)[-1], -2.0)),
        ({"position": [0, 0, 0, 1, 0, 0]}, by_stretch),
        ({"rest": [1.0]}, 1.0 - by_stretch),
    ):
        both = sensitivity(scene, times, s, place(count + 1, scene, count, 1, X), direction)
        assert both == approx(twice(expected), rel=1e-8), direction


@pytest.mark.parametrize("order", [1, 2])
def test_spring_sag_and_its_force(order):
    """O-3b, O-5s: at rest the link carries the weight; the multiplier comes out as a force."""
    scene = sb.Scene("sag")
    scene.add_particles([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 2.0)
    scene.add_constraints("distance", [[0, 1]], name="spring", compliance=1e-3, damping=40.0)
    scene.pin([0])
    times, s = [0.0, 5.0], solver(1 / 100, order)
    rest = sb.simulate(scene, times, s)
    assert -rest.positions[-1, 1, Z] - 1.0 == approx(integration.spring_sag(1e-3, 2.0, G), rel=1e-11)
    assert rest.forces["spring"][-1, 0, 0] == approx(-2.0 * G, rel=1e-11)
    weights = -place(2, scene, 1, 1, Z)
    assert sensitivity(scene, times, s, weights, "spring_compliance") == approx(twice(2.0 * G), rel=1e-9)
    assert sensitivity(scene, times, s, weights, {"mass": [0.0, 1.0]}) == approx(twice(1e-3 * G), rel=1e-9)
    assert sensitivity(scene, times, s, weights, {"gravity": [0.0, 0.0, -1.0]}) == approx(twice(2e-3), rel=1e-9)


# --- O-4: order


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("omega_h", [0.05, 0.1, 0.5])
def test_amplification(order, omega_h):
    """After BDF2's second root has died out, every step multiplies the mode by z: numerical damping and frequency."""
    h = omega_h * math.sqrt(1e-3)
    motion = sb.simulate(spring(), steps(h, 90), solver(h, order)).positions[40:, 1, X] - 1.0
    z = integration.amplification(omega_h, order)
    assert step_factor(motion) == approx(z, abs=1e-10)


@pytest.mark.parametrize(("order", "tolerance"), [(1, 0.05), (2, 0.1)])
def test_order_of_value_and_derivative(order, tolerance):
    omega, end = math.sqrt(1e3), 0.1
    value = 1.0 + 0.5 * math.cos(omega * end)
    slope = 0.5 * math.sin(omega * end) * omega * end / (2.0 * 1e-3)
    errors = []
    for count in (800, 1600, 3200):
        h = end / count
        scene, s = spring(), solver(h, order)
        shown = sb.simulate(scene, [0.0, end], s).positions[-1, 1, X]
        forward, backward = sensitivity(scene, [0.0, end], s, place(2, scene, 1, 1, X), "spring_compliance")
        assert forward == approx(backward, rel=1e-9)
        errors.append((shown - value, backward - slope))
    for column in np.transpose(errors):
        assert observed_orders(column) == approx(order, abs=tolerance)


# --- O-7, 7b: pendulum


def pendulum(amplitude: float, length: float = 1.0, mass: float = 1.0) -> sb.Scene:
    scene = sb.Scene("pendulum")
    scene.add_particles([[0.0, 0.0, 0.0], [length * math.sin(amplitude), 0.0, -length * math.cos(amplitude)]], mass)
    scene.add_constraints("distance", [[0, 1]], name="arm", rest=length)
    scene.pin([0])
    return scene


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("method", "iterations"), [("direct", 1), ("direct", 2), ("gauss_seidel", 4)])
def test_pendulum_is_its_discrete_program(order, method, iterations):
    amplitude, h = math.radians(60), 1 / 120
    motion = sb.simulate(pendulum(amplitude), steps(h, 240), solver(h, order, method, iterations))
    x, v = pendulums.pendulum_steps(1.0, G, amplitude, h, 240, order)
    assert motion.positions[:, 1, [X, Z]] == approx(x, abs=1e-11)
    assert motion.velocities[:, 1, [X, Z]] == approx(v, abs=1e-9)


@pytest.mark.parametrize(
    ("order", "h", "error"),
    [
        (1, 1 / 60, 2.2e-3),
        (1, 1 / 600, 3.3e-4),
        (1, 1 / 6000, 3.4e-5),
        (2, 1 / 60, 1.2e-3),
        (2, 1 / 240, 7.3e-5),
        (2, 1 / 600, 1.2e-5),
    ],
)
def test_pendulum_period(order, h, error):
    amplitude = math.radians(30)
    times = steps(h, round(1.8 / h))
    motion = sb.simulate(pendulum(amplitude), times, solver(h, order)).positions[:, 1, X]
    exact = pendulums.pendulum_period(1.0, G, amplitude)
    assert abs(period(times, motion) / exact - 1.0) <= 1.1 * error


@pytest.mark.parametrize("order", [1, 2])
def test_pendulum_period_derivatives(order):
    """dT/dL = T/(2L), dT/dg = -T/(2g), and no trace of the mass beyond the rounding of a position of 1 m."""
    amplitude, h = math.radians(30), 1 / 1200
    scene, times, s = pendulum(amplitude), steps(h, 2160), solver(h, order)
    motion = sb.simulate(scene, times, s).positions[:, 1, X]
    exact = pendulums.pendulum_period(1.0, G, amplitude)

    def by(direction):
        return slope_along(lambda x: period(times, x), motion, tangents(scene, times, s, direction)[:, 1, X])

    tolerance = {1: 1e-3, 2: 1e-5}[order]
    whole = {"rest": [1.0], "position": [0, 0, 0, math.sin(amplitude), 0, -math.cos(amplitude)]}
    assert by(whole) == approx(exact / 2.0, rel=tolerance)
    assert by({"gravity": [0.0, 0.0, -1.0]}) == approx(-exact / (2.0 * G), rel=tolerance)
    assert np.max(np.abs(tangents(scene, times, s, {"mass": [0.0, 1.0]}))) <= 1e-16


def test_pendulum_derivatives_of_the_discrete_program():
    amplitude, h, count = math.radians(60), 1 / 120, 200
    scene, times = pendulum(amplitude), steps(1 / 120, 200)
    whole = {"rest": [1.0], "position": [0, 0, 0, math.sin(amplitude), 0, -math.cos(amplitude)]}
    for order in ORDERS:

        def tip(length, g, order=order):
            return pendulums.pendulum_steps(length, g, amplitude, h, count, order)[0][-1, 0]

        weights = place(count + 1, scene, count, 1, X)
        by_length, by_g = derivative(lambda a: tip(a, G), 1.0), derivative(lambda g: tip(1.0, g), G)
        assert sensitivity(scene, times, solver(h, order), weights, whole) == approx(twice(by_length), rel=1e-8)
        assert sensitivity(scene, times, solver(h, order), weights, {"gravity": [0, 0, -1.0]}) == approx(
            twice(by_g), rel=1e-8
        )


@pytest.mark.parametrize(
    ("order", "h", "retained"),
    [
        (1, 1 / 60, 0.467),
        (1, 1 / 600, 0.924),
        (1, 1 / 6000, 0.992),
        (2, 1 / 60, 0.9944),
        (2, 1 / 240, 0.99973),
        (2, 1 / 600, 0.99996),
    ],
)
def test_pendulum_energy(order, h, retained):
    amplitude, count = math.radians(30), round(4.2 / h)
    motion = sb.simulate(pendulum(amplitude), steps(h, count), solver(h, order))
    x, v = motion.positions[:, 1, [X, Z]], motion.velocities[:, 1, [X, Z]]
    energy = pendulums.energy_retained(x, v, 1.0, G)
    assert energy[-1] == approx(retained, abs=0.005)
    assert energy == approx(
        pendulums.energy_retained(*pendulums.pendulum_steps(1.0, G, amplitude, h, count, order), 1.0, G), abs=1e-9
    )
    if order == 1:
        assert np.all(np.diff(energy) <= 1e-12)


# --- O-12: charged dumbbell


@pytest.mark.parametrize("order", [1, 2])
def test_charged_dumbbell(order):
    """The field's forces make each half a pendulum of length L/2 in the gravity qE/m, about the middle, which stays."""
    charge, field, mass, length, amplitude, h = 1e-6, 1e5, 1e-3, 0.1, math.radians(20), 1e-4
    half = 0.5 * length * np.array([math.cos(amplitude), math.sin(amplitude), 0.0])
    scene = sb.Scene("dumbbell", gravity=(0.0, 0.0, 0.0))
    scene.add_particles([half, -half], mass)
    scene.add_constraints("distance", [[0, 1]], name="link")
    pull = np.array([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]])
    scene.add_force([0, 1], charge * field * pull)
    times, s = steps(h, 1300), solver(h, order)
    motion = sb.simulate(scene, times, s).positions
    x, _ = pendulums.pendulum_steps(length / 2, charge * field / mass, amplitude, h, 1300, order)
    assert motion[:, 0, Y] == approx(x[:, 0], abs=1e-11)
    assert motion[:, 1] == approx(-motion[:, 0], abs=1e-12)

    exact = pendulums.dumbbell_period(charge, field, mass, length, amplitude)
    tolerance = {1: 2e-3, 2: 1e-5}[order]
    assert period(times, motion[:, 0, Y]) == approx(exact, rel=tolerance)

    def by(direction):
        return slope_along(lambda y: period(times, y), motion[:, 0, Y], tangents(scene, times, s, direction)[:, 0, Y])

    assert by({"force": field * pull}) == approx(-exact / (2 * charge), rel=tolerance)
    assert by({"rest": [1.0], "position": np.stack([half, -half]) / length}) == approx(
        exact / (2 * length), rel=tolerance
    )
    assert by({"mass": [1.0, 1.0]}) == approx(exact / (2 * mass), rel=tolerance)


# --- O-13: free rotor


@pytest.mark.parametrize(("method", "iterations"), [("direct", 1), ("direct", 3), ("gauss_seidel", 2)])
def test_free_rotor(method, iterations):
    omega, h, radius, drift = 10.0, 0.01, 0.5, np.array([0.3, 0.0, 0.1])
    start = np.array([[radius, 0.0, 0.0], [-radius, 0.0, 0.0]])
    spin = np.array([[0.0, radius, 0.0], [0.0, -radius, 0.0]])
    scene = sb.Scene("rotor", gravity=(0.0, 0.0, 0.0))
    scene.add_particles(start, 0.7, velocity=omega * spin + drift)
    scene.add_constraints("distance", [[0, 1]], name="link")
    s, times = solver(h, 1, method, iterations), steps(h, 30)
    motion = sb.simulate(scene, times, s)
    middle = motion.positions.mean(axis=1, keepdims=True)
    arm, speed = motion.positions - middle, motion.velocities - motion.velocities.mean(axis=1, keepdims=True)
    angles = np.unwrap(np.arctan2(arm[:, 0, Y], arm[:, 0, X]))
    assert np.diff(angles) == approx(integration.rotor_angles(omega * h, 30), abs=1e-12)
    momentum = np.cross(arm, speed).sum(axis=1)[:, Z] / (2 * radius**2 * omega)
    assert momentum[1:] == approx(integration.rotor_momentum(omega * h, 30), abs=1e-11)
    assert motion.velocities.mean(axis=1) == approx(np.broadcast_to(drift, (31, 3)), abs=1e-13)

    a = math.atan(omega * h)
    expected = radius * math.cos(a) * h / (1.0 + (omega * h) ** 2)
    both = sensitivity(scene, times[:2], s, place(2, scene, 1, 0, Y), {"velocity": spin})
    assert both == approx(twice(expected), rel=1e-12)


# --- O-14: double pendulum


def double_pendulum() -> sb.Scene:
    scene = sb.Scene("double pendulum")
    scene.add_particles([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], 1.0)
    scene.add_constraints("distance", [[0, 1], [1, 2]], name="arms")
    scene.pin([0])
    return scene


@pytest.mark.parametrize("end", [0.25, 0.5, 1.0])
@pytest.mark.parametrize(("order", "counts", "tolerance"), [(1, (4000, 8000), 0.06), (2, (400, 800), 0.1)])
def test_double_pendulum(end, order, counts, tolerance):
    tip = pendulums.double_pendulum_tip(end, G)
    by_length = derivative(lambda a: pendulums.double_pendulum_tip(end, G, lengths=(a, 1.0)), 1.0)
    by_mass = derivative(lambda m: pendulums.double_pendulum_tip(end, G, masses=(1.0, m)), 1.0)
    errors = []
    for count in counts:
        scene, s, times = double_pendulum(), solver(end / count, order), [0.0, end]
        shown = sb.simulate(scene, times, s).positions[-1, 2, [X, Z]]
        length = {"rest": [1.0, 0.0], "position": [0, 0, 0, 1, 0, 0, 1, 0, 0]}
        slopes = [tangents(scene, times, s, d)[-1, 2, [X, Z]] for d in (length, {"mass": [0.0, 0.0, 1.0]})]
        both = sensitivity(scene, times, s, place(2, scene, 1, 2, Z), length)
        assert both == approx(twice(slopes[0][1]), rel=1e-9)
        errors.append(
            [np.linalg.norm(shown - tip), np.linalg.norm(slopes[0] - by_length), np.linalg.norm(slopes[1] - by_mass)]
        )
    # Extrapolation to h = 0 meets the reference: the error itself falls with the order.
    for coarse, fine in zip(*errors, strict=True):
        assert observed_orders([coarse, fine]) == approx(order, abs=tolerance)


def test_double_pendulum_loses_energy_only():
    h = 1 / 500
    motion = sb.simulate(double_pendulum(), steps(h, 1000), solver(h, 1))
    energy = 0.5 * (motion.velocities**2).sum(axis=(1, 2)) + G * motion.positions[:, :, Z].sum(axis=1)
    assert np.all(np.diff(energy) <= 1e-9)
