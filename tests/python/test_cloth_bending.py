"""The bending of sheets: what a bent patch holds, and cantilevers under their own weight, on many patterns."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import bending
from oracles.calculus import derivative
from pytest import approx
from support import static_sensitivity

WARP, SHEAR = 1e4, 5e3
G = 9.81


def moved(mesh: sb.TriangleMesh, by: float) -> sb.TriangleMesh:
    """The same flat mesh with its inner vertices moved."""
    x = mesh.vertices.copy()
    inner = np.setdiff1d(np.arange(len(x)), mesh.borders)
    x[inner, :2] += np.random.default_rng(3).uniform(-by, by, (len(inner), 2))
    return sb.TriangleMesh(x, mesh.triangles, x[:, :2], mesh.sets)


PATTERNS = {
    "one_way": lambda: sb.mesh.grid(0.2, 0.2, 12, 12, pattern="one_way"),
    "alternating": lambda: sb.mesh.grid(0.2, 0.2, 12, 12),
    "equilateral": lambda: sb.mesh.equilateral(0.2, 0.2, 12),
    "moved": lambda: moved(sb.mesh.grid(0.2, 0.2, 12, 12, pattern="one_way"), 0.003),
    "disk": lambda: sb.mesh.disk(0.1, 6),
}


def patch(mesh: sb.TriangleMesh, **options) -> sb.Scene:
    scene = sb.Scene("patch", gravity=(0, 0, 0))
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=WARP, shear=SHEAR, **options)
    scene.pin(cloth.particles[:1])
    return scene


# --- O-23: a patch bent to a cylinder


@pytest.mark.filterwarnings("ignore:.*do not have six neighbors")
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 135])
def test_a_cylinder_holds_the_energy_of_its_rigidities(pattern, degrees):
    B, weft, twist, radius = 1e-4, 3e-4, 2e-4, 200.0
    mesh = PATTERNS[pattern]()
    scene = patch(mesh, bending=B, bending_weft=weft, bending_twist=twist)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, across = mesh.vertices[:, :2] @ [c, s], mesh.vertices[:, :2] @ [-s, c]
    bent = np.column_stack(
        [
            radius * np.sin(along / radius) * c - across * s,
            radius * np.sin(along / radius) * s + across * c,
            radius * (1 - np.cos(along / radius)),
        ]
    )
    energy = sb.elastic_energy(scene, bent)["cloth_bend"].sum()
    rigidity = B * c**4 + weft * s**4 + 2 * twist * (c * s) ** 2
    assert energy == approx(0.5 * rigidity / radius**2 * mesh.areas.sum(), rel=1e-5)


@pytest.mark.filterwarnings("ignore:.*do not have six neighbors")
@pytest.mark.parametrize("model", ["dihedral", "isometric_bending"])
@pytest.mark.parametrize("degrees", [0, 45, 90, 135])
def test_hinges_on_a_cylinder_hold_what_their_mesh_makes_of_it(model, degrees):
    n, size, radius, B = 40, 0.2, 20.0, 1e-4
    mesh = sb.mesh.grid(size, size, n, n)
    scene = patch(mesh, bending=B, bending_model=model)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, across = mesh.vertices[:, :2] @ [c, s], mesh.vertices[:, :2] @ [-s, c]
    bent = np.column_stack([radius * np.sin(along / radius), across, radius * (1 - np.cos(along / radius))])
    energy = sb.elastic_energy(scene, bent)["cloth_bend"].sum()
    measured = energy / (0.5 * B / radius**2 * size**2)
    assert measured == approx(mesh.bending_ratio(math.radians(degrees)) / 3.0, rel=1e-5)


def test_hinges_are_refused_on_one_way_diagonals():
    mesh = sb.mesh.grid(0.2, 0.2, 10, 10, pattern="one_way")
    with pytest.raises(sb.SceneError, match="times as hard in one direction") as caught:
        patch(mesh, bending=1e-4, bending_model="dihedral")
    assert "curvature" in str(caught.value)


def test_a_mesh_without_six_neighbors_is_told():
    with pytest.warns(UserWarning, match="do not have six neighbors"):
        patch(sb.mesh.grid(0.2, 0.2, 10, 10), bending=1e-4)


def test_a_curved_sheet_rests_in_its_shape():
    flat = sb.mesh.grid(0.2, 0.2, 8, 8, pattern="one_way")
    x = flat.vertices
    bent = np.column_stack([0.1 * np.sin(x[:, 0] / 0.1), x[:, 1], 0.1 * (1 - np.cos(x[:, 0] / 0.1))])
    mesh = sb.TriangleMesh(bent, flat.triangles, x[:, :2], flat.sets)
    for model in ("curvature", "dihedral"):
        curved = sb.mesh.equilateral(0.2, 0.2, 6) if model == "dihedral" else mesh
        scene = patch(curved, bending=1e-4, curved=True, bending_model=model)
        assert sb.constraint_values(scene)["cloth_bend"] == approx(0.0, abs=1e-13)


# --- O-17: a strip clamped level, under its own weight


def cantilever(
    gamma: float, rows: int, pattern: str, width: float = 0.5, held_rows: int = 3, **options
) -> tuple[sb.Scene, np.ndarray]:
    """Strip of length 1 on `rows` rows of triangles, and the weights that pick its mean drop.

    A clamp acts in the middle between the last two rows of vertices that it holds.
    """
    cell, inside = 1.0 / (rows + 0.5), held_rows - 1
    across = max(2, round(width / cell))
    mesh = sb.mesh.grid((rows + inside) * cell, width, rows + inside, across, pattern=pattern)
    held = mesh.within((-1, -1, -1), ((inside + 0.001) * cell, width + 1, 1))
    density = 0.2
    rigidity = density * G / gamma
    scene = sb.Scene("cantilever", gravity=(0, 0, -G))
    stiff = {"warp": 1e4, "shear": 5e3, "density": density, "bending": rigidity, "held": held} | options
    cloth = sb.add_cloth(scene, mesh, **stiff)
    scene.pin(cloth.particles[held])
    drop = np.zeros((scene.particle_count, 3))
    tip = mesh.sets["right"]
    drop[cloth.particles[tip], 2] = -1.0 / len(tip)
    return scene, drop


def test_a_clamp_of_two_rows_is_of_second_order():
    closed = bending.heavy_elastica(8.0).drop
    errors = []
    for rows in (10, 20):
        drops = []
        for held_rows in (2, 3):
            scene, drop = cantilever(8.0, rows, "one_way", held_rows=held_rows)
            drops.append((sb.equilibrium(scene).positions * drop).sum())
        assert drops[0] == approx(drops[1], rel=1e-6)  # what lies inside the clamp does not count
        errors.append(abs(drops[0] / closed - 1))
    assert errors[0] < 6e-3
    assert errors[0] > 3.5 * errors[1]


@pytest.mark.parametrize("gamma", [1.0, 4.0, 8.0, 20.0])
def test_heavy_strip(gamma):
    scene, drop = cantilever(gamma, 20, "one_way")
    rest = sb.equilibrium(scene)
    closed = bending.heavy_elastica(gamma)
    assert (rest.positions * drop).sum() == approx(closed.drop, abs=2e-3)
    slope = derivative(lambda g: bending.heavy_elastica(g).drop, gamma)
    by_bending = static_sensitivity(rest, "cloth_bending", drop)
    rigidity = scene.quantities["cloth_bending"].value
    assert by_bending[0] == approx(by_bending[1], rel=1e-8)
    assert by_bending[0] == approx(-gamma / rigidity * slope, rel=0.01)
