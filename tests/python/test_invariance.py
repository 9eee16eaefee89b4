"""What must not change: momentum, energy that only falls, the same motion seen from elsewhere, and the same bits
however it is computed."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.spatial.transform import Rotation
from support import observed_orders, steps

G = 9.81
SOLVERS = {
    "direct bdf1": {"integrator": "bdf1"},
    "direct bdf2": {"integrator": "bdf2"},
    "sweeps bdf1": {"integrator": "bdf1", "method": "gauss_seidel", "iterations": 6},
    "sweeps bdf2": {"integrator": "bdf2", "method": "gauss_seidel", "iterations": 6},
}


def arc(
    turn: Rotation | None = None,
    shift: np.ndarray | None = None,
    pinned: bool = True,
    speed: float = 1.0,
    bend_damping: float | None = 1e-5,
) -> sb.Scene:
    """A bent rope with everything on it: stretch, bending, damping, drag, a hinge, a spring to a point, a force; seen
    from elsewhere."""
    turn = turn or Rotation.identity()
    shift = np.zeros(3) if shift is None else shift
    s = np.linspace(0.0, 1.0, 9)
    x = turn.apply(np.stack([np.sin(1.5 * s), 0.2 * s**2, -np.cos(1.5 * s)], axis=1)) + shift
    v = speed * turn.apply(np.stack([np.cos(9 * s), np.sin(7 * s), s], axis=1))
    link, each = float(np.linalg.norm(x[1] - x[0])), np.arange(9)
    scene = sb.Scene("arc", gravity=turn.apply([0, 0, -G]) if pinned else (0, 0, 0))
    scene.add_particles(x, 0.01 + 0.005 * s, velocity=v)
    scene.add_constraints(
        "distance", np.stack([each[:-1], each[1:]], axis=1), name="stretch", compliance=1e-4, damping=0.5
    )
    triples = np.stack([each[:-2], each[1:-1], each[2:]], axis=1)
    scene.add_constraints("bend", triples, name="bend", compliance=link / 2e-3, damping=bend_damping)
    if pinned:
        normal = turn.apply([0.0, 1.0, 0.0])
        scene.add_constraints("hinge", [[2, 3, 4]], name="hinge", viscosity=1e-4, normal=normal)
        scene.add_constraints("planar_bend", [[5, 6, 7]], name="set", compliance=100.0, rest=0.1, normal=normal)
        scene.add_force([8], turn.apply([[0.1, 0.0, 0.2]])[None])
        scene.set_drag(linear=1e-3, quadratic=2e-3)
        scene.pin([0])
    return scene


def rollout(scene: sb.Scene, times: np.ndarray, **options) -> sb.Trajectory:
    return sb.simulate(scene, times, sb.Solver(h=1 / 480, **options))


# --- momentum and energy


@pytest.mark.parametrize("options", SOLVERS.values(), ids=SOLVERS)
def test_a_free_rope_keeps_its_momentum(options):
    scene = arc(pinned=False)
    mass = scene.base_arrays()["mass"][:, None]
    motion = rollout(scene, steps(1 / 480, 240), **options)
    momentum = (mass * motion.velocities).sum(axis=1)
    assert momentum == approx(np.broadcast_to(momentum[0], momentum.shape), abs=1e-12)


@pytest.mark.parametrize(("integrator", "order"), [("bdf1", 1), ("bdf2", 2)])
def test_angular_momentum_is_lost_to_the_integrator_alone(integrator, order):
    """Internal forces have no torque: what is lost falls with the integrator's order."""
    lost = []
    for h in (1 / 4000, 1 / 8000, 1 / 16000):
        scene = arc(pinned=False, speed=0.3, bend_damping=None)
        mass = scene.base_arrays()["mass"][:, None]
        motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=h, integrator=integrator))
        angular = np.cross(motion.positions, mass * motion.velocities).sum(axis=1)
        lost.append(np.linalg.norm(angular[1] - angular[0]))
    assert lost[0] > 0
    assert observed_orders(lost) == approx(order, abs=0.25)


