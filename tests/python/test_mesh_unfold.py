"""Material coordinates of shapes at rest."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx


def on_cylinder(material: np.ndarray, radius: float, slant: float = 0.0) -> np.ndarray:
    """A flat sheet (n, 2) laid on a cylinder along y, turned by `slant` before."""
    c, s = np.cos(slant), np.sin(slant)
    u, v = (material @ np.array([[c, s], [-s, c]])).T
    return np.column_stack([radius * np.sin(u / radius), v, radius * (1 - np.cos(u / radius))])


def side_lengths(corners: np.ndarray) -> np.ndarray:
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)


def test_a_flat_mesh_has_the_coordinates_of_its_plane() -> None:
    mesh = sb.mesh.equilateral(1.0, 0.7, 6)
    assert sb.mesh.unfold(mesh.vertices, mesh.triangles) == approx(mesh.material, abs=1e-12)
    assert sb.mesh.unfold(mesh.vertices, mesh.triangles, warp=(0.0, 2.0, 5.0)) == approx(
        mesh.material @ np.array([[0.0, -1.0], [1.0, 0.0]]), abs=1e-12
    )


def warp_in_chart(flat: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Angle (m,) rad of the true warp axis of each triangle (m, 3, 2) in the coordinates that were found."""
    u, v = (np.stack([c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]], axis=2) for c in (flat, found))
    first, second = (v @ np.linalg.inv(u))[:, :, 0].T
    return np.arctan2(second, first)


@settings(max_examples=15, deadline=None)
@given(slant=st.floats(-1.5, 1.5))
def test_a_bent_sheet_is_unrolled_along_its_warp_whatever_way_it_is_bent(slant: float) -> None:
    """Over 2.5 rad, where a projected direction would be tens of degrees off; its vertices leave only small gaps."""
    flat = sb.mesh.grid(1.0, 0.6, 30, 18)
    x = on_cylinder(flat.material, 0.4, slant)
    c, s = np.cos(slant), np.sin(slant)
    middle = x[flat.triangles].mean(axis=1)
    found = sb.mesh.unfold(x, flat.triangles, warp=(c, -s, 0.0))  # the tangent of the warp where the sheet is level
    corners = found if found.ndim == 3 else found[flat.triangles]
    exact = {"rel": 1e-9} if found.ndim == 3 else {"abs": 2e-6}  # copies that coincide to a millionth become one
    assert side_lengths(corners) == approx(side_lengths(x[flat.triangles]), **exact)
    assert middle[:, 2].max() > 0.1
    assert np.ptp(warp_in_chart(flat.corners, corners)) < np.radians(1.5)


def test_a_bent_sheet_has_geodesic_coordinates() -> None:
    flat = sb.mesh.grid(1.0, 0.6, 30, 18)
    x = on_cylinder(flat.material, 0.4)
    found = sb.mesh.unfold(x, flat.triangles)
    chord = 2 * 0.4 * np.sin(1 / 30 / 2 / 0.4)  # the facets' length of one cell
    assert found.shape == flat.material.shape
    assert found - found[0] == approx(flat.material * [30 * chord, 1.0], abs=1e-9)


@pytest.mark.parametrize("warp", [(1.0, 0.0, 0.0), (0.3, -1.0, 0.4)])
def test_a_sphere_keeps_the_shapes_and_lays_the_warp_along_the_first_axis(warp: tuple[float, ...]) -> None:
    mesh = sb.mesh.icosphere(0.2, 2)
    found = sb.mesh.unfold(mesh.vertices, mesh.triangles, warp)
    corners = mesh.vertices[mesh.triangles]
    assert side_lengths(found) == approx(side_lengths(corners), rel=1e-9)
    # the map of each triangle from the material to space takes the first axis to the warp's part in its plane
    u = np.stack([found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]], axis=2)
    x = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    first, second = np.moveaxis(x @ np.linalg.inv(u), 2, 0)
    normal = np.cross(first, second)
    across = warp - normal * (normal @ warp)[:, None]
    assert first * np.linalg.norm(across, axis=1, keepdims=True) == approx(across, abs=1e-9)
    assert (normal * corners.mean(axis=1)).sum(axis=1).min() > 0


def test_every_part_gets_coordinates() -> None:
    mesh = sb.mesh.grid(1.0, 1.0, 3, 3)
    vertices = np.vstack([mesh.vertices, mesh.vertices[:, [1, 2, 0]] + [0, 5, 0]])  # the second stands upright
    triangles = np.vstack([mesh.triangles, mesh.triangles + len(mesh.vertices)])
    found = sb.mesh.unfold(vertices, triangles, warp=(1.0, 1.0, 0.0))
    assert side_lengths(found[triangles]) == approx(side_lengths(vertices[triangles]))


def test_a_warp_direction_across_the_mesh_is_refused() -> None:
    mesh = sb.mesh.grid(1.0, 1.0, 2, 2)
    with pytest.raises(sb.MeshError, match="warp: is perpendicular to the mesh"):
        sb.mesh.unfold(mesh.vertices, mesh.triangles, warp=(0, 0, 1))
    with pytest.raises(sb.MeshError, match="vertices: give triangle 0 no area"):
        sb.mesh.unfold(mesh.vertices * [1, 0, 0], mesh.triangles)
