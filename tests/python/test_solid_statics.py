"""Solids at rest against closed forms: uniaxial tension, shear, patches and beams, with their derivatives."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from support import pick, static_sensitivity, twice

E, NU = 1e5, 0.3
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
SIDE = 0.1
# stretch, and nominal stress [Pa] of a bar with free sides
PULLED = [(1.001, 100.0739), (1.1, 10813.948), (1.5, 77013.344), (0.8, -17684.747)]


def narrowed(s: float) -> float:
    """The stretch across of a bar of energy mu tr E^2 + lambda (J - 1)^2/2 that is stretched by s."""
    return float(np.sqrt((MU + LAMBDA * s) / (MU + LAMBDA * s * s)))


def stress(s: float) -> float:
    t = narrowed(s)
    return MU * (s * s - 1) * s + LAMBDA * (s * t * t - 1) * t * t


def block(n: int = 2, make=sb.mesh.bricks, **options) -> tuple[sb.Scene, sb.Solid]:
    scene = sb.Scene("block", gravity=(0, 0, 0))
    options = {"density": 1000.0, "E": E, "poisson": NU, **options}
    return scene, sb.add_solid(scene, make((SIDE,) * 3, (n,) * 3), **options)


def pulled(tension: float, **options) -> sb.Scene:
    """A cube under a dead tension [Pa]; springs of no account stop its turns."""
    scene, cube = block(**options)
    x, area = cube.mesh.vertices, (SIDE / 2) ** 2
    load = np.zeros_like(x)
    for face, sign in (("x_min", -1.0), ("x_max", 1.0)):
        ids = cube.mesh.sets[face]
        inside = ((x[ids, 1:] > 1e-9) & (x[ids, 1:] < SIDE - 1e-9)).sum(axis=1)
        load[ids, 0] += sign * tension * area * np.array([0.25, 0.5, 1.0])[inside]
    scene.add_force(cube.particles, load[None])
    corner = cube.particles[cube.mesh.nearest([[0, 0, 0], [SIDE, 0, 0], [0, SIDE, 0]])]
    scene.pin(corner[:1])
    far = scene.add_particles([[SIDE, 0, 1e5], [SIDE, 1e5, 0], [0, SIDE, 1e5]], 1.0)
    scene.pin(far)
    ends = np.column_stack([corner[[1, 1, 2]], far])
    scene.add_constraints("distance", ends, name="hold", compliance=np.full(3, 1e-1))
    return scene


@pytest.mark.parametrize(("s", "known"), PULLED)
def test_the_energy_of_a_bar_is_that_of_its_law(s, known):
    """Strains and volumes hold the energy whose derivative is the stress, and it is least across the bar."""
    assert stress(s) == approx(known, rel=1e-6)
    scene, cube = block()

    def energy(along: float, across: float) -> float:
        x = cube.mesh.vertices * [along, across, across]
        return sum(float(e.sum()) for e in sb.elastic_energy(scene, x).values())

    t, d = narrowed(s), 1e-4
    slope = (8 * (energy(s + d, t) - energy(s - d, t)) - energy(s + 2 * d, t) + energy(s - 2 * d, t)) / (12 * d)
    assert slope / SIDE**3 == approx(stress(s), rel=1e-8)
    least = (8 * (energy(s, t + d) - energy(s, t - d)) - energy(s, t + 2 * d) + energy(s, t - 2 * d)) / (12 * d)
    assert least == approx(0.0, abs=1e-9 * E * SIDE**3)


@pytest.mark.parametrize("s", [1.001, 1.1, 1.5])
def test_uniaxial_tension(s):
    rest = sb.equilibrium(pulled(stress(s)))
    cube = rest.scene.solids["solid"]
    corner = cube.particles[cube.mesh.nearest([[SIDE] * 3])]
    assert rest.positions[corner][0] / SIDE == approx([s, narrowed(s), narrowed(s)], abs=1e-8)


def test_derivatives_of_uniaxial_tension():
    """By E the stretch falls as if the load fell; by Poisson's ratio as the closed form's differences."""
    s = 1.1
    rest = sb.equilibrium(pulled(stress(s)))
    cube = rest.scene.solids["solid"]
    (corner,) = cube.particles[cube.mesh.nearest([[SIDE, 0, 0]])]
    weights = pick(rest.scene, corner, 0, 1 / SIDE)

    def nominal(along: float, young: float, nu: float) -> float:
        mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
        t2 = (mu + lam * along) / (mu + lam * along * along)
        return mu * (along**2 - 1) * along + lam * (along * t2 - 1) * t2

    d = 1e-5
    stiffness = (nominal(s + d, E, NU) - nominal(s - d, E, NU)) / (2 * d)
    assert static_sensitivity(rest, "solid_E", weights) == approx(twice(-stress(s) / E / stiffness), rel=1e-7)
    by_nu = (nominal(s, E, NU + d) - nominal(s, E, NU - d)) / (2 * d)
    assert static_sensitivity(rest, "solid_poisson", weights) == approx(twice(-by_nu / stiffness), rel=1e-7)


def sheared(gamma: float, volume_row: bool = True, make=sb.mesh.bricks) -> sb.Equilibrium:
    """A cube of skewed elements whose whole surface is sheared: its inside finds its way."""
    mesh = make((SIDE,) * 3, (3, 3, 3))
    inner = ((mesh.vertices > 1e-9) & (mesh.vertices < SIDE - 1e-9)).all(axis=1)
    moved = mesh.vertices.copy()
    moved[inner] += np.random.default_rng(1).uniform(-5e-3, 5e-3, (inner.sum(), 3))
    mesh = sb.SolidMesh(moved, mesh.elements, dict(mesh.sets))
    shape = mesh.vertices + gamma * mesh.vertices[:, [2]] * [1.0, 0.0, 0.0]
    shape[inner] += 1e-3
    scene = sb.Scene("shear", gravity=(0, 0, 0))
    options = {"density": 1000.0, "E": E, "poisson": NU, "volume_row": volume_row}
    still = () if mesh.elements.shape[1] == 8 else np.flatnonzero(~inner)
    cube = sb.add_solid(scene, mesh, positions=shape, held=still, **options)
    scene.pin(cube.particles[~inner])
    return sb.equilibrium(scene)


@pytest.mark.parametrize("volume_row", [True, False])
@pytest.mark.parametrize("make", [sb.mesh.bricks, sb.mesh.tetrahedra])
@pytest.mark.filterwarnings("ignore::sheetbend.LockingWarning")
def test_shear_of_a_patch(make, volume_row):
    """Uniform on skewed elements, and the first moment of the supports' forces is the volume times F S: S = 2 mu E, as
    J = 1, and without the volume row lambda tr E more."""
    gamma = 0.4
    rest = sheared(gamma, volume_row, make)
    cube = rest.scene.solids["solid"]
    expected = cube.mesh.vertices + gamma * cube.mesh.vertices[:, [2]] * [1.0, 0.0, 0.0]
    assert rest.positions[cube.particles] == approx(expected, abs=1e-10 * SIDE)
    if make is sb.mesh.tetrahedra:
        return  # those on held vertices alone are left out
    S = _second_stress(gamma, volume_row)
    F = np.array([[1.0, 0.0, gamma], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    moment = np.einsum("ni,nj->ij", sb.support_forces(rest)[cube.particles], cube.mesh.vertices)
    assert moment == approx(F @ S * SIDE**3, abs=1e-8 * E * SIDE**3)


def _second_stress(gamma: float, volume_row: bool) -> np.ndarray:
    F = np.array([[1.0, 0.0, gamma], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    strain = (F.T @ F - np.eye(3)) / 2
    return 2 * MU * strain + (0.0 if volume_row else LAMBDA * np.trace(strain)) * np.eye(3)


def deflection(n: int, nu: float) -> float:
    """Of the end of a clamped beam of 10 n x n x n bricks over Timoshenko's (shear coefficient of Cowper 1966)."""
    length, side, load = 0.1, 0.01, 1e-4
    mesh = sb.mesh.bricks((length, side, side), (10 * n, n, n))
    still, loaded = mesh.sets["x_min"], mesh.sets["x_max"]
    scene = sb.solid(mesh, density=1000.0, E=E, poisson=nu, gravity=(0, 0, 0), pinned=still, volume_row=nu > 0)
    beam = scene.solids["solid"]
    x = mesh.vertices[loaded]
    share = np.where((x[:, 1:] < 1e-9) | (x[:, 1:] > side - 1e-9), 0.5, 1.0).prod(axis=1)
    force = np.zeros((1, len(loaded), 3))
    force[0, :, 2] = -load * share / share.sum()
    scene.add_force(beam.particles[loaded], force)
    rest = sb.equilibrium(scene)
    found = (x[:, 2] - rest.positions[beam.particles[loaded], 2]).mean()
    shear = 10 * (1 + nu) / (12 + 11 * nu) * E / (2 * (1 + nu)) * side**2
    return float(found / (load * length**3 / (E * side**4 / 4) + load * length / shear))


