"""Solids of clusters (shape matching): frames at rest, masses, energies, gradients, and a fit of four stiffnesses."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.arrays.rotations import rotation_matrix
from sheetbend.objects.solid_clusters import volumes_of
from test_solid_motion import SOLVERS

E, DENSITY, SIDE = 1e5, 1000.0, 0.1
TURN = rotation_matrix("turn", np.deg2rad(37) * np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0))


def cube(positions=None, n=2, **options) -> tuple[sb.Scene, sb.Solid]:
    """Of one cluster."""
    mesh = sb.mesh.bricks((SIDE,) * 3, (n,) * 3)
    scene = sb.Scene("cube", gravity=(0, 0, 0))
    clusters = [np.arange(len(mesh.vertices))]
    options = {"density": DENSITY, "E": E, "clusters": clusters, **options}
    return scene, sb.add_solid(scene, mesh, "cube", positions=positions, **options)


def polar(mesh: sb.SolidMesh, x: np.ndarray) -> np.ndarray:
    """The rotation that a cluster of all vertices has where they are at x."""
    v = volumes_of(mesh)[:, None]
    centered = [y - (v * y).sum(axis=0) / v.sum() for y in (x, mesh.vertices)]
    left, _, right = np.linalg.svd((v * centered[0]).T @ centered[1])
    return np.asarray(left @ right)


def test_axes_at_rest_are_the_polar_rotation():
    """Of a cube that is turned by 37 degrees and stretched by (1, 1.2, 0.9), and their derivative is that of the
    rotation."""
    unmoved, solid = cube()
    frame = unmoved.rotors["cube_0"][1:4]
    own = unmoved.nodes[frame].T
    x = solid.mesh.vertices * [1.0, 1.2, 0.9] @ TURN.T
    scene, solid = cube(positions=x)
    scene.pin(solid.particles)
    start = scene.nodes
    start[frame] = start[frame] @ rotation_matrix("off", (0.2, -0.1, 0.3)).T
    rest = sb.equilibrium(scene, start=start)
    axes = rest.nodes[frame].T
    assert axes == approx(polar(solid.mesh, x) @ own, abs=1e-13)

    random = np.random.default_rng(0)
    weights, move = np.zeros_like(rest.nodes), random.standard_normal(x.shape)
    weights[frame] = random.standard_normal((3, 3))
    offset, size = scene.compiled.layout["position"]
    by_start = rest.input_gradient(weights)[offset : offset + size].reshape(-1, 3)

    def turned(step: float) -> float:
        return float(((polar(solid.mesh, x + step * move) @ own).T * weights[frame]).sum())

    d = 1e-4
    slope = (8 * (turned(d) - turned(-d)) - turned(2 * d) + turned(-2 * d)) / (12 * d)
    assert float((by_start[solid.particles] * move).sum()) == approx(slope, rel=1e-8)


def test_frames_have_a_share_of_the_mass():
    """So that a solid that turns as a whole has the kinetic energy of the masses that it was given."""
    mesh = sb.mesh.bricks((0.2, 0.05, 0.06), (8, 2, 2))
    spin, velocity = np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.2, -0.1])
    moving = velocity + np.cross(spin, mesh.vertices)
    scene = sb.Scene("bar", gravity=(0, 0, 0))
    sb.add_solid(scene, mesh, density=DENSITY, E=E, clusters=sb.cluster_boxes(mesh, 0.06), velocities=moving)
    compiled = scene.compiled
    inputs = compiled.inputs()
    mass, v = (inputs[a : a + n] for a, n in (compiled.layout[name] for name in ("mass", "velocity")))
    expected = DENSITY * (volumes_of(mesh) * (moving**2).sum(axis=1)).sum() / 2
    assert (mass * (v.reshape(-1, 3) ** 2).sum(axis=1)).sum() / 2 == approx(expected, rel=1e-12)
    assert mass[: scene.particle_count].sum() == approx(DENSITY * 0.2 * 0.05 * 0.06, rel=1e-12)


def test_energy_of_an_even_strain():
    """That of Young's modulus E and Poisson's ratio 0: E tr e^2/2, of any small strain of a cube; none of a turn."""
    scene, solid = cube()
    strain = 1e-5 * np.array([[3.0, 1.0, -2.0], [1.0, -1.0, 0.5], [-2.0, 0.5, 2.0]])
    x = scene.nodes
    x[solid.particles] = solid.mesh.vertices @ (np.eye(3) + strain)
    center = scene.rotors["cube_0"][0]
    x[center] = x[solid.particles].mean(axis=0)
    stored = sum(float(e.sum()) for e in sb.elastic_energy(scene, x).values())
    assert stored == approx(E * (strain * strain).sum() / 2 * SIDE**3, rel=1e-10)
    scene, _ = cube(positions=solid.mesh.vertices @ TURN.T)
    assert sum(float(e.sum()) for e in sb.elastic_energy(scene, scene.nodes).values()) == approx(0.0, abs=1e-25 * E)


def bar(**options) -> sb.Scene:
    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), (5, 1, 1))
    clusters = [np.flatnonzero(np.abs(mesh.vertices[:, 0] - x) < 0.021) for x in (0.02, 0.04, 0.06, 0.08)]
    numbers = {"density": DENSITY, "E": E, "clusters": clusters, "damping": 4e-3, **options}
    return sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], **numbers)


@pytest.mark.parametrize("method", ["newton", "implicit", "direct"])
def test_gradients_are_exact(method):
    scene = bar(E=(E, 2 * E, E, 3 * E))
    found = sb.check_gradients(scene, [0.0, 0.006], SOLVERS[method], samples=3)
    assert all(row.passed for row in found.rows), str(found)
    assert {"bar_E_0", "bar_E_3", "bar_density", "bar_damping"} <= {row.name for row in found.rows}
    assert max(row.complex_step for row in found.rows if not row.unfelt) < 1e-8


def test_methods_agree():
    times = np.arange(6) / 100
    found = {m: sb.simulate(bar(), times, SOLVERS[m]).positions for m in ("newton", "direct")}
    assert found["newton"] == approx(found["direct"], abs=1e-9)
    ends = [sb.simulate(bar(), times, sb.Solver(h=5e-4, method=m)).positions[-1] for m in ("direct", "implicit")]
    assert ends[0] == approx(ends[1], abs=2e-5)


def test_a_stiffness_of_each_cluster_is_identified():
    solver, times = sb.Solver(h=4e-3, method="implicit"), np.arange(0, 0.32, 0.008)
    truth = (1e5, 2e5, 1.2e5, 0.6e5)
    scene = bar(E=truth)
    solid = scene.solids["bar"]
    x = sb.simulate(scene, times, solver).positions[:, solid.particles]
    sigma = 3e-5
    noisy = x + sigma * np.random.default_rng(5).standard_normal(x.shape)
    recording = sb.Recording(positions=noisy, times=times, name="twin")
    start = {f"bar_E_{c}": {"initial": 1.1e5} for c in range(4)}
    places = sb.on_solid(solid, solid.mesh.vertices)
    found = sb.fit(scene, recording, start, markers=places, solver=solver, sigma=sigma, refine=False, profiles=False)
    for c, e in enumerate(truth):
        assert found[f"bar_E_{c}"].lower < e < found[f"bar_E_{c}"].upper, str(found.report())
        assert found[f"bar_E_{c}"].value == approx(e, rel=0.05)


def test_boxes_overlap_by_half():
    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), (10, 2, 2))
    found = sb.cluster_boxes(mesh, 0.02)
    assert [len(own) for own in found] == [27] * 9
    assert (np.bincount(np.concatenate(found)) >= 1).all()
    with pytest.raises(sb.SceneError, match="no cluster"):
        sb.cluster_boxes(mesh, 0.005)


def test_clusters_of_equal_size_may_be_one_array():
    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), (5, 1, 1))
    each = np.array([np.arange(16), np.arange(8, 24)])
    found, listed = (
        sb.solid(mesh, density=DENSITY, E=E, clusters=clusters).solids["solid"].numbers
        for clusters in (each, each.tolist())
    )
    assert found == listed
    orthotropic = sb.Orthotropic((E,) * 3, (E,) * 3, (0.0,) * 3)
    with pytest.raises(sb.SceneError, match="clusters: is given beside orthotropic"):
        sb.solid(mesh, density=DENSITY, orthotropic=orthotropic, clusters=each)


def test_refusals():
    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), (5, 1, 1))
    whole = [np.arange(24)]
    for numbers, match in (
        ({"clusters": [np.arange(20)]}, "leave vertices out"),
        ({"clusters": [*whole, mesh.sets["x_min"]]}, "plane"),
        ({"clusters": []}, "none"),
        ({"clusters": whole, "poisson": 0.3}, "poisson"),
        ({"clusters": whole, "law": "neo_hookean"}, "law"),
        ({"clusters": whole, "E": (E, E)}, "shape"),
        ({"clusters": whole, "E": 0.0}, "positive"),
        ({"clusters": whole, "E": None}, "missing"),
    ):
        with pytest.raises(sb.SceneError, match=match):
            sb.solid(mesh, **{"density": DENSITY, "E": E, **numbers})
