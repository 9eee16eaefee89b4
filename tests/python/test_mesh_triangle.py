"""Triangle meshes: who meets whom, named sets, and what is refused."""

from __future__ import annotations

import pickle
from collections import Counter

import numpy as np
import pytest
import sheetbend as sb
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
MESHES = {
    "alternating": lambda: sb.mesh.grid(1.0, 0.5, 5, 3),
    "crossed": lambda: sb.mesh.grid(1.0, 0.5, 2, 3, "crossed"),
    "equilateral": lambda: sb.mesh.equilateral(1.0, 1.0, 4),
    "disk": lambda: sb.mesh.disk(0.2, 4),
    "sphere": lambda: sb.mesh.icosphere(0.1, 2),
}


def square(**changes: object) -> sb.TriangleMesh:
    fields = {"vertices": SQUARE, "triangles": HALVES, "material": SQUARE[:, :2], **changes}
    return sb.TriangleMesh(**fields)


def orientations(mesh: sb.TriangleMesh) -> set[tuple[int, ...]]:
    """Every triangle as it may be written, starting from each corner."""
    return {tuple(np.roll(t, -j)) for t in mesh.triangles.tolist() for j in range(3)}


@pytest.mark.parametrize("name", MESHES)
def test_edges_hinges_and_borders_count_every_side_once(name: str) -> None:
    mesh = MESHES[name]()
    sides = Counter(
        tuple(sorted(side)) for t in mesh.triangles.tolist() for side in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))
    )
    assert set(map(tuple, mesh.edges.tolist())) == set(sides) and len(mesh.edges) == len(sides)
    interior = {tuple(sorted(hinge[:2])) for hinge in mesh.hinges.tolist()}
    assert interior == {edge for edge, uses in sides.items() if uses == 2} and len(interior) == len(mesh.hinges)
    assert {tuple(sorted(b)) for b in mesh.borders.tolist()} == {edge for edge, uses in sides.items() if uses == 1}


@pytest.mark.parametrize("name", MESHES)
def test_a_hinge_names_its_triangles_as_they_are_oriented(name: str) -> None:
    mesh = MESHES[name]()
    turned = orientations(mesh)
    for (v0, v1, a, b), (first, second) in zip(mesh.hinges.tolist(), mesh.hinge_triangles.tolist(), strict=True):
        assert (v0, v1, a) in turned and (v1, v0, b) in turned
        assert {v0, v1, a} == set(mesh.triangles[first].tolist())
        assert {v0, v1, b} == set(mesh.triangles[second].tolist())


@pytest.mark.parametrize(("name", "loops", "euler"), [("alternating", 1, 1), ("disk", 1, 1), ("sphere", 0, 2)])
def test_loops_and_euler_number(name: str, loops: int, euler: int) -> None:
    mesh = MESHES[name]()
    assert len(mesh.boundary) == loops
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.triangles) == euler


def test_loops_are_in_order_with_the_fabric_on_the_left_also_around_a_hole() -> None:
    whole = sb.mesh.grid(1.0, 1.0, 5, 5)
    centers = whole.vertices[whole.triangles].mean(axis=1)
    kept = whole.triangles[(np.abs(centers[:, :2] - 0.5) > 0.1).any(axis=1)]
    mesh = sb.TriangleMesh(whole.vertices, kept, whole.material)
    outer, hole = mesh.boundary
    borders = set(map(tuple, mesh.borders.tolist()))
    for loop in mesh.boundary:
        assert loop[0] == loop.min()
        assert set(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)) <= borders
    assert [round(area(mesh, loop), 12) for loop in (outer, hole)] == [1.0, -0.04]


def area(mesh: sb.TriangleMesh, loop: np.ndarray) -> float:
    """Signed area that a loop encloses, m^2."""
    x, y = mesh.vertices[loop, :2].T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def test_areas_are_those_of_the_material_per_vertex_or_per_corner() -> None:
    stretched = square(material=SQUARE[:, :2] * [2.0, 3.0])
    assert stretched.areas == approx(np.array([3.0, 3.0]))
    assert square(material=stretched.corners.copy()).areas == approx(np.array([3.0, 3.0]))


def test_the_mesh_cannot_be_changed_and_keeps_no_hold_of_what_it_was_made_from() -> None:
    material = SQUARE[:, :2].copy()
    mesh = square(material=material)
    material[0] = 9.0
    assert mesh.material[0].tolist() == [0.0, 0.0]
    for array in (mesh.vertices, mesh.triangles, mesh.material, mesh.areas, mesh.edges, mesh.hinges):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_sets_boxes_and_nearest_vertices() -> None:
    mesh = sb.mesh.grid(1.0, 0.5, 4, 2).with_set("middle", [7])
    assert mesh.sets["middle"].tolist() == [7] and "left" in mesh.sets
    assert mesh.within([-np.inf, 0.5, 0], [np.inf, 0.5, 0]).tolist() == mesh.sets["top"].tolist()
    assert mesh.within([2, 2, 2], [3, 3, 3]).size == 0
    with pytest.raises(sb.MeshError, match="upper: must be three numbers"):
        mesh.within([0, 0, 0], [1, 1])
    assert mesh.nearest(mesh.vertices + np.array([0.1, -0.1, 0.3])).tolist() == list(range(len(mesh.vertices)))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 30))
