"""Rods with frames in implicit substeps: the motion of `direct`, twist, contact with friction, and gradients."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from oracles import rods
from scipy.spatial.transform import Rotation
from support import observed_orders

LENGTH, DENSITY, EI, GJ = 0.5, 0.05, 1e-3, 0.8e-3
G = 9.81


def implicit(h: float, integrator: str = "bdf2") -> sb.Solver:
    return sb.Solver(h=h, method="implicit", integrator=integrator)


def swinging(segments: int = 8, **options) -> sb.Scene:
    """A hanging rod whose grips move and turn."""
    times = np.linspace(0.0, 0.5, 51)
    ease = np.sin(np.pi * times)[:, None] ** 2
    held = Rotation.from_rotvec(ease * (0.3, 0.5, 1.2))
    start = sb.Grip.from_poses(
        times, 0.1 * ease * (1, 1, 0), (held * Rotation.from_rotvec([0.0, np.pi / 2, 0.0])).as_quat()
    )
    back = (held.inv() * Rotation.from_rotvec([0.0, -np.pi / 2, 0.0])).as_quat()
    end = sb.Grip.from_poses(times, (0.25, 0, 0) - 0.05 * ease * (0, 1, 1), back)
    points = [[0, 0, 0], [0.01, 0, -0.1], [0.125, 0, -0.2], [0.24, 0, -0.1], [0.25, 0, 0]]
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "bend_damping": 0.02, "points": points} | options
    return sb.rod(LENGTH, segments, start=start, end=end, **given)


@pytest.mark.parametrize("options", [{}, {"EA": 1e3}, {"GA": 200.0}], ids=["", "stretches", "shears"])
def test_a_rod_moves_as_in_direct(options):
    """Both go to one limit as the substep gets shorter, `implicit` to the second order."""
    scene = swinging(**options)
    start, ends = sb.equilibrium(scene).nodes, {}
    for method in ("direct", "implicit"):
        ends[method] = [
            sb.simulate(scene, [0.4], sb.Solver(h=1 / rate, method=method), start=start).positions[0, :9]
            for rate in (200, 400, 800)
        ]
    apart = [np.abs(a - b).max() for a, b in zip(ends["direct"], ends["implicit"], strict=True)]
    assert apart[0] < 1e-3 * LENGTH
    assert observed_orders(apart).min() > 0.9
    assert observed_orders([np.abs(a - b).max() for a, b in pairwise(ends["implicit"])]).min() > 1.7


def rolled() -> sb.Scene:
    """A rod held straight and taut, whose end is rolled at 20 rad/s."""
    times = np.linspace(0.0, 0.2, 101)
    turn = np.stack([np.zeros(101), np.cos(20.0 * times), np.sin(20.0 * times)], axis=1)
    end = sb.Grip(times, np.tile([1.001 * LENGTH, 0.0, 0.0], (101, 1)), np.tile([1.0, 0.0, 0.0], (101, 1)), turn)
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, 1, 0))
    options = {"density": DENSITY, "EI": EI, "GJ": GJ, "EA": 100.0, "gravity": (0, 0, 0)}
    return sb.rod(LENGTH, 10, start=start, end=end, **options)


@pytest.mark.parametrize("h", [1 / 50, 1 / 1000])
def test_torque_is_that_of_the_twist(h):
    """GJ angle/L in every joint, at 2 rad, and at any substep: twist has no inertia."""
    torque = -sb.simulate(rolled(), [0.0, 0.1], implicit(h)).forces["rod_twist"][-1, :, 0]
    assert torque == pytest.approx(rods.torsion_torque(2.0, LENGTH, GJ), rel=1e-3)


def on_a_table(friction: float = 0.3, speed: float = 0.5, **options) -> sb.Scene:
    """A straight rod that lies on a table and slides along x and y."""
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "EA": 1e3} | options
    points = np.stack([np.zeros(9), np.linspace(0.0, 0.4, 9), np.full(9, 0.005 + 1e-9)], axis=1)
    along = np.tile([speed, 0.0, 0.0], (9, 1))
    scene = sb.rod(0.4, 8, points=points, velocity=along, director=(0.3, 0.0, 1.0), **given)
    scene.add_contact(scene.ropes["rod"], sb.Plane(name="table"), friction=friction, radius=0.005)
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_a_rod_slides_until_friction_has_stopped_it_and_sticks(integrator):
    scene = on_a_table()
    x = sb.simulate(scene, [0.0, 0.3, 0.6], implicit(1e-3, integrator)).positions[:, :9]
    first_order = (
        0.5 * 0.5e-3 if integrator == "bdf1" else 0.0
    )  # v h/2: the substep's last velocity counts for all of it
    assert x[1, :, 0] == pytest.approx(0.5**2 / (2 * 0.3 * G) - first_order, rel=5e-4)
    assert np.abs(x[2] - x[1]).max() < 1e-8
    assert np.abs(x[2, :, 2] - 0.005).max() < 1e-6


def test_a_rod_around_a_bar_multiplies_its_tension():
    """Euler's and Eytelwein's exp(mu angle), of the polygon of the rod's links; EI is next to nothing."""
    count, mu, radius, straight = 30, 0.3, 0.1, 3
    turn = np.pi / count
    chord = 2.0 * radius * np.sin(0.5 * turn)
    angles = (np.arange(count) + 0.5) * turn
    arc = radius * np.stack([-np.cos(angles), np.zeros(count), np.sin(angles)], axis=1)
    down = chord * np.arange(1, straight + 1)[:, None] * (0.0, 0.0, -1.0)
    points = np.vstack([arc[0] + down[::-1], arc, arc[-1] + down])
    links = len(points) - 1
    scene = sb.Scene("capstan", gravity=(0, 0, 0))
    rod = sb.add_rod(
        scene, length=chord * links, segments=links, density=DENSITY, EI=1e-8, GJ=1e-8, EA=1e4, points=points
    )
    bar = sb.Capsule(start=(0, -1, 0), end=(0, 1, 0), radius=radius, name="bar")
    scene.add_contact(rod, bar, friction=mu)
    scene.add_force([0], [[[0.0, 0.0, -1.0]]])
    last = links
    times = np.array([0.0, 0.02, 0.1])
    pulled = scene.nodes[last] - np.outer([0.0, 0.001, 0.005], (0.0, 0.0, 1.0))
    scene.drive([last], times, pulled[:, None, :], interpolation="linear")
    tension = -sb.simulate(scene, [0.0, 0.1], implicit(1e-3, "bdf1")).forces["rod_stretch"][-1, :, 0]
    polygon = ((1 + mu * np.tan(0.5 * turn)) / (1 - mu * np.tan(0.5 * turn))) ** count
    assert tension[0] == pytest.approx(1.0, abs=2e-3)
    assert tension[-1] / tension[0] == pytest.approx(polygon, rel=2e-3)


