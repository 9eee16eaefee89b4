"""Rods in motion against closed forms: vibrations, whirling, twist that follows at once; and what finer steps and
links change."""

import math
from importlib import import_module
from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from oracles import modes, rods
from pytest import approx
from scipy.spatial.transform import Rotation
from support import observed_orders, place, sensitivity, shown_frequency, slope_along, steps, tangents, twice

G = 9.81
LENGTH, DENSITY, EI, GJ = 0.5, 0.05, 1e-3, 0.8e-3
NO_GRAVITY = (0.0, 0.0, 0.0)
ALONG, FIRST, SECOND = Rotation.from_rotvec([0.5, -0.9, 1.3]).as_matrix().T


# --- O-16a: bending


@pytest.mark.parametrize("mode", [0, 1])
def test_cantilever_vibration(mode):
    """In a plane that is no frame's; EI = 1e-3, mu = 0.05, L = 0.5: 1.98896 rad/s for the first mode."""
    segments = 20 * (mode + 1)
    omega, shape = modes.cantilever_chain_mode(segments, mode, LENGTH, DENSITY, EI)
    continuous = modes.cantilever_frequencies(LENGTH, DENSITY, EI, 2)[mode]
    assert omega == approx(continuous, rel=5e-3)
    if mode == 0:
        assert continuous == approx(1.98896, abs=1e-5)

    h, across = 0.02 / omega, (FIRST + SECOND) / math.sqrt(2)
    heights = np.concatenate([[0.0], 1e-5 * LENGTH * shape])
    along = np.concatenate([[0.0], np.cumsum(np.sqrt((LENGTH / segments) ** 2 - np.diff(heights) ** 2))])
    grip = sb.Grip.fixed((0, 0, 0), ALONG, FIRST)
    options = {"density": DENSITY, "EI": EI, "GJ": GJ, "start": grip, "gravity": NO_GRAVITY}
    scene = sb.rod(LENGTH, segments, points=np.outer(along, ALONG) + np.outer(heights, across), **options)
    times, s = steps(h, 600), sb.Solver(h=h)
    mass = np.append(np.ones(segments - 1), 0.5)
    estimate = shown_frequency(h, 2)

    def series(positions):
        return (positions[:, 1 : segments + 1] @ across @ (mass * shape))[25:]

    motion = series(sb.simulate(scene, times, s).positions)
    assert estimate(motion) == approx(omega, rel=1e-5)
    for name, expected in (("rod_EI", omega / (2 * EI)), ("rod_density", -omega / (2 * DENSITY))):
        assert slope_along(estimate, motion, series(tangents(scene, times, s, name))) == approx(expected, rel=1e-5)


# --- O-10c: stretching


def test_longitudinal_bar():
    """EA = 1e3, mu = 0.05, L = 1: 35.355 Hz."""
    length, axial, segments = 1.0, 1e3, 40
    continuous = rods.bar_frequencies(length, DENSITY, axial, 1)[0]
    omega = rods.bar_frequencies(length, DENSITY, axial, 1, segments)[0]
    assert continuous / (2 * math.pi) == approx(35.355, abs=5e-4)
    assert omega == approx(continuous, rel=1e-3)

    h = 0.02 / omega
    shape = np.sin(0.5 * math.pi * np.arange(segments + 1) / segments)
    line = np.outer(np.linspace(0.0, length, segments + 1), ALONG)
    options = {"density": DENSITY, "EI": EI, "GJ": GJ, "EA": axial, "gravity": NO_GRAVITY}
    start = sb.Grip.fixed((0, 0, 0), ALONG, FIRST)
    scene = sb.rod(length, segments, points=line, velocity=1e-4 * np.outer(shape, ALONG), start=start, **options)
    times, s = steps(h, 600), sb.Solver(h=h)
    mass = np.append(np.ones(segments), 0.5)
    estimate = shown_frequency(h, 2)

    def series(positions):
        return (positions[:, : segments + 1] @ ALONG @ (mass * shape))[25:]

    rest = series(np.stack([scene.positions] * len(times)))
    motion = series(sb.simulate(scene, times, s).positions) - rest
    assert estimate(motion) == approx(omega, rel=1e-5)
    for name, expected in (("rod_EA", omega / (2 * axial)), ("rod_density", -omega / (2 * DENSITY))):
        assert slope_along(estimate, motion, series(tangents(scene, times, s, name))) == approx(expected, rel=1e-4)