@pytest.mark.parametrize(("nu", "two", "limit"), [(0.0, 0.888, 1.0), (0.3, 0.937, 1.0)])
def test_a_beam_converges_to_timoshenkos(nu, two, limit):
    """Too stiff by 11 % with two bricks across, and of second order in their size."""
    coarse, fine = deflection(2, nu), deflection(3, nu)
    assert coarse == approx(two, abs=2e-3)
    assert (9 * fine - 4 * coarse) / 5 == approx(limit, abs=0.015)


WOOD = sb.Orthotropic(E=(1e5, 4e4, 2e4), G=(1.5e4, 2.2e4, 3e4), poisson=(0.2, 0.1, 0.3))


def turned(rotation: np.ndarray) -> tuple[sb.Scene, sb.Solid]:
    law = sb.Orthotropic(WOOD.E, WOOD.G, WOOD.poisson, axes=rotation)
    scene = sb.Scene("block", gravity=(0, 0, 0))
    return scene, sb.add_solid(scene, sb.mesh.bricks((SIDE,) * 3, (2, 1, 1)), density=1e3, orthotropic=law)


def energy_of(scene: sb.Scene, x: np.ndarray) -> float:
    return sum(float(e.sum()) for e in sb.elastic_energy(scene, x).values()) / SIDE**3


