"""Meshes as colliders: distances, motions, gradients, configurations, pictures, and what is refused."""

from __future__ import annotations

import pickle
import tomllib
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import scene_alone
from sheetbend.config.schema import Config
from sheetbend.mesh import icosphere, unfold
from sheetbend.mesh.signed_distance import signed_distances
from sheetbend.pictures.collider_lines import collider_lines
from sheetbend.scene.distance_field import spline

RADIUS = 0.05
SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")
CORNERS = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij")).reshape(3, 8).T
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([[s[0], s[k], s[k + 1]] for s in SIDES for k in (1, 2)])


def mesh_of(vertices: np.ndarray, triangles: np.ndarray) -> sb.TriangleMesh:
    return sb.TriangleMesh(vertices, triangles, unfold(vertices, triangles))


def box_mesh(size: float) -> sb.TriangleMesh:
    return mesh_of(0.5 * size * CORNERS, FACES)


def box_distance(points: np.ndarray, size: float) -> np.ndarray:
    q = np.abs(points) - 0.5 * size
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


@pytest.fixture(scope="module")
def ball() -> sb.DistanceField:
    return sb.DistanceField(icosphere(RADIUS, 3), spacing=0.006, name="ball")


def test_distances_from_a_box_are_exact():
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (3000, 3))
    points[:8] = 0.08 * CORNERS  # whose closest points are corners
    found = signed_distances(box_mesh(0.1).vertices, FACES, points)
    assert found == pytest.approx(box_distance(points, 0.1), abs=1e-15)


def test_the_sign_is_right_at_sharp_edges():
    """Below a blade, where the face that is closest by rounding would say outside for a point inside or the reverse."""
    vertices = np.array([[0, 0, 0], [1, 0, 0.05], [1, 0, -0.05], [1, 1, 0]], dtype=float)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    volume = np.einsum(
        "kx,kx->", vertices[triangles[:, 0]], np.cross(vertices[triangles[:, 1]], vertices[triangles[:, 2]])
    )
    assert volume > 0
    outside = np.array([[-0.1, 0.0, 0.0], [-0.1, -0.1, 0.01], [-1e-6, 0.0, 1e-7], [1.2, 1.2, 0.0], [0.5, 0.0, 0.04]])
    inside = np.array([[0.9, 0.3, 0.0], [0.5, 0.05, 0.01], [0.99, 0.01, 0.03]])
    assert (signed_distances(vertices, triangles, outside) > 0).all()
    assert (signed_distances(vertices, triangles, inside) < 0).all()


def test_a_sphere_and_a_box_come_out_as_far_as_stated(ball: sb.DistanceField):
    grid, rng = ball.grid, np.random.default_rng(1)
    points = rng.normal(size=(2000, 3))
    points *= (RADIUS * rng.uniform(0.8, 1.2, len(points)) / np.linalg.norm(points, axis=1))[:, None]
    from_mesh = signed_distances(ball.mesh.vertices, ball.mesh.triangles, points)
    values = spline(grid.origin, grid.spacing, grid.coefficients, points)
    assert grid.error < 3e-4  # of facets, which are up to 1.5e-4 m below the sphere
    assert np.abs(values - from_mesh).max() < 3e-4
    assert np.abs(values - np.linalg.norm(points, axis=1) + RADIUS).max() < 3e-4
    field = sb.DistanceField(box_mesh(0.1), spacing=0.005)
    flat = np.column_stack([rng.uniform(-0.03, 0.03, (500, 2)), rng.uniform(0.04, 0.06, 500)])
    values = spline(field.grid.origin, field.grid.spacing, field.grid.coefficients, flat)
    assert np.abs(values - box_distance(flat, 0.1)).max() < 1.5e-4  # two cells from its edges
    assert 5e-4 < field.grid.error < 1.5e-3  # at its corners
    assert field.half_thickness == pytest.approx(0.05, abs=0.005)


def draped(shape: sb.Sphere | sb.DistanceField) -> sb.Scene:
    scene = sb.rope(0.2, 20, density=0.05, EA=200.0, EI=1e-5, start=(-0.1, 0, 0.055), pinned=())
    scene.add_contact(scene.ropes["rope"], shape, friction=0.4, radius=0.004, name="ball")
    return scene


