"""What must not change rods: momentum, energy that only falls, the same motion seen from elsewhere, and frames turned
together."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.spatial.transform import Rotation
from support import observed_orders, steps

G = 9.81
SHAPE = np.array([[0, 0, 0], [0.1, 0.02, 0], [0.2, 0.08, 0.03], [0.28, 0.12, 0.1], [0.3, 0.2, 0.2]])
SPEED = np.array([[0.5, -0.2, 0.1], [0.1, 0.3, 0.0], [0.0, -0.4, 0.3], [-0.3, 0.1, 0.2], [-0.2, 0.5, -0.5]])
DIRECTOR = np.array([0.1, 0.3, 0.9])
SHEAR = {"GA": 0.2}  # N, about 40 EI/length^2


def free(**options) -> sb.Scene:
    """A bent rod set loose in space."""
    given = {"density": 0.05, "EI": 1e-3, "GJ": 0.8e-3, "points": SHAPE, "velocity": SPEED, "director": DIRECTOR}
    return sb.rod(0.45, 12, gravity=(0, 0, 0), **(given | options))


def masses(scene: sb.Scene) -> np.ndarray:
    """(nodes,) of the rod's nodes, which come first."""
    return scene.compiled.unpack(scene.compiled.inputs())["mass"][: len(scene.ropes["rod"].particles)]


