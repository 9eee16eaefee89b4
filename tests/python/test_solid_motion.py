"""Solids in motion: exact gradients, markers on faces and inside, fits of a swinging bar, files and pictures."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.page import shown

SIZE, CELLS = (0.1, 0.02, 0.02), (5, 1, 1)
SOLVERS = {
    "newton": sb.Solver(h=2e-3, method="newton"),
    "newton_cg": sb.Solver(h=2e-3, method="newton_cg"),
    "implicit": sb.Solver(h=2e-3, method="implicit"),
    "direct": sb.Solver(h=2e-3, method="direct"),
    "gauss_seidel": sb.Solver(h=2e-3, method="gauss_seidel", iterations=4),
}


def bar(cells=CELLS, **options) -> sb.Scene:
    """A soft bar clamped at one end that falls."""
    mesh = sb.mesh.bricks(SIZE, cells)
    numbers = {"density": 1000.0, "E": 1e5, "poisson": 0.45, "damping": 4e-3, **options}
    return sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], **numbers)


@pytest.mark.parametrize("method", SOLVERS)
def test_gradients_are_exact(method):
    """Of every quantity and input array against complex step, in a bar of two bricks, one of them skewed."""
    mesh = sb.mesh.bricks((0.04, 0.02, 0.02), (2, 1, 1))
    moved = mesh.vertices + np.random.default_rng(0).uniform(-1e-3, 1e-3, mesh.vertices.shape)
    mesh = sb.SolidMesh(moved, mesh.elements, dict(mesh.sets))
    scene = sb.solid(mesh, density=1000.0, E=1e4, poisson=0.45, damping=4e-3, pinned=mesh.sets["x_min"])
    found = sb.check_gradients(scene, [0.0, 0.006], SOLVERS[method], samples=3)
    assert all(row.passed for row in found.rows), str(found)
    assert {"solid_E", "solid_poisson", "solid_density", "solid_damping"} <= {row.name for row in found.rows}
    assert max(row.complex_step for row in found.rows if not row.unfelt) < 1e-8


def test_gradients_without_a_volume_row():
    scene = bar((2, 1, 1), poisson=-0.2)
    found = sb.check_gradients(scene, [0.0, 0.006], SOLVERS["newton"], samples=3)
    assert all(row.passed for row in found.rows), str(found)
    assert "bar_poisson" in {row.name for row in found.rows}


def test_rest_positions_have_gradients():
    """What a move of the shape at rest changes, through gradients, volumes and masses, against differences."""
    solver, times = SOLVERS["newton"], [0.0, 0.02]
    mesh = sb.mesh.bricks(SIZE, (2, 1, 1))
    (tip,) = mesh.nearest([SIZE])
    fixed = mesh.vertices.copy()

    def scene(by: float) -> sb.Scene:
        vertices = mesh.vertices.copy()
        vertices[tip, 2] += by
        own = sb.SolidMesh(vertices, mesh.elements, dict(mesh.sets))
        still = mesh.sets["x_min"]
        return sb.solid(own, density=1000.0, E=1e4, poisson=0.45, pinned=still, positions=fixed)

    def place(by: float) -> float:
        return float(sb.simulate(scene(by), times, solver).positions[-1, tip, 2])

    rolled = sb.rollout(scene(0.0), times, solver)
    weights = np.zeros_like(rolled.positions)
    weights[-1, tip, 2] = 1.0
    d, layout = 1e-6, scene(0.0).compiled.layout
    change = (scene(d).compiled.inputs() - scene(-d).compiled.inputs()) / (2 * d)
    along = sum(
        float(np.ravel(bar) @ change[layout[name][0] : layout[name][0] + layout[name][1]])
        for name, bar in rolled.gradient(weights).inputs.items()
    )
    assert along == approx((place(d) - place(-d)) / (2 * d), rel=1e-6)


def test_methods_agree():
    """Blocks of particles are the blocks of rows, solved the other way; "implicit" has the geometric stiffness too."""
    times = np.arange(6) / 100
    found = {m: sb.simulate(bar((3, 1, 1)), times, SOLVERS[m]).positions for m in ("newton", "newton_cg", "direct")}
    assert found["newton"] == approx(found["direct"], abs=1e-10)
    assert found["newton_cg"] == approx(found["direct"], abs=1e-10)
    short = [sb.Solver(h=2.5e-4, method=m) for m in ("newton", "implicit")]
    ends = [sb.simulate(bar((3, 1, 1)), times, s).positions[-1] for s in short]
    assert ends[0] == approx(ends[1], abs=2e-5)


def test_markers_on_faces_and_inside():
    scene = bar()
    solid = scene.solids["bar"]
    points = [[0.1, 0.013, 0.02], [0.05, 0.02, 0.007], [0.033, 0.011, 0.004], [0.1, 0.02, 0.02]]
    places = sb.on_solid(solid, points)
    assert [len(p.particles) for p in places] == [2, 4, 8, 1]
    for place, point in zip(places, points, strict=True):
        assert np.asarray(place.weights) @ scene.positions[list(place.particles)] == approx(np.array(point), abs=1e-12)
    with pytest.raises(sb.MeshError, match="outside"):
        sb.on_solid(solid, [[0.2, 0.0, 0.0]])


TWIN_SOLVER = sb.Solver(h=4e-3, method="newton")


def test_a_swinging_bar_is_identified():
    """E, Poisson's ratio and damping from markers on its surface and one inside: the intervals hold the truth."""
    scene = bar()
    times = np.arange(0, 0.4, 0.008)
    solid = scene.solids["bar"]
    points = [[x, y, z] for x in (0.04, 0.07, 0.1) for y, z in ((0.0, 0.01), (0.01, 0.02), (0.02, 0.005))]
    places = sb.on_solid(solid, [*points, [0.08, 0.011, 0.012]])
    x = sb.simulate(scene, times, TWIN_SOLVER).positions
    seen = np.stack([np.einsum("k,fkx->fx", p.weights, x[:, list(p.particles)]) for p in places], axis=1)
    sigma = 2e-4
    noisy = seen + sigma * np.random.default_rng(5).standard_normal(seen.shape)
    recording = sb.Recording(positions=noisy, times=times, name="twin")
    start = {"bar_E": {"initial": 1.6e5}, "bar_poisson": {"initial": 0.3}, "bar_damping": {"initial": 1e-2}}
    found = sb.fit(scene, recording, start, markers=places, solver=TWIN_SOLVER, sigma=sigma, refine=False)
    for name, truth in (("bar_E", 1e5), ("bar_poisson", 0.45), ("bar_damping", 4e-3)):
        lower, upper = found[name].lower, found[name].upper
        assert lower < truth < upper, str(found.report())
        assert upper - lower < {"bar_E": 1e4, "bar_poisson": 0.2, "bar_damping": 1e-3}[name]


