"""Forces at supports over time: closed forms, the sensor's own numbers, and fits."""

import math

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.optimize import brentq

G = 9.81
DOWN = (0.0, 0.0, -G)


def pendulum(angle: float = 0.0, mass: float = 0.3, length: float = 0.5, compliance: float = 0.0) -> sb.Scene:
    """A mass on a link at the origin; the pivot's own mass must not count."""
    scene = sb.Scene("pendulum", DOWN)
    tip = [length * math.sin(angle), 0.0, -length * math.cos(angle)]
    pair = scene.add_particles([[0.0, 0.0, 0.0], tip], [7.0, mass])
    scene.pin([pair[0]])
    scene.add_constraints("distance", [pair], compliance=compliance, name="link")
    return scene


def lifted(times: np.ndarray, height: np.ndarray) -> sb.Scene:
    """A rope that hangs straight from a grip that follows a height over time."""
    scene = sb.Scene("rope", DOWN)
    built = sb.add_rope(
        scene, length=1.0, segments=10, density=0.2, EA=200.0, stretch_damping=0.02, direction=(0, 0, -1)
    )
    scene.drive([built.particles[0]], times, np.stack([0 * height, 0 * height, height], 1)[:, None])
    return scene


@pytest.mark.parametrize(
    ("method", "compliance"), [("direct", 0.0), ("gauss_seidel", 0.0), ("newton", 1e-4), ("implicit", 1e-4)]
)
def test_a_hanging_mass_weighs_what_it_weighs(method: str, compliance: float) -> None:
    solver, times = sb.Solver(h=1e-3, method=method), [0.02, 0.1, 0.3]
    read = sb.simulate_forces(pendulum(compliance=compliance), times, [0], solver, start="equilibrium")
    assert read.forces == approx(np.tile([0.0, 0.0, 0.3 * G], (3, 1)), abs=1e-9)
    body = sb.simulate_forces(pendulum(compliance=compliance), times, [0], solver, reads="body", start="equilibrium")
    assert body.forces == approx(-read.forces, abs=1e-12)


def test_the_tension_of_a_pendulum_is_that_of_its_energy() -> None:
    start, times = 1.0, np.linspace(0.05, 1.2, 24)
    solver = sb.Solver(h=2.5e-4)
    read = sb.simulate_forces(pendulum(start), times, [0], solver)
    tip = sb.simulate(pendulum(start), times, solver).positions[:, 1]
    cosine = -tip[:, 2] / 0.5
    tension = 0.3 * G * (3.0 * cosine - 2.0 * math.cos(start))  # m g cos + m l omega^2, omega^2 from the energy
    assert read.forces == approx(-tension[:, None] * tip / 0.5, abs=2e-4 * 0.3 * G)
    assert read.torques == approx(0.0, abs=1e-12)


def test_the_end_force_of_a_catenary() -> None:
    """T = (mu g a, mu g L/2) with L = 2 a sinh(d/2a): the link at the support counts whole."""
    span, length, density, segments = 0.8, 1.0, 0.15, 40
    a = brentq(lambda a: 2 * a * math.sinh(span / (2 * a)) - length, 0.1, 10.0)
    scene = sb.Scene("catenary", DOWN)
    x = np.linspace(0.0, span, segments + 1)
    points = np.stack([x, 0 * x, a * (np.cosh((x - span / 2) / a) - np.cosh(span / (2 * a)))], 1)
    built = sb.add_rope(scene, length=length, points=points, segments=segments, density=density)
    scene.pin(built.particles[[0, -1]])
    weight, pull = density * G * length / 2, density * G * a
    off = []
    for h in (1e-3, 5e-4):
        ends = [
            sb.simulate_forces(scene, [0.02], ("rope", end), sb.Solver(h=h), start="equilibrium").forces[0]
            for end in ("start", "end")
        ]
        assert ends[0] == approx([-pull, 0.0, weight], rel=2e-3, abs=1e-6)
        assert ends[1] == approx([pull, 0.0, weight], rel=2e-3, abs=1e-6)
        off.append(abs(ends[0][2] - weight))
    assert off[0] < 1e-4 * weight
    assert off[0] / off[1] == approx(4.0, rel=0.2)  # of second order in the step, and nothing of the mesh


def test_an_accelerated_grip_feels_the_inertia_of_the_whole_rope() -> None:
    times = np.linspace(0.0, 1.0, 101)
    scene = lifted(times, 0.5 * 2.0 * times**2)
    read = sb.simulate_forces(scene, np.linspace(0.7, 0.95, 26), ("rope", "start"), sb.Solver(h=1e-3))
    assert read.forces[:, 2] == approx(0.2 * (G + 2.0), rel=1e-4)
    assert read.forces[:, :2] == approx(0.0, abs=1e-9)