def momenta(scene: sb.Scene, motion: sb.Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum (frames, 3)."""
    nodes, mass = scene.ropes["rod"].particles, masses(scene)[:, None]
    x, v = motion.positions[:, nodes], motion.velocities[:, nodes]
    return (mass * v).sum(axis=1), np.cross(x, mass * v).sum(axis=1)


def test_directors_have_no_velocity():
    scene = free(twist_damping=0.01, **SHEAR)
    motion = sb.simulate(scene, steps(1 / 480, 5), sb.Solver(h=1 / 480))
    rod = scene.ropes["rod"]
    for frames in (rod.directors, rod.normals):
        assert np.abs(np.diff(motion.nodes[:, frames], axis=0)).max() > 1e-4
        assert np.linalg.norm(motion.nodes[:, frames], axis=2) == approx(1.0, abs=1e-14)
        assert not motion.node_velocities[:, frames].any()
    assert motion.velocities[:, rod.particles].any()


# --- momentum and energy


@pytest.mark.parametrize("shear", [{}, SHEAR], ids=["", "shear"])
@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_a_free_rod_keeps_its_momentum(integrator, shear):
    scene = free(bend_damping=0.01, twist_damping=0.01, EI2=2e-3, curvature_modes=(0,), twist_modes=(0,), **shear)
    values = {"rod_curvature_1_0": 3.0, "rod_twist_0": 4.0}
    motion = sb.simulate(scene, steps(1 / 480, 240), sb.Solver(h=1 / 480, integrator=integrator), values)
    linear, _ = momenta(scene, motion)
    assert linear == approx(np.broadcast_to(linear[0], linear.shape), abs=1e-12)


DAMPED = {"bend_damping": 0.01, "twist_damping": 0.01}


@pytest.mark.parametrize("options", [{}, DAMPED, DAMPED | SHEAR], ids=["undamped", "damped", "damped and sheared"])
def test_angular_momentum_is_lost_to_the_integrator_alone(options):
    """Material damping sees the change of shape alone, so it has no torque either (unlike a rope's)."""
    lost = []
    for h in (1 / 1000, 1 / 2000, 1 / 4000):
        scene = free(**options)
        _, angular = momenta(scene, sb.simulate(scene, [0.0, 0.1], sb.Solver(h=h)))
        lost.append(float(np.linalg.norm(angular[1] - angular[0]) / np.linalg.norm(angular[0])))
    assert lost[0] < 0.02
    assert observed_orders(lost).min() > 0.9


@pytest.mark.parametrize("shear", [{}, SHEAR], ids=["", "shear"])
def test_energy_only_falls(shear):
    """BDF1, from a bent shape at rest; the elastic energy from the multipliers -C/alpha."""
    scene = free(EA=50.0, EI2=3e-3, velocity=None, **shear)
    motion = sb.simulate(scene, steps(1 / 480, 480), sb.Solver(h=1 / 480, integrator="bdf1"))
    nodes = scene.ropes["rod"].particles
    kinetic = 0.5 * (masses(scene)[:, None] * motion.velocities[:, nodes] ** 2).sum(axis=(1, 2))
    alpha = scene.compiled.unpack(scene.compiled.inputs())["compliance"]
    square = np.concatenate([(force**2).sum(axis=2) for force in motion.forces.values()], axis=1)
    energy = (kinetic + 0.5 * square @ alpha)[1:]
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert energy[-1] < 0.5 * energy[0]


def test_damping_brings_a_free_rod_to_rest():
    options = {"bend_damping": 0.05, "twist_damping": 0.05, "EI2": 3e-3, "velocity": None}
    scene = free(**options)
    motion = sb.simulate(scene, steps(1 / 480, 960), sb.Solver(h=1 / 480))
    kinetic = (masses(scene)[:, None] * motion.velocities[:, :13] ** 2).sum(axis=(1, 2))
    assert kinetic[-1] < 1e-3 * kinetic.max()


# --- the same scene seen from elsewhere


def gripped(turn: Rotation, shift: np.ndarray, roll: float = 0.0, **options) -> sb.Scene:
    """A rod with a moving grip and a load, seen from elsewhere, its frames turned by `roll` about the edges."""
    times = np.linspace(0.0, 0.5, 51)
    held = Rotation.from_rotvec(np.sin(4 * times)[:, None] * (0.2, 0.4, -0.3))
    position = turn.apply(0.05 * np.sin(5 * times)[:, None] * (1, 1, 0)) + shift
    along = turn.apply(held.apply([1.0, 0, 0]))
    first, second = (turn.apply(held.apply(axis)) for axis in ((0, 1.0, 0), (0, 0, 1.0)))
    start = sb.Grip(times, position, along, np.cos(roll) * first + np.sin(roll) * second)
    points = turn.apply(SHAPE - SHAPE[0]) + position[0]
    given = {"density": 0.05, "EI": 1e-3, "GJ": 0.8e-3, "points": points, "bend_damping": 0.01, "twist_damping": 0.01}
    scene = sb.rod(0.45, 12, start=start, gravity=turn.apply([0, 0, -G]), **(given | options))
    scene.add_force([12], turn.apply([[0.01, 0.02, 0.0]])[None])
    return scene


@pytest.mark.parametrize("shear", [{}, SHEAR], ids=["", "shear"])
def test_turned_and_moved_scenes_move_alike(shear):
    """Nodes and ghosts turn and shift, directors turn; to rounding."""
    turn, shift, h = Rotation.from_rotvec([0.4, -1.1, 0.7]), np.array([3.0, -2.0, 1.0]), 1 / 480
    options = {"EI2": 3e-3, "curvature_modes": (0, 1), "twist_modes": (0,)} | shear
    values = {"rod_curvature_1_0": 3.0, "rod_curvature_2_1": -2.0, "rod_twist_0": 4.0}
    here, there = (
        sb.simulate(gripped(*seen, **options), steps(h, 120), sb.Solver(h=h), values)
        for seen in ((Rotation.identity(), np.zeros(3)), (turn, shift))
    )
    moved = np.ones((here.nodes.shape[1], 1))
    moved[list(gripped(turn, shift, **options).directors)] = 0.0
    expected = turn.apply(here.nodes.reshape(-1, 3)).reshape(here.nodes.shape) + moved * shift
    assert there.nodes == approx(expected, abs=1e-9)
    for name, force in here.forces.items():
        assert there.forces[name] == approx(force, abs=1e-6), name


@pytest.mark.parametrize("shear", [{}, SHEAR], ids=["", "shear"])
def test_gradients_do_not_depend_on_the_place(shear):
    turn, shift, h = Rotation.from_rotvec([0.4, -1.1, 0.7]), np.array([3.0, -2.0, 1.0]), 1 / 480
    weights = np.random.default_rng(0).standard_normal((1, gripped(turn, shift, **shear).node_count, 3))
    found = []
    for seen, bar in (
        ((Rotation.identity(), np.zeros(3)), weights),
        ((turn, shift), turn.apply(weights[0])[None]),
    ):
        found.append(sb.rollout(gripped(*seen, EI2=3e-3, **shear), [0.25], sb.Solver(h=h)).gradient(bar).quantities)
    for name, value in found[0].items():
        assert found[1][name] == approx(value, rel=1e-6), name


@pytest.mark.parametrize(("shear", "most"), [({}, 1e-6), ({"GA": 2.0}, 1.2e-6)], ids=["", "shear"])
def test_frames_turned_together_change_nothing_for_a_round_section(shear, most):
    """At rest to rounding. In motion the first iteration of a substep sees frames of the substep before, by which
    forces that it finds depend on the frames; that falls with the square of the substep, and is a hundredth of what the
    substep itself is off by."""
    here = (Rotation.identity(), np.zeros(3))

    def differ(find, **options) -> float:
        a, b = (find(gripped(*here, roll, **shear, **options)) for roll in (0.0, 0.8))
        return float(np.abs(a - b)[:13].max())

    def moved(h: float):
        return lambda scene: sb.simulate(scene, [0.25], sb.Solver(h=h)).positions[0]

    assert differ(lambda scene: sb.equilibrium(scene).positions, points=None) < 1e-9
    coarse, fine = differ(moved(1 / 480)), differ(moved(1 / 960))
    assert coarse < most
    assert observed_orders([coarse, fine]) == approx(2.0, abs=0.1)
    assert differ(moved(1 / 480), EI2=3e-3) > 1e-3


def test_whole_turns_built_in_change_the_sign_with_the_mirror():
    """Twist has a hand: seen in a mirror, a rod with so many turns moves as one with as many turns the other way."""
    grips = [sb.Grip.fixed((x, 0, 0), (1, 0, 0), (0, 0, 1)) for x in (0.0, 0.4)]
    mirror, sides = np.array([1.0, -1.0, 1.0]), []
    for sign in (1, -1):
        points = np.array([[0, 0, 0], [0.1, 0.1 * sign, 0], [0.3, 0.1 * sign, 0], [0.4, 0, 0]])
        options = {"density": 0.05, "EI": 1e-3, "GJ": 0.8e-3, "points": points, "turns": sign, "bend_damping": 0.02}
        scene = sb.rod(0.5, 12, start=grips[0], end=grips[1], **options)
        sides.append(sb.simulate(scene, [0.1, 0.3], sb.Solver(h=1 / 480)).positions[:, :13])
    assert sides[1] == approx(mirror * sides[0], abs=1e-9)
    assert np.abs(sides[0][:, :, 2] - sides[0][0, :, 2]).max() > 1e-3