def test_a_rope_lies_on_it_as_on_the_sphere(ball: sb.DistanceField):
    ways = [
        sb.simulate(draped(shape), [0.0, 0.3], SOLVER) for shape in (ball, sb.Sphere(center=(0, 0, 0), radius=RADIUS))
    ]
    apart = np.linalg.norm(ways[0].positions[-1][:21] - ways[1].positions[-1][:21], axis=1)
    assert ways[0].contacts["ball"].most > 3
    assert apart.max() < 1e-3


def test_it_moves_and_its_gradients_are_those_of_differences(ball: sb.DistanceField):
    moving = ball.moving([0.0, 0.1], [[0, 0, 0], [0.01, 0, 0.01]], [[0, 0, 0], [0, 0.3, 0]])
    assert moving.grid is ball.grid
    scene = draped(moving)
    report = sb.check_gradients(scene, [0.04], SOLVER, samples=2, seconds=2.0)
    assert report.passed, str(report)


def test_a_pickled_scene_has_the_same_bits(ball: sb.DistanceField):
    scene = draped(ball)
    core, inputs = SOLVER.core(scene.compiled), scene.compiled.inputs(scene.compiled.values({}))
    again = pickle.loads(pickle.dumps(core))
    assert np.array_equal(core.states(inputs, [20], 0.0), again.states(inputs, [20], 0.0))


def test_what_is_no_solid_is_refused(ball: sb.DistanceField, tmp_path: Path):
    whole = icosphere(RADIUS, 1)
    with pytest.raises(sb.SceneError, match="closed") as error:
        sb.DistanceField(mesh_of(whole.vertices, whole.triangles[:-1]), name="hand")
    assert error.value.field == "hand.mesh"
    with pytest.raises(sb.SceneError, match="inside out"):
        sb.DistanceField(mesh_of(whole.vertices, whole.triangles[:, ::-1]))
    with pytest.raises(sb.SceneError, match="grid points"):
        sb.DistanceField(whole, spacing=1e-5)
    with pytest.raises(sb.SceneError, match="too coarse"):
        sb.DistanceField(whole, spacing=20 * RADIUS)  # no grid point is inside: nothing would touch it
    with pytest.raises(sb.SceneError, match="must be positive"):
        sb.DistanceField(whole, margin=0.0)
    with pytest.raises(sb.SceneError, match="is not a mesh"):
        sb.DistanceField("hand.stl")
    scene = sb.Scene("far")
    scene.add_particles([[0.0, 0.0, 1.0]], 0.1)
    with pytest.raises(sb.SceneError, match="distances are known"):
        scene.add_contact([0], ball, friction=0.1, radius=0.1)
    scene.add_contact([0], ball, friction=0.1)
    with pytest.raises(sb.SceneError, match="scene files do not hold"):
        sb.save_scene(scene, tmp_path / "scene.npz")


def test_pictures_show_sections_of_it(ball: sb.DistanceField):
    scene = draped(ball)
    motion = sb.simulate(scene, [0.0, 0.01], SOLVER)
    lines = collider_lines(scene, motion.times, motion.positions)["ball"]
    far = np.linalg.norm(lines, axis=-1)
    assert lines.shape[0] == 2 and lines.shape[1] > 100
    assert far.max() < RADIUS * (1 + 1e-12) and far.min() > 0.97 * RADIUS


CONFIG = """
[experiment]
name = "on_a_ball"

[solver]
h = 2e-3
method = "implicit"
integrator = "bdf1"

[[scene.rope]]
length = 0.2
segments = 10
density = 0.05
EA = 200.0
EI = 1e-5
start = [-0.1, 0.0, 0.06]

[[scene.collider]]
name = "ball"
shape = "mesh"
file = "ball.obj"
unit = "mm"
position = [0.0, 0.0, 0.001]
spacing = 0.01

[[scene.contact]]
of = "rope"
collider = "ball"
friction = 0.4
radius = 0.004
"""


def test_a_configuration_names_its_file(tmp_path: Path):
    pytest.importorskip("trimesh")
    mesh = icosphere(1e3 * RADIUS, 2)
    rows = [*("v {} {} {}".format(*x) for x in mesh.vertices), *("f {} {} {}".format(*t) for t in mesh.triangles + 1)]
    (tmp_path / "ball.obj").write_text("\n".join(rows) + "\n")
    scene, _ = scene_alone(Config.model_validate(tomllib.loads(CONFIG)), tmp_path)
    collider = scene.contacts.colliders["ball"]
    assert isinstance(collider, sb.DistanceField)
    assert collider.extent == pytest.approx(RADIUS)
    assert collider.poses.positions[0] == pytest.approx([0.0, 0.0, 0.001])