def test_a_scene_file_gives_the_same_bits(tmp_path):
    scene = bar((2, 1, 1))
    sb.save_scene(scene, tmp_path / "bar.scene")
    again = sb.load_scene(tmp_path / "bar.scene")
    times = [0.0, 0.02]
    before, after = (sb.simulate(s, times, SOLVERS["newton"]).positions for s in (scene, again))
    assert np.array_equal(before, after)


def test_threads_do_not_change_bits():
    times = [0.0, 0.02]
    one, two = (sb.simulate(bar(), times, sb.Solver(h=2e-3, method="newton", threads=n)).positions for n in (1, 2))
    assert np.array_equal(one, two)


def test_surfaces_are_shown():
    scene = bar((2, 1, 1))
    motion = sb.simulate(scene, [0.0, 0.02], SOLVERS["newton"])
    sheet = shown.of_trajectory(scene, motion).sheets["bar"]
    assert sheet.triangles.shape == (20, 3)
    assert sheet.strain.max() > 0


def test_refusals():
    mesh = sb.mesh.bricks(SIZE, (2, 1, 1))
    for numbers, match in (
        ({"poisson": 0.5}, "poisson"),
        ({"poisson": -0.1, "volume_row": True}, "positive"),
        ({"E": -1.0}, "E"),
        ({"held": np.arange(12)}, "all vertices"),
    ):
        with pytest.raises(sb.SceneError, match=match):
            sb.solid(mesh, **{"density": 1000.0, "E": 1e5, "poisson": 0.3, **numbers})
    scene = sb.Scene("two")
    sb.add_solid(scene, mesh, "a", material="gel", density=1000.0, E=1e5, poisson=0.3)
    with pytest.raises(sb.SceneError, match="gel"):
        sb.add_solid(scene, mesh, "b", material="gel", density=1000.0, E=2e5, poisson=0.3)