def spun_arc(
    damping: float | None, axis: tuple[float, float, float], rate: float, count: int, h: float
) -> tuple[sb.Scene, float, float]:
    """A free arc in the xz plane, set spinning: the scene, its angular momentum [kg m^2/s] at the start, and how much
    of it is lost."""
    s = np.linspace(0.0, np.pi / 2, 9)
    points = np.stack([np.sin(s) - 0.6, 0 * s, 0.6 - np.cos(s)], axis=1)
    scene = sb.rope(points=points, segments=8, density=0.05, EI=0.1, bend_damping=damping, pinned=(), gravity=(0, 0, 0))
    inputs = scene.compiled.inputs()
    offset, size = scene.compiled.layout["velocity"]
    inputs[offset : offset + size] = np.cross(np.multiply(rate, axis), scene.positions).ravel()
    mass = scene.compiled.unpack(inputs)["mass"][:, None]
    out = sb.Solver(h=h).core(scene.compiled).simulate(inputs, [0, count], 0.0)
    x, v = (out[key].reshape(2, -1, 3) for key in ("positions", "velocities"))
    angular = np.cross(x, mass * v).sum(axis=1)
    return scene, float(np.linalg.norm(angular[0])), float(np.linalg.norm(angular[1] - angular[0]))


@pytest.mark.parametrize("damping", [None, 0.5])
def test_bend_damping_does_not_resist_a_turn_in_the_plane_of_the_bend(damping):
    _, angular, lost = spun_arc(damping, (0.0, 1.0, 0.0), rate=5.0, count=400, h=1 / 2000)
    assert lost < 1e-5 * angular


def test_bend_damping_resists_a_turn_out_of_the_plane_of_the_bend():
    """A limit of the vector C = kappa b (docs/decisions): turned at a rate omega it changes by omega x C, which
    beta opposes.

    The torque about a unit axis n is omega times the sum of beta |n x C|^2 over the joints.
    """
    axis, rate, count, h = (0.0, 0.0, 1.0), 5.0, 20, 1 / 20000
    _, angular, without = spun_arc(None, axis, rate, count, h)
    scene, _, lost = spun_arc(5e-3, axis, rate, count, h)
    edges = np.diff(scene.positions, axis=0)
    size = np.linalg.norm(edges, axis=1)
    kappa_b = (
        2 * np.cross(edges[:-1], edges[1:]) / (size[:-1] * size[1:] + (edges[:-1] * edges[1:]).sum(axis=1))[:, None]
    )
    beta = scene.compiled.unpack(scene.compiled.inputs())["damping"][8:]
    assert beta == approx(5e-3 * 0.1 / size[0], rel=1e-2)
    torque = rate * (beta * (np.cross(axis, kappa_b) ** 2).sum(axis=1)).sum()
    assert without < 1e-6 * angular
    assert lost == approx(torque * count * h, rel=5e-3)


@pytest.mark.parametrize("options", [SOLVERS["direct bdf1"], SOLVERS["sweeps bdf1"]], ids=["direct", "sweeps"])
def test_energy_only_falls(options):
    rope = sb.rope(1.0, 10, density=0.05, EA=50.0, EI=1e-3, bend_damping=0.01, stretch_damping=1e-3, drag_linear=0.01)
    motion = rollout(rope, steps(1 / 480, 960), **options)
    inputs = rope.compiled.unpack(rope.compiled.inputs())
    mass, alpha = inputs["mass"], inputs["compliance"]
    kinetic = 0.5 * (mass[:, None] * motion.velocities**2).sum(axis=(1, 2))
    weight = G * (mass * motion.positions[:, :, 2]).sum(axis=1)
    stretch = np.linalg.norm(np.diff(motion.positions, axis=1), axis=2) - 0.1
    edges = np.diff(motion.positions, axis=1)
    size = np.linalg.norm(edges, axis=2)
    cross = 2 * np.cross(edges[:, :-1], edges[:, 1:])
    kappa = cross / (size[:, :-1] * size[:, 1:] + (edges[:, :-1] * edges[:, 1:]).sum(axis=2))[..., None]
    elastic = 0.5 * (stretch**2 / alpha[:10]).sum(axis=1) + 0.5 * ((kappa**2).sum(axis=2) / alpha[10:]).sum(axis=1)
    energy = kinetic + weight + elastic
    scale = energy.max() - energy.min()
    assert scale > 0.1
    assert np.diff(energy).max() < 1e-9 * scale


