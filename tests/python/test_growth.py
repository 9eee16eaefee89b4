"""Growth of small displacements: near 1 for motions that a fit can use, exponential where neighboring motions part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.growth import ROUGH, Growth, growth, growths
from sheetbend.objects.arm import add_arm
from sheetbend.problem.problem import FitProblem


def experiment(scene: sb.Scene, end: float, h: float, **fields: object) -> sb.Experiment:
    times = np.linspace(0.0, end, 11)
    last = int(scene.free[-1])
    recording = sb.Recording(positions=np.zeros((11, 1, 3)) + scene.positions[last], times=times, name="motion")
    return sb.Experiment(
        scene=scene, recording=recording, markers=[sb.on_particle(last)], solver=sb.Solver(h=h), **fields
    )


def double_pendulum(angle: float, y: float = 0.0) -> sb.Scene:
    scene = sb.Scene("double_pendulum")
    numbers = {"mass": 0.09, "first_moment": 0.0107, "inertia": 0.00154, "length": 0.173}
    upper = add_arm(scene, "upper", **numbers, pivot=(0.0, y, 0.0), angle=angle)
    add_arm(scene, "lower", mass=0.14, first_moment=0.0169, inertia=0.0033, length=0.25, pivot=upper, angle=angle + 0.1)
    return scene


def rope(EA: float = 1e4) -> sb.Scene:
    return sb.rope(0.6, 12, density=0.05, EA=EA, EI=2e-3, bend_damping=0.01, clamp_start=(1, 0, 0))


def test_a_double_pendulum_let_go_near_the_top_parts_as_two_runs_do():
    """Against the distance of two runs that start 1e-10 rad apart, which soon lie along the direction that grows."""
    scene = double_pendulum(3.0)
    found = growth(experiment(scene, 5.0, 1 / 800), 5.0)
    assert found.largest > ROUGH and found.until == pytest.approx(4.4, rel=0.05)
    near = [sb.simulate(scene, found.times, sb.Solver(h=1 / 800), {"upper_angle": 3.0 + d}) for d in (0.0, 1e-10)]
    apart = np.linalg.norm(near[1].positions - near[0].positions, axis=(1, 2))
    share = apart / 1e-10 / found.sigma
    assert (share < 1.0).all() and (share > 0.02).all()
    assert np.ptp(np.log(share[found.times > 1.5])) < 0.2


def test_small_swings_of_the_same_pendulum_do_not_part():
    found = growth(experiment(double_pendulum(0.1), 10.0, 1 / 800), 10.0)
    assert found.largest < 100.0 and found.until is None


def test_rounding_out_of_the_plane_of_a_motion_does_not_count():
    """At this y the particles leave the plane in the last bit, and displacements across it grow faster than along."""
    wanted = growth(experiment(double_pendulum(2.0), 2.0, 1 / 800), 2.0)
    found = growth(experiment(double_pendulum(2.0, 0.123456), 2.0, 1 / 800), 2.0)
    assert found.sigma == pytest.approx(wanted.sigma, rel=1e-6)


def test_a_rope_forgets_its_displacements():
    found = growth(experiment(rope(), 1.0, 1 / 800), 1.0)
    assert found.largest == pytest.approx(1.0) and found.sigma[-1] < 0.5 and found.until is None


def test_a_falling_pair_keeps_its_displacements():
    """A pair of particles on a soft spring falls: displacements stay about as large as they are."""
    scene = sb.Scene("fall")
    scene.add_particles([(0, 0, 1.0), (0.1, 0, 1.0)], 0.1)
    scene.add_constraints("distance", [(0, 1)], compliance=1e-2)
    found = growth(experiment(scene, 0.5, 1 / 100), 0.5)
    assert found.sigma[0] == 1.0 and found.sigma.max() < 1.5


def test_a_motion_that_diverges_grows_without_limit_from_there():
    scene = rope()
    scene.add_force([5], np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, 1e308]]]), [0.3, 0.31])
    found = growth(experiment(scene, 1.0, 1 / 200), 1.0)
    assert found.largest == np.inf
    assert found.until is not None and 0.2 < found.until <= 0.32
    assert np.isfinite(found.rate)


def test_a_problem_gives_its_moving_experiments_at_the_values_of_a_point():
    moving, e = experiment(rope(), 0.5, 1 / 400), experiment(rope(), 0.5, 1 / 400, start="equilibrium")
    experiments = [moving, replace(e, name="from rest")]
    problem = FitProblem(experiments, as_parameters(["rope_EI"], experiments))
    first, second = growths(problem, problem.parameters.to_internal({"rope_EI": 5e-3}))
    assert (first.name, second.name) == ("motion", "from rest")
    direct = growth(moving, 0.5, {"rope_EI": 5e-3})
    assert first.sigma == pytest.approx(direct.sigma, rel=1e-6)
    assert first.sigma != pytest.approx(growth(moving, 0.5).sigma, rel=1e-2)


def test_until_is_the_last_time_below_the_limit():
    times = np.array([0.0, 0.1, 0.2, 0.3])
    assert Growth("g", times, np.array([1.0, 10.0, 2 * ROUGH, 1.0])).until == 0.1
    assert Growth("g", times, np.array([1.0, 10.0, 1.0, 1.0])).until is None
    assert Growth("g", times, np.array([1.0, np.inf, np.inf, np.inf])).until == 0.0
