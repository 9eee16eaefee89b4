"""Grids, the disk and the sphere: sizes, sets, shapes of triangles."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

CELLS = {"alternating": 2, "one_way": 2, "crossed": 4}


@settings(max_examples=25, deadline=None)
@given(
    width=st.floats(0.01, 5),
    height=st.floats(0.01, 5),
    nx=st.integers(1, 8),
    ny=st.integers(1, 8),
    pattern=st.sampled_from(sorted(CELLS)),
)
def test_a_grid_fills_its_rectangle(width: float, height: float, nx: int, ny: int, pattern: str) -> None:
    mesh = sb.mesh.grid(width, height, nx, ny, pattern)
    assert len(mesh.triangles) == CELLS[pattern] * nx * ny
    assert mesh.areas == approx(np.full(len(mesh.triangles), width * height / len(mesh.triangles)))
    check_sides(mesh, width, height)


@settings(max_examples=25, deadline=None)
@given(width=st.floats(0.1, 3), height=st.floats(0.1, 3), n=st.integers(1, 12))
def test_rows_of_equilateral_triangles_fill_theirs(width: float, height: float, n: int) -> None:
    mesh = sb.mesh.equilateral(width, height, n)
    assert mesh.areas.sum() == approx(width * height)
    check_sides(mesh, width, height)


def check_sides(mesh: sb.TriangleMesh, width: float, height: float) -> None:
    x, y, z = mesh.vertices.T
    assert not z.any() and np.array_equal(mesh.material, mesh.vertices[:, :2])
    for name, on, along in (
        ("left", x == 0, y),
        ("right", x == width, y),
        ("bottom", y == 0, x),
        ("top", y == height, x),
    ):
        side = mesh.sets[name]
        assert sorted(side.tolist()) == np.flatnonzero(on).tolist()
        assert (np.diff(along[side]) > 0).all()
    corners = mesh.vertices[mesh.sets["corners"], :2]
    assert corners.tolist() == [[0, 0], [width, 0], [width, height], [0, height]]
    assert len(mesh.boundary) == 1 and len(mesh.boundary[0]) == len(mesh.borders)


def test_the_diagonals_of_the_patterns() -> None:
    def diagonals(pattern: str) -> set[float]:
        mesh = sb.mesh.grid(1.0, 1.0, 4, 4, pattern)
        along = mesh.material[mesh.edges[:, 1]] - mesh.material[mesh.edges[:, 0]]
        return {round(float(a[0] * a[1] / abs(a[0] * a[1]))) for a in along if a.all()}

    assert diagonals("one_way") == {1} and diagonals("alternating") == diagonals("crossed") == {-1, 1}
    degree = np.bincount(sb.mesh.grid(1.0, 1.0, 4, 4).edges.ravel())
    assert sorted(set(degree[[6, 7, 8, 11, 12, 13, 16, 17, 18]].tolist())) == [4, 8]  # union jack: no zigzag rows


def test_equilateral_triangles_are_equilateral_but_for_the_stretch_of_their_rows() -> None:
    mesh = sb.mesh.equilateral(1.0, 10 * np.sqrt(3) / 2 / 8, 8)
    sides = np.linalg.norm(mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2)
    half = np.isclose(sides.min(axis=1), 1 / 16)
    assert half.sum() == 2 * 10 and sides[~half] == approx(1 / 8)


@pytest.mark.parametrize("rings", [1, 2, 5])
def test_a_disk_has_its_rim_on_the_circle_and_turns_into_itself(rings: int) -> None:
    mesh = sb.mesh.disk(0.3, rings)
    n = 6 * rings
    assert len(mesh.triangles) == 6 * rings**2
    assert np.linalg.norm(mesh.vertices[mesh.sets["rim"]], axis=1) == approx(np.full(n, 0.3))
    assert mesh.areas.sum() == approx(0.3**2 * n / 2 * np.sin(2 * np.pi / n))
    assert np.roll(mesh.boundary[0], -int(mesh.boundary[0].argmin())).tolist() == mesh.sets["rim"].tolist()
    assert mesh.vertices[mesh.sets["center"]] == approx(np.zeros((1, 3)), abs=1e-12)
    c, s = 0.5, np.sqrt(0.75)
    turned = mesh.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    assert mesh.vertices[mesh.nearest(turned)] == approx(turned, abs=1e-12)
    assert mesh.doubts == ()


def test_a_disk_puts_a_ring_on_its_support() -> None:
    mesh = sb.mesh.disk(0.15, 10, support=0.088)
    distance = np.linalg.norm(mesh.vertices, axis=1)
    support = mesh.sets["support"]
    assert len(support) == 1 + 3 * 6 * 7 and distance[support].max() == approx(0.088)
    assert np.isclose(distance, 0.088).sum() == 36 and np.delete(distance, support).min() > 0.09


@pytest.mark.parametrize("subdivisions", [0, 1, 3])
def test_a_sphere_is_closed_and_seen_from_outside(subdivisions: int) -> None:
    mesh = sb.mesh.icosphere(0.5, subdivisions)
    assert len(mesh.triangles) == 20 * 4**subdivisions and mesh.boundary == ()
    assert np.linalg.norm(mesh.vertices, axis=1) == approx(0.5)
    a, b, c = (mesh.vertices[mesh.triangles[:, j]] for j in range(3))
    assert ((a * np.cross(b, c)).sum(axis=1) > 0).all()
    assert mesh.areas == approx(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)  # the flat shapes are exact


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sb.mesh.grid(0.0, 1.0, 2, 2), "width: must be a positive length"),
        (lambda: sb.mesh.grid(1.0, np.inf, 2, 2), "height: must be a positive length"),
        (lambda: sb.mesh.grid(1.0, 1.0, 0, 2), "nx: must be a whole number, at least 1"),
        (lambda: sb.mesh.grid(1.0, 1.0, 2, 2, "zigzag"), "pattern: is unknown .*alternating, crossed, one_way"),
        (lambda: sb.mesh.equilateral(1.0, 1.0, 2.5), "n: must be a whole number"),
        (lambda: sb.mesh.disk(-1.0, 3), "radius: must be a positive length"),
        (lambda: sb.mesh.disk(1.0, 3, support=0.95), "support: must be near a ring inside of the rim"),
        (lambda: sb.mesh.icosphere(1.0, -1), "subdivisions: must be a whole number, at least 0"),
    ],
)
def test_impossible_sizes_are_refused(make: object, message: str) -> None:
    with pytest.raises(sb.MeshError, match=message):
        make()
