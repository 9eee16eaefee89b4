"""Rigid constraints that follow from others: named before anything moves, and no part of gradients."""

import warnings

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import _core
from support import sensitivity

SIDES, DIAGONALS = [[1, 2], [2, 3], [3, 0]], [[0, 2], [1, 3]]
MOVING = ("position", "velocity", "mass", "rest", "gravity")


def square(pinned: list[int], compliance: float = 0.0) -> sb.Scene:
    """Four particles with all of their distances held, but for that of the first two where both are pinned."""
    scene = sb.Scene("square", gravity=(0.3, -9.81, 0.0))
    scene.add_particles(0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]]), [0.1, 0.2, 0.15, 0.05])
    scene.pin(pinned)
    pairs = SIDES + DIAGONALS + ([] if len(pinned) > 1 else [[0, 1]])
    scene.add_constraints("distance", pairs, name="links", compliance=compliance)
    return scene


def test_a_square_with_both_diagonals_is_named_and_has_a_gradient():
    scene = square([0])
    with pytest.warns(
        sb.RedundantConstraintsWarning, match=r"square: .* links \d \(particles \d and \d\) follows from"
    ):
        report = sb.check_gradients(scene, [0.0, 0.05], sb.Solver(h=1e-3))
    rows = {row.name: row for row in report.rows if row.name in MOVING}
    assert set(rows) == set(MOVING)
    for row in rows.values():
        assert row.gradient < 10.0 and row.complex_step < 1e-9 and row.differences < 1e-5, row
    assert report.dot_product < 1e-12


@pytest.mark.filterwarnings("ignore::sheetbend.RedundantConstraintsWarning")
def test_its_links_keep_their_lengths_and_one_has_no_force():
    scene = square([0])
    motion = sb.simulate(scene, 1e-3 * np.arange(101), sb.Solver(h=1e-3))
    ends = scene.groups[0].particles
    lengths = np.linalg.norm(motion.positions[:, ends[:, 0]] - motion.positions[:, ends[:, 1]], axis=2)
    assert np.abs(motion.positions - motion.positions[0]).max() > 0.01
    assert np.ptp(lengths, axis=0).max() < 1e-15
    assert (motion.forces["links"][1:, :, 0] == 0.0).all(axis=0).sum() == 1


def test_a_contradiction_is_told():
    scene = sb.Scene("square")
    scene.add_particles(0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]]), 0.1)
    pairs = np.array([*SIDES, *DIAGONALS, [0, 1]])
    x = scene.positions
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) + 0.003 * (np.arange(6) == 3)
    scene.add_constraints("distance", pairs, name="links", compliance=0.0, rest=rest)
    with pytest.warns(sb.RedundantConstraintsWarning, match="contradicts them by 0.00"):
        sb.simulate(scene, [0.0, 0.01])


@pytest.mark.parametrize("method", ["direct", "gauss_seidel"])
def test_what_is_not_redundant_is_not_named(method):
    scenes = [square([0], compliance=1e-6), sb.rope(0.6, 12, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scene in scenes:
            sb.simulate(scene, [0.0, 0.01], sb.Solver(method=method))


def test_a_square_at_rest():
    """Forces and shape under changed masses, places and lengths, against differences."""
    scene = square([0, 1])
    compiled, rng = scene.compiled, np.random.default_rng(0)
    weights, weights_of_forces = rng.standard_normal((4, 3)), rng.standard_normal((5, 1))
    inputs = compiled.inputs()

    def solved(theta):
        out = _core.equilibrium(compiled.core, theta, None, True)
        assert out.converged, out.message
        return float(weights.ravel() @ out.positions + weights_of_forces.ravel() @ out.multipliers)

    with pytest.warns(sb.RedundantConstraintsWarning, match="links"):
        rest = sb.equilibrium(scene)
    assert rest.residual < 1e-14 and rest.unstable_modes == 0
    assert (rest.forces["links"] == 0.0).sum() == 1
    assert sb.support_forces(rest).sum(axis=0) == approx(-0.2 * np.array(scene.gravity), abs=1e-13)
    gradient = rest.input_gradient(weights, {"links": weights_of_forces})
    for name in ("position", "mass", "rest", "gravity"):
        offset, size = compiled.layout[name]
        along = np.zeros(len(inputs))
        along[offset : offset + size] = rng.standard_normal(size)
        if name == "position":
            along[offset + 2 : offset + size : 3] = 0.0  # off its plane the square has six distances to say
            along[offset + 6 :] = 0.0  # where free ones are is a start
        ends = [(solved(inputs + h * along) - solved(inputs - h * along)) / (2.0 * h) for h in (2e-5, 1e-5)]
        assert gradient @ along == approx((4.0 * ends[1] - ends[0]) / 3.0, rel=1e-6), name


@pytest.mark.filterwarnings("ignore:cloth")
def test_a_volume_kept_twice_by_newton():
    """As one that is kept once."""

    def ball(times: int) -> sb.Scene:
        scene = sb.Scene("ball")
        mesh = sb.mesh.icosphere(0.1, 0)
        cloth = sb.add_cloth(scene, mesh, density=0.1, warp=100.0, shear=40.0, bending=1e-5)
        for k in range(times):
            scene.add_volume(cloth.particles[mesh.triangles], name=f"air_{k}")
        return scene

    solver, times = sb.Solver(h=1e-3, method="newton"), [0.0, 0.02]
    once, twice = (sb.simulate(ball(k), times, solver) for k in (1, 2))
    assert twice.positions == approx(once.positions, abs=1e-12)
    assert [p[-1] == 0.0 for p in twice.pressures.values()] == [False, True]
    weights = np.random.default_rng(0).standard_normal((2, 12, 3))
    for name in ("cloth_warp", "cloth_density"):
        expected = sensitivity(ball(1), times, solver, weights, name)
        assert sensitivity(ball(2), times, solver, weights, name) == approx(expected, rel=1e-9)


def test_rods_that_shear_are_refused_at_one_iteration():
    """Their gradients would lose half of their digits; without GA one iteration does."""
    scene = sb.rod(0.5, 8, density=0.05, EI=1e-3, GJ=1e-3, GA=1.0, start=sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    with pytest.raises(sb.InputError, match=r"solver\.iterations: .*GA"):
        sb.simulate(scene, [0.0, 0.01], sb.Solver(iterations=1))
    sb.simulate(scene, [0.0, 0.01], sb.Solver(iterations=2))