def rolled_over(segments: int = 8) -> tuple[sb.Scene, dict[str, float]]:
    """A rod on a table, bent at rest, that one end rolls over; and the values that bend and twist it."""
    times = np.linspace(0.0, 0.2, 41)
    angle = 2.5 * np.sin(np.pi * times / 0.4) ** 2
    turn = np.stack([np.zeros(41), -np.sin(angle), np.cos(angle)], axis=1)
    place, along = np.tile([0.0, 0.0, 0.0061], (41, 1)), np.tile([1.0, 0.0, 0.0], (41, 1))
    scene = sb.rod(
        *(0.3, segments),
        density=DENSITY,
        EI=EI,
        GJ=GJ,
        EA=500.0,
        start=sb.Grip(times, place, along, turn),
        curvature_modes=[0],
        twist_modes=[0],
        bend_damping=0.01,
    )
    scene.add_contact(scene.ropes["rod"], sb.Plane(name="table"), friction=0.2, radius=0.005)
    return scene, {"rod_curvature_1_0": 3.0, "rod_curvature_2_0": 4.0, "rod_twist_0": 2.0}


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients_of_a_rod_that_rolls_over_are_those_of_differences(integrator):
    scene, values = rolled_over()
    solver, times = implicit(1e-3, integrator), [0.0, 0.1, 0.2]
    rollout = sb.rollout(scene, times, solver, values=values)
    bar = np.zeros_like(rollout.positions)
    bar[1:, 1:9] = np.random.default_rng(3).normal(size=(2, 8, 3))
    found = rollout.gradient(bar).quantities

    def loss(**other: float) -> float:
        return float((bar * sb.rollout(scene, times, solver, values=values | other).positions).sum())

    at = dict(zip(scene.compiled.names, scene.compiled.values(values), strict=True))
    for name, scale in {
        **{name: at[name] for name in ("rod_EI", "rod_GJ", "rod_EA", "rod_length", "rod_curvature_2_0", "rod_twist_0")},
        **{"table_friction": 0.2, "table_contact_radius": 0.005, "table_z": 0.005},
    }.items():
        step = 1e-6 * scale
        expected = (loss(**{name: at[name] + step}) - loss(**{name: at[name] - step})) / (2.0 * step)
        assert found[name] == pytest.approx(expected, rel=1e-5, abs=1e-6 / scale), name
    assert abs(found["rod_GJ"]) > 1e-2 and abs(found["table_friction"]) > 1e-3
