"""Places of markers: by material coordinates, and by projecting points of space."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx


def test_a_place_moves_with_the_fabric() -> None:
    mesh = sb.mesh.grid(1.0, 0.5, 7, 5)
    points = np.array([[0.0, 0.0], [1.0, 0.5], [0.3, 0.2], [0.5, 0.1], [0.777, 0.4999]])
    places = mesh.at(points)
    assert places.positions(mesh.vertices)[:, :2] == approx(points, abs=1e-12)
    assert places.weights.min() >= 0 and places.weights.sum(axis=1) == approx(np.ones(5))
    assert np.array_equal(places.vertices, mesh.triangles[places.triangles]) and len(places) == 5
    linear = np.array([[1.0, 2.0, -1.0], [0.5, 0.1, 3.0], [0.0, 0.0, 0.0]])
    frames = np.stack([mesh.vertices, mesh.vertices @ linear + [1.0, 2.0, 3.0]])
    moved = places.positions(frames)
    assert moved.shape == (2, 5, 3)
    assert moved[1] == approx(np.column_stack([points, np.zeros(5)]) @ linear + [1.0, 2.0, 3.0])


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_material_coordinates_are_found_again(seed: int) -> None:
    random = np.random.default_rng(seed)
    regular = sb.mesh.grid(1.0, 1.0, 8, 8)
    inner = regular.material + random.uniform(-0.03, 0.03, regular.material.shape)
    mesh = sb.TriangleMesh(regular.vertices, regular.triangles, inner)
    triangles = random.integers(len(mesh.triangles), size=50)
    weights = random.dirichlet([1, 1, 1], size=50)
    points = np.einsum("kc,kcx->kx", weights, mesh.corners[triangles])
    places = mesh.at(points)
    assert np.array_equal(places.triangles, triangles) and places.weights == approx(weights, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_projection_finds_the_closest_point(seed: int) -> None:
    """Against every triangle by itself, for points above, beside and on the mesh."""
    random = np.random.default_rng(seed)
    mesh = sb.mesh.icosphere(1.0, 0)
    points = random.normal(size=(3, 3)) * random.choice([0.3, 1.0, 3.0])
    found = mesh.project(points)
    distance = np.linalg.norm(found.positions(mesh.vertices) - points, axis=1)
    assert found.weights.min() >= 0 and found.weights.sum(axis=1) == approx(np.ones(3))
    assert distance == approx([closest_distance(mesh, point) for point in points], abs=1e-12)


def closest_distance(mesh: sb.TriangleMesh, point: np.ndarray) -> float:
    return min(distance_to_triangle(corners, point) for corners in mesh.vertices[mesh.triangles])


def distance_to_triangle(corners: np.ndarray, point: np.ndarray) -> float:
    """Of the foot of the perpendicular, where it is inside, otherwise of the closest point on a side."""
    sides = corners[1:] - corners[0]
    w = np.linalg.lstsq(sides.T, point - corners[0], rcond=None)[0]
    if w.min() >= 0 and w.sum() <= 1:
        return float(np.linalg.norm(corners[0] + w @ sides - point))
    along = np.roll(corners, -1, axis=0) - corners
    t = np.clip(((point - corners) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(corners + t[:, None] * along - point, axis=1).min())


def test_many_points_of_a_fine_mesh() -> None:
    mesh = sb.mesh.grid(1.0, 1.0, 40, 40)
    points = np.random.default_rng(0).uniform(0.0, 1.0, (300, 3))
    assert mesh.project(points).positions(mesh.vertices) == approx(points * [1, 1, 0], abs=1e-12)
    assert mesh.at(points[:, :2]).positions(mesh.vertices) == approx(points * [1, 1, 0], abs=1e-12)


def test_points_off_the_fabric_or_on_two_charts_are_refused() -> None:
    mesh = sb.mesh.grid(1.0, 1.0, 3, 3)
    with pytest.raises(sb.MeshError, match=r"points: lie outside of the material \(got \[1.001, 0.5\]\)"):
        mesh.at([[0.5, 0.5], [1.001, 0.5]])
    sphere = sb.mesh.icosphere(1.0, 1)
    with pytest.raises(sb.MeshError, match="lie in several triangles of the material"):
        sphere.at(sphere.corners.mean(axis=1))
    with pytest.raises(sb.MeshError, match="points: have the wrong shape"):
        mesh.at([0.5, 0.5])