# --- O-10d: whirling


def test_whirling():
    """mu = 0.05, omega = 10, L = 1: 2.5 N at the start. The rod is soft; its first node is pinned."""
    length, rate, segments = 1.0, 10.0, 20
    line = np.outer(np.linspace(0.0, length, 2), ALONG)
    speed = rate * np.outer([0.0, length], FIRST)
    options = {"density": DENSITY, "EI": 1e-6, "GJ": 1e-6, "points": line, "velocity": speed}
    scene = sb.rod(length, segments, gravity=NO_GRAVITY, **options)
    scene.pin([0])
    h = 1e-4
    motion = sb.simulate(scene, [0.0, 0.2], sb.Solver(h=h))
    tension = -motion.forces["rod_stretch"][-1, :, 0]
    assert tension == approx(rods.whirling_tension(length, DENSITY, rate, segments), rel=1e-4)
    assert tension[0] == approx(2.5, rel=1e-3)
    # The shape does not know the density; the tension is proportional to it.
    denser = sb.simulate(scene, [0.0, 0.2], sb.Solver(h=h), values={"rod_density": 2 * DENSITY})
    assert denser.forces["rod_stretch"][-1] == approx(2 * motion.forces["rod_stretch"][-1], rel=1e-6)
    weights = place(2, scene, 1, segments, 0)
    assert sensitivity(scene, [0.0, 0.2], sb.Solver(h=h), weights, "rod_density") == approx(twice(0.0), abs=1e-6)


# --- twist


def rolled(segments: int = 20, rate: float = 20.0, **options) -> sb.Scene:
    """A rod held straight and taut, its end rolled at a constant rate for 0.5 s."""
    times = np.linspace(0.0, 0.5, 251)
    turn = np.multiply.outer(np.cos(rate * times), FIRST) + np.multiply.outer(np.sin(rate * times), SECOND)
    across = np.broadcast_to(ALONG, turn.shape)
    end = sb.Grip(times, np.broadcast_to(1.001 * LENGTH * ALONG, turn.shape), across, turn)
    start = sb.Grip.fixed((0, 0, 0), ALONG, FIRST)
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "EA": 100.0, "gravity": NO_GRAVITY} | options
    return sb.rod(LENGTH, segments, start=start, end=end, **given)


def torques(scene: sb.Scene, h: float) -> np.ndarray:
    """Torque in every joint after 0.1 s, when the end is rolled by 2 rad."""
    return -sb.simulate(scene, [0.0, 0.1], sb.Solver(h=h)).forces["rod_twist"][-1, :, 0]


@pytest.mark.parametrize("h", [1 / 50, 1 / 500, 1 / 4000])
def test_twist_follows_at_once(h):
    """The torque is that of the angle now, in every joint and at any step: twist has no inertia."""
    assert torques(rolled(), h) == approx(rods.torsion_torque(2.0, LENGTH, GJ), rel=1e-3)


@pytest.mark.parametrize("shear", [{}, {"GA": 0.5}], ids=["", "shear"])
def test_what_holds_a_director_is_no_friction(monkeypatch, shear):
    """What keeps twist well posed resists a roll like the step times HOLD; halved and doubled it moves nothing."""
    motions = []
    for share in (0.5, 1.0, 2.0):
        monkeypatch.setattr(import_module("sheetbend.objects.rod"), "HOLD", share * 1e-4)
        motions.append(sb.simulate(swinging(20, **shear), [0.0, 0.5, 1.0], sb.Solver(h=1 / 400)).positions)
    for other in (motions[0], motions[2]):
        assert np.abs(other - motions[1]).max() < 1e-4 * LENGTH


def test_twist_damping_resists_the_rate_of_twist():
    """Kelvin-Voigt: torque GJ/L (angle + tau rate)."""
    tau, rate, angle = 0.05, 20.0, 2.0
    scene = rolled(rate=rate, twist_damping=tau)
    felt = torques(scene, 1 / 2000)
    assert felt == approx(rods.torsion_torque(angle + tau * rate, LENGTH, GJ), rel=2e-3)