def test_nearest_agrees_with_all_distances(seed: int, count: int) -> None:
    mesh, points = sb.mesh.disk(0.2, 5), np.random.default_rng(seed).uniform(-0.3, 0.3, (count, 3))
    distance = np.linalg.norm(mesh.vertices[None] - points[:, None], axis=2)
    assert distance[np.arange(count), mesh.nearest(points)] == approx(distance.min(axis=1))


def test_a_mesh_survives_a_pickle() -> None:
    mesh = sb.mesh.grid(1.0, 1.0, 2, 2)
    again = pickle.loads(pickle.dumps(mesh))
    assert np.array_equal(again.material, mesh.material) and again.sets.keys() == mesh.sets.keys()


FAN = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
REFUSED = {
    "shape of the vertices": ({"vertices": SQUARE[:, :2]}, "vertices: have the wrong shape"),
    "not finite": ({"vertices": SQUARE * np.nan}, "vertices: is not finite"),
    "float indices": ({"triangles": HALVES * 1.0}, "triangles: must be whole numbers"),
    "index out of range": (
        {"triangles": [[0, 1, 2], [0, 2, 4]]},
        r"in triangle 1 \(got \[0, 2, 4\]\). Fix: use 0 to 3",
    ),
    "corner twice": ({"triangles": [[0, 1, 2], [0, 3, 3]]}, "name a vertex twice, in triangle 1"),
    "material of another mesh": ({"material": np.zeros((5, 2))}, r"give \(4, 2\) per vertex or \(2, 3, 2\)"),
    "unused vertex": ({"triangles": [[0, 1, 2]]}, r"belong to no triangle \(1 of 4\) \(got \[3\]\)"),
    "no area": ({"material": [[0, 0], [1, 0], [1, 1], [0.5, 0.5]]}, "gives triangle 1 no area"),
    "all clockwise": ({"material": SQUARE[:, [1, 0]]}, "is clockwise in every triangle"),
    "one inverted": ({"material": [[0, 0], [1, 0], [1, 1], [0.8, 0.1]]}, "inverts triangle 1"),
    "one flipped": ({"triangles": [[0, 1, 2], [0, 3, 2]]}, r"oriented against each other along the edge \[2, 0\]"),
    "three on an edge": (
        {"vertices": [*SQUARE, [0.5, 0.5, 1]], "triangles": [*HALVES, [2, 0, 4]], "material": [*SQUARE[:, :2], [0, 2]]},
        r"not manifold: 3 of them share the edge \[0, 2\] \(the only one\) \(got \[0, 1, 2\]\)",
    ),
    "bow tie": (
        {"vertices": FAN, "triangles": [[0, 1, 2], [0, 3, 4]], "material": FAN[:, :2]},
        r"join parts that share no edge \(the only one\) \(got \[0\]\)",
    ),
    "set out of range": ({"sets": {"grip": [4]}}, r"sets\['grip'\]: names vertices that do not exist"),
    "set twice": ({"sets": {"grip": [1, 1]}}, "names a vertex twice"),
    "set of nothing": ({"sets": {"grip": []}}, "at least one"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_broken_meshes_are_refused_by_name(case: str) -> None:
    changes, message = REFUSED[case]
    with pytest.raises(sb.MeshError, match=message):
        square(**changes)


def test_two_triangles_on_every_edge_may_still_pinch_a_vertex() -> None:
    """Two closed surfaces that touch in one vertex have no border to give them away."""
    ball = sb.mesh.icosphere(1.0, 0)
    top = int(ball.vertices[:, 2].argmax())
    renamed = np.where(ball.triangles == top, top, ball.triangles + len(ball.vertices))
    triangles = np.vstack([ball.triangles, renamed])
    used, triangles = np.unique(triangles, return_inverse=True)
    mirrored = np.vstack([ball.vertices, ball.vertices * [1, 1, -1] + [0, 0, 2]])[used]
    with pytest.raises(sb.MeshError, match="join parts that share no edge"):
        sb.TriangleMesh(mirrored, triangles.reshape(-1, 3), np.vstack([ball.corners, ball.corners]))


def test_doubts_name_splinters_parts_cracks_and_seams() -> None:
    assert [make().doubts for name, make in MESHES.items() if name != "sphere"] == [()] * 4
    splinter = square(material=[[0, 0], [1, 0], [1, 1], [0.49, 0.51]])
    assert (
        len(splinter.doubts) == 1
        and "1 of 2 triangles are splinters, the worst is 1 with 1.1 degrees" in splinter.doubts[0]
    )
    shifted, material = SQUARE + np.array([1, 0, 0]), np.vstack([SQUARE, SQUARE])[:, :2]
    two = sb.TriangleMesh(np.vstack([SQUARE, shifted]), np.vstack([HALVES, HALVES + 4]), material)
    parts, crack = two.doubts
    assert "2 parts that do not hang together (their first vertices: 0, 4)" in parts
    assert "4 vertices lie on top of others (1, 2, 4, 7)" in crack
    corners = square().corners.copy()
    corners[1] = 1.01 * corners[1] @ [[0.0, 1.0], [-1.0, 0.0]]
    gathered, jump = square(material=corners).doubts
    assert "1 edges have different lengths" in gathered and "across 1 edges, by up to 90 degrees" in jump
