"""Equilibria from starts that violate their constraints by far, and fabrics that stiffen by powers of ten."""

import math

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx


def triangle(area: float, links: float | None) -> sb.Scene:
    """Without loads, pinned at a corner, its area 0.5 m^2 to begin with; links of some compliance or none."""
    scene = sb.Scene("triangle", gravity=(0.0, 0.0, 0.0))
    corners = scene.add_particles([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 0.1)
    scene.pin(corners[:1])
    if links is not None:
        scene.add_constraints("distance", [[0, 1], [1, 2], [2, 0]], name="links", compliance=links)
    scene.add_constraints("area", [[0, 1, 2]], compliance=0.0, rest=[area])
    return scene


def area_of(x: np.ndarray) -> float:
    return float(np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))) / 2


@pytest.mark.parametrize("area", [0.02, 0.3, 0.6, 2.0, 10.0])
@pytest.mark.parametrize("links", [None, 1e-3, 1e3])
def test_an_unloaded_triangle_finds_the_area_that_it_keeps(area, links):
    """Its links share what the area asks of them: the forces on a corner cancel."""
    rest = sb.equilibrium(triangle(area, links))
    assert area_of(rest.positions) == approx(area, rel=1e-12)
    if links is not None:
        tension = -rest.forces["links"].ravel()
        x = rest.positions
        unit = {(a, b): (x[b] - x[a]) / np.linalg.norm(x[b] - x[a]) for a, b in ((0, 1), (1, 2), (2, 0))}
        normal = np.cross(x[1] - x[0], x[2] - x[0]) / (2 * area_of(x))
        by_area = rest.forces["area"].ravel()[0] * np.cross(normal, x[0] - x[2]) / 2  # on corner 1
        assert tension[1] * unit[1, 2] - tension[0] * unit[0, 1] + by_area == approx(0.0, abs=1e-9 * abs(tension).max())


@pytest.mark.parametrize("growth", [20.0, 70.0])  # b e^2
@pytest.mark.parametrize("weight", [0.0, 9.81])
def test_a_fabric_that_stiffens_by_powers_of_ten(growth, weight):
    """A strip between two clamps, even when it starts. Its tension far from them is that of the law."""
    strain, warp, b = 0.15, 600.0, growth / 0.15**2
    longer = math.sqrt(1.0 + 2.0 * strain)
    scene = sb.Scene("strip", gravity=(0.0, 0.0, -weight))
    mesh = sb.mesh.equilateral(0.4, 0.1, 8)
    cloth = sb.add_cloth(
        scene,
        mesh,
        density=0.2,
        warp=warp,
        weft=500.0,
        shear=60.0,
        bending=1e-5,
        law=sb.laws.Exponential(b, b, b),
        positions=mesh.vertices * [longer, 1.0, 1.0],
    )
    scene.pin(cloth.particles[mesh.sets["left"]])
    scene.pin(cloth.particles[mesh.sets["right"]])
    rest = sb.equilibrium(scene)
    assert rest.residual < 1e-12 and rest.iterations < 20 and rest.unstable_modes == 0
    pull = sb.support_forces(rest)[cloth.particles[mesh.sets["right"]], 0].sum()
    assert pull == approx(0.1 * longer * warp * strain * math.exp(growth), rel=0.05)


def test_supports_carry_a_given_pressure():
    scene = sb.Scene("drum", gravity=(0.0, 0.0, 0.0))
    mesh = sb.mesh.disk(0.1, 5)
    drum = sb.add_cloth(scene, mesh, density=0.1, warp=200.0, shear=80.0, bending=1e-6)
    scene.pin(drum.particles[mesh.sets["rim"]])
    triangles = drum.particles[mesh.triangles]
    scene.add_pressure(triangles, 50.0)
    x = scene.positions.copy()
    x[:, 2] += 0.01 * (1.0 - (x[:, :2] ** 2).sum(axis=1) / 0.01)
    rest = sb.equilibrium(scene, start=x)
    a, b, c = np.moveaxis(rest.positions[triangles], 1, 0)
    pressed = 50.0 * np.cross(b - a, c - a).sum(axis=0) / 2.0
    assert np.linalg.norm(pressed) > 1.0
    assert sb.support_forces(rest).sum(axis=0) == approx(-pressed, abs=1e-12)