def cantilever(density: float = 0.1, length: float = 0.4) -> sb.Scene:
    """A rod that a grip holds level; stiff, so that it sags by a thousandth of its length."""
    scene = sb.Scene("cantilever", DOWN)
    grip = sb.Grip.fixed([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    sb.add_rod(scene, "rod", length=length, segments=16, density=density, EI=0.5, GJ=0.4, EA=1e4, start=grip)
    return scene


TURN = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))  # the sensor's x axis along the world's y


def test_the_torque_at_a_clamp_and_what_a_sensor_makes_of_it() -> None:
    weight, length = 0.1 * G * 0.4, 0.4
    times, solver = [0.02, 0.04], sb.Solver(h=2.5e-4)
    plain = sb.simulate_forces(cantilever(), times, ("rod", "start"), solver, start="equilibrium")
    assert plain.forces == approx(np.tile([0.0, 0.0, weight], (2, 1)), abs=2e-5)
    # The support's torque on the body about y carries the weight at half the length.
    assert plain.torques == approx(np.tile([0.0, -weight * length / 2, 0.0], (2, 1)), abs=2e-3 * weight * length)

    scene = cantilever()
    told = {
        "quaternion": TURN,
        "arm": (0.0, 0.1, 0.0),
        "bias": True,
        "torque_bias": True,
        "tool": True,
        "name": "wrist",
    }
    made = sb.ForceSensor(recording=plain, at=("rod", "start"), sigma=0.01, torque_sigma=1e-3, **told)
    made.declare(scene)
    values = {"wrist_tool_mass": 0.5, "wrist_tool_center_x": 0.03, "wrist_bias_y": 0.2, "wrist_torque_bias_z": -0.04}
    read = sb.simulate_forces(scene, times, ("rod", "start"), solver, values, start="equilibrium", **told)
    # In the sensor's axes the world's x is -y, and y is x; the arm along its y points to the world's -x.
    force = np.array([0.0, 0.0, weight + 0.5 * G])
    torque = np.array([-weight * (length / 2 + 0.1), 0.0, 0.0]) + np.cross([0.03, 0.0, 0.0], [0.0, 0.0, 0.5 * G])
    assert read.forces == approx(np.tile(force + np.array([0.0, 0.2, 0.0]), (2, 1)), abs=2e-5)
    assert read.torques == approx(np.tile(torque + np.array([0.0, 0.0, -0.04]), (2, 1)), abs=2e-3 * weight * length)


def test_a_mean_over_samples_and_a_shifted_clock() -> None:
    start, solver = 1.0, sb.Solver(h=1e-3)
    times = np.linspace(0.1, 0.8, 15)
    fine = sb.simulate_forces(pendulum(start), np.arange(0.05, 0.82, 1e-3), [0], solver)
    mean = sb.simulate_forces(pendulum(start), times, [0], solver, average=0.02)
    for t, f in zip(times, mean.forces, strict=True):
        inside = (fine.times > t - 0.02) & (fine.times < t + 1e-9)
        assert f == approx(fine.forces[inside].mean(axis=0), abs=0.02)
    scene = pendulum(start)
    scene.add_quantity("force_time_offset", 0.0, "s", positive=False)
    late = sb.simulate_forces(scene, times, [0], solver, {"force_time_offset": 0.013}, time_offset=True)
    assert late.forces == approx(sb.simulate_forces(pendulum(start), times + 0.013, [0], solver).forces, abs=1e-9)


def test_a_cloth_hangs_on_the_sum_of_its_upper_edge() -> None:
    """Six vertices hold it; each counts with its own mass, and the torque is that of the weight."""
    scene = sb.Scene("sheet", DOWN)
    mesh = sb.mesh.grid(0.3, 0.2, 5, 4, pattern="one_way")
    upright = mesh.vertices[:, [0, 2, 1]]
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=300.0, shear=60.0, bending=1e-4, positions=upright)
    top = cloth.particles[mesh.sets["top"]]
    scene.pin(top)
    solver = sb.Solver(h=5e-4, method="newton")
    read = sb.simulate_forces(scene, [0.01, 0.02], top.tolist(), solver, start="equilibrium")
    weight = 0.2 * 0.3 * 0.2 * G
    arm = 0.15 - upright[mesh.sets["top"][0], 0]
    assert read.forces == approx(np.tile([0.0, 0.0, weight], (2, 1)), abs=2e-4 * weight)
    assert read.torques == approx(np.tile([0.0, -arm * weight, 0.0], (2, 1)), abs=3e-4 * weight * 0.3)