# --- the same scene seen from elsewhere


@pytest.mark.parametrize("options", SOLVERS.values(), ids=SOLVERS)
def test_turned_and_moved_scenes_move_alike(options):
    turn, shift = Rotation.from_rotvec([0.4, -1.1, 0.7]), np.array([3.0, -2.0, 1.0])
    here, there = (rollout(scene, steps(1 / 480, 120), **options) for scene in (arc(), arc(turn, shift)))
    shape = here.positions.shape
    assert (turn.apply(here.positions.reshape(-1, 3)) + shift).reshape(shape) == approx(there.positions, abs=1e-10)
    for name in ("stretch", "hinge"):
        assert there.forces[name] == approx(here.forces[name], abs=1e-6)


def test_gradients_turn_with_the_scene():
    turn, s = Rotation.from_rotvec([0.4, -1.1, 0.7]), sb.Solver(h=1 / 480)
    weights = np.random.default_rng(0).standard_normal((61, 9, 3))
    bars = []
    for scene, seed in ((arc(), weights), (arc(turn), turn.apply(weights.reshape(-1, 3)).reshape(weights.shape))):
        core, inputs, every = s.core(scene.compiled), scene.compiled.inputs(), list(range(61))
        bar = core.vjp(inputs, core.record(inputs, every, 0.0)[1], every, seed.reshape(61, -1), 0.0)
        bars.append(scene.compiled.unpack(bar))
    here, there = bars
    for name in ("mass", "compliance", "damping", "drag_linear", "drag_quadratic"):
        assert there[name] == approx(here[name], rel=1e-8, abs=1e-8 * np.abs(here[name]).max()), name
    for name in ("position", "velocity"):
        assert there[name] == approx(turn.apply(here[name]), abs=1e-8 * np.abs(here[name]).max()), name


def test_order_of_particles_does_not_matter():
    """The direct solver finds the chain in whatever order it was written."""
    straight = sb.rope(1.0, 8, density=0.05, EA=100.0, EI=1e-3)
    motion = rollout(straight, steps(1 / 480, 120)).positions
    order = np.random.default_rng(2).permutation(9)
    place = np.argsort(order)
    inputs = straight.compiled.unpack(straight.compiled.inputs())
    mixed = sb.Scene("mixed")
    mixed.add_particles(straight.positions[order], inputs["mass"][order])
    each = np.arange(9)
    links, joints = np.stack([each[:-1], each[1:]], axis=1), np.stack([each[:-2], each[1:-1], each[2:]], axis=1)
    mixed.add_constraints("distance", place[links], name="stretch", compliance=0.125 / 100.0)
    mixed.add_constraints("bend", place[joints], name="bend", compliance=0.125 / 1e-3)
    mixed.pin([place[0]])
    assert rollout(mixed, steps(1 / 480, 120)).positions[:, place] == approx(motion, abs=1e-9)


def test_lengths_and_gravity_scale_together():
    """x -> s x with g -> s g in the same time, for a rope without stiffness of its own."""
    small, large = (sb.rope(size, 6, density=0.05, gravity=(0, 0, -size * G)) for size in (1.0, 3.0))
    a, b = (rollout(scene, steps(1 / 480, 240)).positions for scene in (small, large))
    assert b == approx(3.0 * a, abs=1e-9)


# --- the same bits


