"""O-23: what hinges make of a curvature on different patterns, by two independent paths."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from pytest import approx

Array = np.ndarray
DEGREES = np.radians([0.0, 45.0, 90.0, 135.0])


def bent(mesh: sb.TriangleMesh, direction: float, radius: float) -> Array:
    """The mesh's material laid on a cylinder, curved along `direction`, (n, 3) m."""
    along, across = np.array([np.cos(direction), np.sin(direction)]), np.array([-np.sin(direction), np.cos(direction)])
    s, w = mesh.material @ along, mesh.material @ across
    flat = np.outer(radius * np.sin(s / radius), along) + np.outer(w, across)
    return np.column_stack([flat, radius * (1 - np.cos(s / radius))])


def hinge_ratio(mesh: sb.TriangleMesh, direction: float, radius: float = 20.0) -> float:
    """E / (k/2 kappa^2 A) from the dihedral angles of the bent mesh."""
    x = bent(mesh, direction, radius)
    v0, v1, a, b = (x[mesh.hinges[:, i]] for i in range(4))
    first, second = np.cross(v1 - v0, a - v0), np.cross(v0 - v1, b - v1)
    sine = np.linalg.norm(np.cross(first, second), axis=1)
    angle = np.arctan2(sine, (first * second).sum(axis=1))
    edge = mesh.corners[mesh.hinge_triangles[:, 0]]
    at = mesh.triangles[mesh.hinge_triangles[:, 0]]
    ends = [np.take_along_axis(edge, (at == v[:, None]).argmax(1)[:, None, None], 1)[:, 0] for v in mesh.hinges.T[:2]]
    square = ((ends[1] - ends[0]) ** 2).sum(axis=1)
    energy = (1.5 * square / mesh.areas[mesh.hinge_triangles].sum(axis=1) * angle**2).sum()
    return float(energy / (0.5 / radius**2 * mesh.areas.sum()))


@pytest.mark.parametrize(
    ("pattern", "n", "expected"),
    [
        ("one_way", 40, [2.925, 8.850, 2.925, 3.000]),
        ("alternating", 20, [2.85, 4.425, 2.85, 4.425]),
        ("crossed", 40, [4.425, 3.0, 4.425, 3.0]),
    ],
)
def test_oracle_23(pattern: str, n: int, expected: ArrayLike) -> None:
    mesh = sb.mesh.grid(1.0, 1.0, n, n, pattern)
    assert mesh.bending_ratio(DEGREES) == approx(np.array(expected), abs=1e-6)


@pytest.mark.parametrize(
    ("pattern", "limit"), [("one_way", [3, 9, 3, 3]), ("alternating", [3, 4.5, 3, 4.5]), ("crossed", [4.5, 3, 4.5, 3])]
)
def test_refined_patterns_approach_their_limits_with_the_border(pattern: str, limit: ArrayLike) -> None:
    coarse, fine = (sb.mesh.grid(1.0, 1.0, n, n, pattern).bending_ratio(DEGREES) - limit for n in (20, 40))
    assert fine == approx(coarse / 2, abs=1e-9)


def test_equilateral_triangles_bend_alike_in_all_directions() -> None:
    rows = 46
    mesh = sb.mesh.equilateral(1.0, rows * np.sqrt(3) / 2 / 40, 40)  # no row is stretched
    around = mesh.bending_ratio(np.radians(np.arange(0, 180, 5)))
    assert np.abs(around - 2.94).max() < 0.07  # borders, and the half triangles along two of them
    inner = [sb.mesh.equilateral(1.0, n * np.sqrt(3) / 2 / n, n).diagonal_bias for n in (10, 20, 40)]
    assert inner[0] - 1 > 1.8 * (inner[1] - 1) > 3 * (inner[2] - 1) and inner[2] < 1.01


@pytest.mark.parametrize("pattern", ["one_way", "alternating", "crossed"])
@pytest.mark.parametrize("direction", [0.0, 0.3, 0.785, 2.0])
def test_the_dihedral_angles_of_a_bent_mesh_say_the_same(pattern: str, direction: float) -> None:
    mesh = sb.mesh.grid(1.0, 0.7, 15, 9, pattern)
    assert hinge_ratio(mesh, direction, radius=200.0) == approx(float(mesh.bending_ratio(direction)), rel=1e-5)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), direction=st.floats(0, np.pi), turn=st.floats(-np.pi, np.pi))
def test_it_holds_on_irregular_meshes_and_turns_with_the_warp_axis(seed: int, direction: float, turn: float) -> None:
    random = np.random.default_rng(seed)
    regular = sb.mesh.grid(1.0, 1.0, 6, 6)
    moved = regular.material + random.uniform(-0.04, 0.04, regular.material.shape)
    mesh = sb.TriangleMesh(regular.vertices, regular.triangles, moved)
    assert hinge_ratio(mesh, direction, radius=500.0) == approx(float(mesh.bending_ratio(direction)), rel=1e-4)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    turned = sb.TriangleMesh(mesh.vertices, mesh.triangles, moved @ axes)
    assert turned.bending_ratio(direction + turn) == approx(mesh.bending_ratio(direction), rel=1e-9)
    per_corner = sb.TriangleMesh(mesh.vertices, mesh.triangles, mesh.corners.copy())
    assert per_corner.bending_ratio(direction) == approx(mesh.bending_ratio(direction), rel=1e-12)


def test_bias_is_that_of_the_pattern_and_not_of_the_border() -> None:
    """A strip four cells wide has as much of it as a wide sheet."""
    for pattern, bias in (("one_way", 4.0), ("alternating", 1.5), ("crossed", 1.5)):
        wide = sb.mesh.grid(1.0, 1.0, 30, 30, pattern)
        assert wide.diagonal_bias == approx(bias, rel=1e-9)
        assert wide.one_way_diagonals is (pattern == "one_way")
        assert sb.mesh.grid(0.06, 1.0, 4, 64, pattern).one_way_diagonals is (pattern == "one_way")
    assert np.isnan(sb.mesh.grid(1.0, 0.1, 10, 1).diagonal_bias) and not sb.mesh.grid(1.0, 0.1, 10, 1).one_way_diagonals


@pytest.mark.parametrize(("rings", "support"), [(10, None), (20, None), (40, None), (10, 0.09), (20, 0.085)])
def test_a_disk_has_no_preferred_direction(rings: int, support: float | None) -> None:
    mesh = sb.mesh.disk(0.15, rings, support)
    around = mesh.bending_ratio(np.linspace(0, np.pi, 30))
    assert np.ptp(around) < 1e-9
    assert around[0] == approx(3.0, rel=0.04 if support is None else 0.05)