@pytest.mark.parametrize("seed", [None, 4])
def test_an_orthotropic_block(seed):
    """Pulled along its axis i by a Green strain e it stores E_i e^2/2 where it narrows by nu_ij e, and this is least;
    sheared between i and j by 2 e_ij it stores G_ij (2 e_ij)^2/2. In whatever direction its axes lie."""
    rotation = np.eye(3)
    if seed is not None:
        rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    scene, cube = turned(rotation)

    def energy(strain: np.ndarray) -> float:
        w, v = np.linalg.eigh(np.eye(3) + 2 * strain)
        F = rotation @ (v * np.sqrt(w)) @ v.T @ rotation.T
        return energy_of(scene, cube.mesh.vertices @ F.T)

    couplings = {(0, 1): 0.2, (0, 2): 0.1, (1, 2): 0.3}
    for i in range(3):
        strain = np.zeros((3, 3))
        strain[i, i] = 0.1
        for j in range(3):
            if j != i:
                strain[j, j] = -0.1 * couplings[min(i, j), max(i, j)] * np.sqrt(WOOD.E[i] / WOOD.E[j])
        assert energy(strain) == approx(WOOD.E[i] * 0.1**2 / 2, rel=1e-10)
        for j in range(3):
            if j != i:
                change = np.zeros((3, 3))
                change[j, j] = 1e-3
                assert energy(strain + change) > energy(strain) and energy(strain - change) > energy(strain)
    for (i, j), G in zip(((1, 2), (0, 2), (0, 1)), WOOD.G, strict=True):
        strain = np.zeros((3, 3))
        strain[i, j] = strain[j, i] = 0.05
        assert energy(strain) == approx(G * 0.1**2 / 2, rel=1e-10)


def test_an_isotropic_block_is_an_orthotropic_one():
    x = np.random.default_rng(0).uniform(-0.01, 0.01, (12, 3))
    law = sb.Orthotropic((E,) * 3, (MU,) * 3, (NU,) * 3)
    mesh = sb.mesh.bricks((SIDE,) * 3, (2, 1, 1))
    energies = []
    for numbers in ({"orthotropic": law}, {"E": E, "poisson": NU, "volume_row": False}):
        scene = sb.Scene("block", gravity=(0, 0, 0))
        cube = sb.add_solid(scene, mesh, density=1e3, **numbers)
        energies.append(energy_of(scene, cube.mesh.vertices + x))
    assert energies[0] == approx(energies[1], rel=1e-12)


def test_gradients_of_an_orthotropic_block():
    mesh = sb.mesh.bricks((0.04, 0.02, 0.02), (2, 1, 1))
    scene = sb.solid(mesh, density=1e3, orthotropic=WOOD, damping=2e-3, pinned=mesh.sets["x_min"])
    found = sb.check_gradients(scene, [0.0, 0.006], sb.Solver(h=2e-3, method="newton"), samples=2)
    assert all(row.passed for row in found.rows), str(found)
    assert {"solid_E_2", "solid_G_13", "solid_poisson_23"} <= {row.name for row in found.rows}


def test_orthotropic_refusals():
    for numbers, match in (
        ({"E": (1e5, 1e5, 0.0)}, "positive"),
        ({"poisson": (0.7, 0.7, 0.7)}, "stable"),
        ({"axes": 2 * np.eye(3)}, "perpendicular"),
    ):
        with pytest.raises(sb.SceneError, match=match):
            sb.Orthotropic(**{"E": WOOD.E, "G": WOOD.G, **numbers})
    mesh = sb.mesh.bricks((SIDE,) * 3, (1, 1, 1))
    with pytest.raises(sb.SceneError, match="beside"):
        sb.solid(mesh, density=1e3, E=E, orthotropic=WOOD)
    with pytest.raises(sb.SceneError, match="missing"):
        sb.solid(mesh, density=1e3, E=E)