def grid(ropes: int = 6) -> sb.Scene:
    """Several ropes side by side: many blocks, and colors with enough in them to split."""
    scene = sb.Scene("ropes")
    for k in range(ropes):
        rope = sb.add_rope(
            scene,
            f"rope{k}",
            length=1.0,
            segments=12,
            density=0.05,
            EA=100.0,
            EI=1e-3,
            start=(0, 0.1 * k, 0),
            drag_linear=0.01,
        )
        scene.pin(rope.particles[[0]])
    return scene


@pytest.mark.parametrize("options", SOLVERS.values(), ids=SOLVERS)
def test_threads_leave_the_bits_alone(options):
    weights = np.random.default_rng(1).standard_normal((1, grid().particle_count * 3))
    results = []
    for threads in (1, 2, 3, 8):
        scene = grid()
        s = sb.Solver(h=1 / 480, threads=threads, grain=1, **options)
        core, inputs = s.core(scene.compiled), scene.compiled.inputs()
        motion = core.simulate(inputs, [20, 40], 0.0)
        bar = core.vjp(inputs, core.record(inputs, [40], 0.0)[1], [40], weights, 0.0)
        results.append((motion["positions"], motion["velocities"], motion["multipliers"], bar))
    for other in results[1:]:
        for a, b in zip(results[0], other, strict=True):
            assert np.array_equal(a, b)


@pytest.mark.parametrize("options", SOLVERS.values(), ids=SOLVERS)
def test_tape_tangents_and_lanes_leave_the_bits_alone(options):
    scene = arc()
    core, inputs, every = sb.Solver(h=1 / 480, **options).core(scene.compiled), scene.compiled.inputs(), [0, 1, 2, 50]
    plain = core.simulate(inputs, every, 0.0)["positions"]
    recorded, _ = core.record(inputs, every, 0.0)
    assert np.array_equal(recorded, plain)
    assert np.array_equal(core.states(inputs, every, 0.0), plain)
    seen, _ = core.jvp(inputs, np.ones((3, len(inputs))), every, 0.0)
    assert np.array_equal(seen, plain)

    rng = np.random.default_rng(3)
    batch = inputs * (
        1.0 + 1e-3 * rng.standard_normal((11, len(inputs)))
    )  # eleven scenes: a full pack and part of another
    lanes = core.simulate_batch(batch, every, 0.0)
    weights = rng.standard_normal((11, len(every), plain.shape[1]))
    bars = core.vjp_batch(batch, every, weights, 0.0)
    for k in range(11):
        assert np.array_equal(lanes[k], core.simulate(batch[k], every, 0.0)["positions"])
        bar = core.vjp(batch[k], core.record(batch[k], every, 0.0)[1], every, weights[k], 0.0)
        assert np.array_equal(bars[k], bar)


@pytest.mark.parametrize("options", SOLVERS.values(), ids=SOLVERS)
def test_a_batch_has_the_misfits_of_its_scenes(options):
    scene = arc()
    core, inputs, frames = sb.Solver(h=1 / 480, **options).core(scene.compiled), scene.compiled.inputs(), [5, 20]
    rng = np.random.default_rng(4)
    batch = inputs * (1.0 + 1e-3 * rng.standard_normal((9, len(inputs))))
    x = core.simulate_batch(batch, frames, 0.0)
    for targets in (x + 0.01 * rng.standard_normal(x.shape), x[0]):
        misfit, gradient = core.misfit_batch(batch, frames, targets, 0.0)
        assert misfit == pytest.approx(0.5 * np.square(x - targets).sum(axis=(1, 2)), rel=1e-12)
        assert np.array_equal(gradient, core.vjp_batch(batch, frames, x - targets, 0.0))
    with pytest.raises(ValueError, match="targets"):
        core.misfit_batch(batch, frames, x[:2], 0.0)


def test_again_gives_the_same_bits():
    first, second = (rollout(arc(), steps(1 / 480, 50)) for _ in range(2))
    assert np.array_equal(first.positions, second.positions)
    assert np.array_equal(first.velocities, second.velocities)
