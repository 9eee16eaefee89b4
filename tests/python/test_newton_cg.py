"""Newton by conjugate gradients: the motion, gradients and Jacobians of Newton by factors, and errors in words."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import grid
from support import steps

FACTORED = sb.Solver(h=1 / 180, method="newton")
ITERATED = replace(FACTORED, method="newton_cg")
TIMES = steps(1 / 60, 8)


def cloth(warp: float = 600.0, cells: tuple[int, int] = (8, 11)) -> sb.Scene:
    """A damped woven cloth in the wind, held by its upper edge."""
    flat = grid(0.5, 0.7, *cells, "one_way")
    mesh = sb.TriangleMesh(flat.vertices[:, [0, 2, 1]], flat.triangles, flat.material, flat.sets)
    scene, held = sb.Scene("cloth"), mesh.sets["top"]
    damping = {"membrane_damping": 0.01, "bend_damping": 0.02}
    fabric = {"density": 0.15, "warp": warp, "shear": warp / 10, "poisson": 0.3, "bending": 3e-5, **damping}
    sheet = sb.add_cloth(scene, mesh, held=held, **fabric)
    scene.pin(sheet.particles[held])
    scene.add_air(sheet.particles[mesh.triangles], 0.7, 0.05, (0.8, 1.6, 0.0))
    return scene


def weights(scene: sb.Scene) -> np.ndarray:
    return np.random.default_rng(1).standard_normal((len(TIMES), scene.particle_count, 3))


def error(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("warp", [60.0, 600.0, 6000.0])
def test_motion_and_gradient_are_those_of_factors(warp: float) -> None:
    scene = cloth(warp)
    runs = [sb.rollout(scene, TIMES, solver) for solver in (ITERATED, FACTORED)]
    iterated, factored = (r.gradient(weights(scene)) for r in runs)
    moved = [r.positions - r.positions[0] for r in runs]
    assert np.abs(moved[1]).max() > 0.01
    assert error(*moved) < 1e-12
    for name, expected in factored.quantities.items():
        assert iterated.quantities[name] == pytest.approx(expected, rel=1e-9), name


def test_gradients_are_the_program_s() -> None:
    report = sb.check_gradients(cloth(cells=(2, 3)), TIMES[:4], ITERATED)
    assert report.passed, str(report)


def test_columns_of_the_jacobian_are_those_of_factors() -> None:
    scene = cloth()
    compiled = scene.compiled
    theta = compiled.values(None)
    columns = np.stack([compiled.inputs_dot(theta, e) for e in np.diag(theta + (theta == 0.0))])
    grid_steps = [3 * k for k in range(len(TIMES))]
    (x, iterated), (_, factored) = (
        s.core(compiled).jvp(compiled.inputs(theta), columns, grid_steps, 0.0) for s in (ITERATED, FACTORED)
    )
    np.testing.assert_array_equal(x.reshape(len(TIMES), -1, 3), sb.simulate(scene, TIMES, ITERATED).positions)
    for name, found, expected in zip(compiled.names, iterated, factored, strict=True):
        assert np.abs(expected).max() == 0.0 or error(found, expected) < 1e-9, name


def test_scenes_in_lanes_have_the_bits_that_they_have_alone() -> None:
    """Stiff and soft cloths side by side, which take different numbers of iterations."""
    scene = cloth()
    compiled = scene.compiled
    inputs = np.stack([cloth(60.0 * 2.0**k).compiled.inputs() for k in range(8)])
    core, grid_steps = ITERATED.core(compiled), [1, 12, 24]
    together = core.simulate_batch(inputs, grid_steps, 0.0)
    for own, found in zip(inputs, together, strict=True):
        np.testing.assert_array_equal(found, core.states(own, grid_steps, 0.0))


def test_a_looser_tolerance_ends_elsewhere() -> None:
    scene = cloth()
    exact = sb.simulate(scene, TIMES, FACTORED).positions
    rough = sb.simulate(scene, TIMES, replace(ITERATED, cg_tolerance=1e-3)).positions
    assert 1e-9 < np.abs(rough - exact).max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("cells", [(6, 8), (24, 33), (48, 66)])
def test_iterations_do_not_grow_with_the_mesh(cells: tuple[int, int]) -> None:
    """With 3 x 3 blocks for a preconditioner they grew like the mesh's width, to 458 for 1,426 vertices."""
    scene = cloth(cells=cells)
    sb.simulate(scene, TIMES[:2], replace(ITERATED, cg_iterations=60))
    with pytest.raises(sb.UnconvergedError):
        sb.simulate(scene, TIMES[:2], replace(ITERATED, cg_iterations=10))


def company() -> sb.Scene:
    """A cloth with a bob at a corner, and blocks of their own: a rope, two particles, one at an anchor."""
    scene = cloth(cells=(6, 8))
    corner = int(np.lexsort(scene.positions.T[[0, 2]])[0])
    x = np.zeros((15, 3))
    x[:10, 0], x[:10, 2] = 1.0 + 0.05 * np.arange(10), 0.7
    x[10:12], x[12:14] = [[2, 0, 0], [2, 0, 0.1]], [[3, 0, 0], [3, 0.1, 0]]
    x[14] = scene.positions[corner] + [0.02, 0.0, -0.05]
    own = scene.add_particles(x, mass=1e-3)
    scene.pin(own[[0, 12]])
    links = [*pairwise(own[:10]), (own[10], own[11]), (own[12], own[13]), (corner, own[14])]
    at = scene.positions
    rest = [0.98 * np.linalg.norm(at[a] - at[b]) for a, b in links]
    scene.add_constraints("distance", np.array(links), compliance=1e-5, rest=np.array(rest))
    return scene


def test_blocks_of_every_size_move_as_with_factors() -> None:
    scene = company()
    runs = [sb.rollout(scene, TIMES[:4], solver) for solver in (ITERATED, FACTORED)]
    bar = np.random.default_rng(2).standard_normal(runs[0].positions.shape)
    assert error(*(r.positions - r.positions[0] for r in runs)) < 1e-12
    iterated, factored = (r.gradient(bar).quantities for r in runs)
    for name, expected in factored.items():
        assert iterated[name] == pytest.approx(expected, rel=1e-9), name


def test_running_out_of_iterations_is_told() -> None:
    scene, short = cloth(), replace(ITERATED, cg_iterations=5)
    for run in (sb.simulate, sb.rollout):
        with pytest.raises(sb.UnconvergedError, match=r"after 5 iterations .* in cloth\. Fix: raise solver\.cg_iter"):
            run(scene, TIMES, short)
    with pytest.raises(sb.UnconvergedError) as caught:
        sb.check_gradients(scene, TIMES, short)
    assert caught.value.iterations == 5
    assert caught.value.residual > short.cg_tolerance


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"cg_tolerance": 0.0}, "solver.cg_tolerance: must be a relative residual"),
        ({"cg_tolerance": 2.0}, "such as 1e-12"),
        ({"cg_tolerance": float("nan")}, "solver.cg_tolerance"),
        ({"cg_iterations": 0}, "solver.cg_iterations: must be a whole number of at least 1"),
    ],
)
def test_bad_options_are_named(given: dict[str, float], said: str) -> None:
    with pytest.raises(sb.InputError, match=said):
        sb.Solver(method="newton_cg", **given)
