"""Restitution: a ball that bounces, its gradients, a fit of it, and what is refused."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.told import told_numbers
from sheetbend.doubts.told_words import words_of
from sheetbend.doubts.wrong_given import _directions
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

SOLVER = sb.Solver(h=1 / 480, method="implicit")


def ball(restitution=0.8, height=1.0, speed=(0.0, 0.0, 0.0), friction=0.1, **contact) -> sb.Scene:
    scene = sb.Scene("ball")
    scene.add_particles([[0.0, 0.0, height]], 0.1, [speed])
    scene.add_contact([0], sb.Plane(name="table"), friction=friction, restitution=restitution, **contact)
    return scene


def test_a_ball_rises_as_its_restitution_says():
    motion = sb.simulate(ball(), [0.0, 0.7], SOLVER)
    assert motion.positions[-1, 0, 2] == pytest.approx(0.5776531, abs=1e-4)
    assert motion.velocities[-1, 0, 2] == pytest.approx(0.8 * 9.81 * 0.4515236 - 9.81 * (0.7 - 0.4515236), abs=1e-3)
    rests = sb.simulate(ball(restitution=0.5, height=0.1, radius=0.02), np.arange(0, 2.01, 0.1), SOLVER)
    assert rests.positions[-1, 0, 2] == pytest.approx(0.02, abs=1e-6)
    assert rests.positions[:, 0, 2].min() > 0.02 - 1e-6


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_its_gradients_are_those_of_differences(integrator):
    solver = sb.Solver(h=1 / 240, method="implicit", integrator=integrator)
    scene = ball(speed=(2.0, 0.0, -1.0), height=0.3, radius=0.02)
    scene.add_contact([0], sb.Sphere(center=(0.75, 0.0, 0.1), radius=0.15, name="post"), friction=0.2, restitution=0.6)
    times = [0.0, 0.4]
    rollout = sb.rollout(scene, times, solver)
    bar = np.zeros_like(rollout.positions)
    bar[-1, 0] = (1.0, 0.0, 0.5)
    found = rollout.gradient(bar).quantities

    def loss(**values):
        return (bar * sb.rollout(scene, times, solver, values=values).positions).sum()

    for name in ("table_restitution", "post_restitution", "table_friction", "post_radius", "table_contact_radius"):
        value = scene.quantities[name].value
        expected = (loss(**{name: value + 1e-7}) - loss(**{name: value - 1e-7})) / 2e-7
        assert found[name] == pytest.approx(expected, rel=1e-5, abs=1e-6), name
    assert abs(found["table_restitution"]) > 1e-3
    assert abs(found["post_restitution"]) > 1e-3


def test_restitution_is_fitted_inside_its_interval():
    times = np.arange(0, 1.2001, 1 / 60)
    clean = sb.simulate(ball(restitution=0.75, height=0.5), times, SOLVER).positions
    noise = np.random.default_rng(3).normal(0.0, 1e-3, clean.shape)
    recording = sb.Recording(positions=(clean + noise)[:, :1], times=times, name="ball")
    scene, places = ball(restitution=0.6, height=0.5), [sb.on_particle(0)]
    fit = sb.fit(scene, recording, ["table_restitution"], markers=places, solver=SOLVER, sigma=1e-3)
    (found,) = fit.result.estimates
    assert found.verdict == "identified"
    assert found.lower < 0.75 < found.upper
    assert found.upper - found.lower < 0.02


def told_of_throws(**throws: tuple[float, tuple[float, float, float]]) -> list[str]:
    """What errors of told numbers of throws are called, by name from a height at a speed."""
    times, sigma, rng = np.arange(61) / 60, 5e-4, np.random.default_rng(0)
    experiments = []
    for name, (height, speed) in throws.items():
        scene = ball(0.6, height, speed, friction=0.08, radius=0.02)
        x = sb.simulate(scene, times, SOLVER).positions[:, :1]
        recording = sb.Recording(x + sigma * rng.standard_normal(x.shape), times, name=name)
        places = [sb.on_particle(0)]
        experiments.append(sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=sigma))
    problem = FitProblem(experiments, as_parameters(["table_restitution"], experiments))
    told, _ = told_numbers(problem, problem.parameters.initial())
    group = list(range(len(throws)))
    return [words_of(one, 0.003, problem, group) for one, _ in _directions(problem, told, group)]


def test_what_is_wrong_in_all_recordings_is_not_told_as_wrong_in_the_first():
    """A faster start of all was told as one of the first."""
    words = told_of_throws(a=(0.5, (1.0, 0.0, 0.0)), b=(0.35, (0.6, 0.3, 0.0)), c=(0.6, (1.4, -0.2, 0.0)))
    assert len([each for each in words if "frame rate" in each]) == 3  # each its own
    assert "the motion had started 0.3 % faster" in words


def test_what_one_recording_alone_has_is_told_as_its_own():
    """The other is let go at rest."""
    words = told_of_throws(a=(0.5, (1.0, 0.0, 0.0)), b=(0.35, (0.0, 0.0, 0.0)))
    assert "the motion of a had started 0.3 % faster" in words


def test_a_batch_bounces_as_each_scene_alone():
    scene = ball(height=0.3)
    core, compiled = pickle.loads(pickle.dumps(SOLVER.core(scene.compiled))), scene.compiled
    inputs = np.stack([compiled.inputs(compiled.values({"table_restitution": e})) for e in (0.3, 0.8, 1.0)])
    together = core.simulate_batch(inputs, [96, 192], 0.0)
    alone = [core.states(own, [96, 192], 0.0) for own in inputs]
    assert np.array_equal(together, np.stack(alone))
    bar = np.ones_like(together)
    gradients = core.vjp_batch(inputs, [96, 192], bar, 0.0)
    for own, states_bar, found in zip(inputs, bar, gradients, strict=True):
        _, tape = core.record(own, [96, 192], 0.0)
        assert np.array_equal(core.vjp(own, tape, [96, 192], states_bar, 0.0), found)


def test_a_bounce_is_a_contact_that_begins_and_ends():
    counts = sb.simulate(ball(), [0.0, 0.7], SOLVER).contacts["table"]
    assert (counts.began, counts.ended, counts.most) == (1, 1, 0)
    assert counts.bdf1_share == pytest.approx(2 / 336)


def dropped_rope(height: float, **contact: float) -> sb.Scene:
    scene = sb.rope(0.2, 8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, height), pinned=())
    scene.add_contact(
        scene.ropes["rope"], sb.Plane(name="table"), friction=0.3, radius=0.005, restitution=0.5, **contact
    )
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_a_rope_that_falls_flat_bounces_as_a_ball_does(integrator):
    scene, h0 = dropped_rope(0.105), 0.1
    time, e = 0.25, 0.5
    motion = sb.simulate(scene, [0.0, time], sb.Solver(h=1e-3, method="implicit", integrator=integrator))
    left = time - np.sqrt(2 * h0 / 9.81)
    expected = 0.005 + e * np.sqrt(2 * 9.81 * h0) * left - 0.5 * 9.81 * left**2
    assert motion.positions[-1][:9, 2] == pytest.approx(expected, abs=2e-3 if integrator == "bdf1" else 2e-4)


def landed(angle, restitution, method, h):
    """Velocities (2, 2) in their plane of the ends of a rod that falls at 1 m/s, after one end has hit a table."""
    ahead = np.array([np.cos(angle), 0.0, np.sin(angle)])
    scene = sb.Scene("dumbbell", gravity=(0, 0, 0))
    low = np.array([0.0, 0.0, 0.0100333])
    ends = scene.add_particles([low, low + LENGTH * ahead], ENDS, [[0, 0, -1.0]] * 2)
    scene.add_constraints("distance", [ends], name="rod", compliance=0.0)
    scene.add_contact([ends[0]], sb.Plane(name="table"), friction=0.0, restitution=restitution)
    sweeps = {"iterations": 50} if method == "gauss_seidel" else {}
    motion = sb.simulate(scene, [0.0, 0.014 - h, 0.014], sb.Solver(h=h, method=method, integrator="bdf1", **sweeps))
    return np.diff(motion.positions[1:, :, ::2], axis=0)[0] / h


LENGTH, ENDS = 0.2, np.array([0.1, 0.05])


@pytest.mark.parametrize("method", ["implicit", "gauss_seidel"])
@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0, np.pi / 2])
def test_a_rod_that_lands_on_one_end_leaves_with_the_impulse_of_rigid_mechanics(angle, method):
    """An impulse at the end with the effective mass there: 1/m_end = 1/m + (distance from the center . n)^2/inertia."""
    whole, reduced = ENDS.sum(), ENDS.prod() / ENDS.sum()
    inertia, arm = reduced * LENGTH**2, ENDS[1] / whole * LENGTH * np.cos(angle)
    for restitution in (0.5, 1.0):
        impulse = (1 + restitution) / (1 / whole + arm**2 / inertia)
        center, spin = -1.0 + impulse / whole, impulse * arm / inertia
        errors = []
        for h in (1e-3, 1e-4):
            v = landed(angle, restitution, method, h)
            errors.append((abs(ENDS @ v[:, 1] / whole - center), abs(np.linalg.norm(v[1] - v[0]) / LENGTH - abs(spin))))
        assert np.all(np.array(errors[1]) < (1e-3, 6e-3))
        assert np.all(np.array(errors[1]) < 0.2 * np.array(errors[0]) + 1e-4)  # of first order


def test_what_is_held_and_soft_does_not_bounce():
    with pytest.raises(sb.SceneError, match="held by constraints, and the contact has a stiffness") as error:
        _ = dropped_rope(0.006, stiffness=100.0).compiled
    assert error.value.field == "table.restitution"


@pytest.mark.parametrize("restitution", [-0.1, 1.1, np.nan, "much"])
def test_restitutions_that_cannot_be_are_refused(restitution):
    with pytest.raises(sb.SceneError) as error:
        ball(restitution=restitution)
    assert error.value.field == "table.contact.restitution"


def test_plain_gradient_descent_throws_a_ball_by_floor_and_wall_into_a_target():
    """Task 2 of Zhong et al. (2023), with friction and gravity: e = 0.92, the target (-2, 1.5) at 0.6 s."""
    target, velocity = np.array([-2.0, 0.0, 1.5]), np.array([5.0, 0.0, -5.0])
    solver = sb.Solver(h=1 / 240, method="implicit")

    def thrown(velocity):
        scene = sb.Scene("ball")
        scene.add_particles([[-0.5, 0.0, 1.0]], 1.0, [velocity])
        for name, point, normal in (("floor", (0, 0, 0), (0, 0, 1)), ("wall", (1.75, 0, 0), (-1, 0, 0))):
            plane = sb.Plane(point=point, normal=normal, name=name)
            scene.add_contact([0], plane, friction=0.1, restitution=0.92, radius=0.1)
        return sb.rollout(scene, [0.0, 0.6], solver)

    losses = []
    for _ in range(300):
        rollout = thrown(velocity)
        missed = rollout.positions[-1, 0] - target
        losses.append(missed @ missed)
        bar = np.zeros_like(rollout.positions)
        bar[-1, 0] = 2 * missed
        velocity = velocity - 0.05 * rollout.gradient(bar).inputs["velocity"][0]
    assert losses[0] > 10.0
    assert losses[-1] < 0.005