# --- convergence


def swinging(segments: int, **options) -> sb.Scene:
    """A hanging rod of which both grips are moved and turned smoothly."""
    times = np.linspace(0.0, 1.0, 101)
    ease = np.sin(np.pi * times)[:, None] ** 2
    held = Rotation.from_rotvec(ease * (0.3, 0.5, 1.2))
    quaternions = (held * Rotation.from_rotvec([0.0, np.pi / 2, 0.0])).as_quat()  # x of the gripper points down
    start = sb.Grip.from_poses(times, 0.1 * ease * (1, 1, 0), quaternions)
    back = (held.inv() * Rotation.from_rotvec([0.0, -np.pi / 2, 0.0])).as_quat()
    end = sb.Grip.from_poses(times, (0.25, 0, 0) - 0.05 * ease * (0, 1, 1), back)
    points = [[0, 0, 0], [0.01, 0, -0.1], [0.125, 0, -0.2], [0.24, 0, -0.1], [0.25, 0, 0]]
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "bend_damping": 0.02, "points": points} | options
    return sb.rod(LENGTH, segments, start=start, end=end, **given)


def test_steps_converge_to_the_second_order_where_no_frame_rolls():
    times, one = np.linspace(0.0, 1.0, 101), np.ones((101, 1))
    angle = np.sin(np.pi * times)[:, None] ** 2
    direction = np.cos(angle) * ALONG + np.sin(angle) * FIRST
    start = sb.Grip(times, 0.1 * angle * FIRST, direction, one * SECOND)
    options = {"density": DENSITY, "EI": EI, "GJ": GJ, "bend_damping": 0.02, "gravity": -G * FIRST}
    scene = sb.rod(LENGTH, 12, start=start, **options)
    ends = [sb.simulate(scene, [0.5], sb.Solver(h=1 / rate)).positions[0, :13] for rate in (400, 800, 1600, 3200)]
    gaps = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert observed_orders(gaps) == approx(2.0, abs=0.1)


def test_steps_converge_where_frames_roll():
    """To the first order: a substep's first iteration sees the frames of the substep before (docs/decisions has
    multipliers start from zero), and what it turns the forces by is not undone."""
    scene, ends = swinging(12), []
    start = sb.equilibrium(scene).nodes
    for rate in (400, 800, 1600, 3200):
        ends.append(sb.simulate(scene, [1.0], sb.Solver(h=1 / rate), start=start).positions[0, :13])
    gaps = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert gaps[0] < 5e-4 * LENGTH
    assert observed_orders(gaps).min() > 0.95


def test_rolling_a_round_rod_hardly_moves_it():
    """Nothing, but for that first-order error; the rod is straight at rest and its other end free."""
    times = np.linspace(0.0, 1.0, 101)
    angle = np.sin(np.pi * times)[:, None] ** 4
    turn = np.cos(angle) * (0, 1, 0) + np.sin(angle) * (0, 0, 1)
    start = sb.Grip(times, np.zeros((101, 3)), np.broadcast_to([1.0, 0.0, 0.0], turn.shape), turn)
    scene = sb.rod(LENGTH, 12, density=DENSITY, EI=EI, GJ=GJ, start=start, gravity=(0, 0, -2))
    aside = [np.abs(sb.simulate(scene, [0.3], sb.Solver(h=1 / r)).positions[0, :13, 1]).max() for r in (400, 1600)]
    assert aside[0] < 3e-4 * LENGTH
    assert aside[1] < 0.27 * aside[0]


def test_links_converge_to_the_second_order():
    ends = []
    for segments in (10, 20, 40, 80):
        scene = swinging(segments)
        start = sb.equilibrium(scene).nodes
        motion = sb.simulate(scene, [1.0], sb.Solver(h=1 / 500), start=start).positions[0]
        ends.append(motion[: segments + 1 : segments // 10])
    gaps = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert gaps[-1] < 1e-3 * LENGTH
    assert observed_orders(gaps) == approx(2.0, abs=0.4)
