"""Solids of rubber (Smith, de Goes & Kim 2018): at rest against their closed form, in motion, in fits."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from support import pick, static_sensitivity, twice
from test_solid_motion import SOLVERS
from test_solid_statics import LAMBDA, MU, NU, SIDE, E, block, energy_of, pulled

RUBBER = {"law": "neo_hookean"}
# stretch, and nominal stress [Pa] of a bar with free sides
PULLED = [(1.001, 99.9308), (1.1, 9365.428), (1.5, 38319.088), (2.0, 65384.62), (0.8, -23317.308)]


def narrowed(s: float, mu: float = MU, lame: float = LAMBDA) -> float:
    """The stretch across of a bar that is stretched by s."""
    whole = lame + mu
    return float(np.sqrt(((whole + mu) * s - mu) / (whole * s * s)))


def stress(s: float, mu: float = MU, lame: float = LAMBDA) -> float:
    t2 = narrowed(s, mu, lame) ** 2
    return float(mu * s + ((lame + mu) * (s * t2 - 1) - mu) * t2)


def energy(F: np.ndarray) -> float:
    """Per volume, less what it is at rest [Pa]."""
    J, whole = np.linalg.det(F), LAMBDA + MU
    return float(MU / 2 * ((F * F).sum() - 3) + whole / 2 * (J - 1 - MU / whole) ** 2 - MU**2 / (2 * whole))


@pytest.mark.parametrize("make", [sb.mesh.bricks, sb.mesh.tetrahedra])
@pytest.mark.filterwarnings("ignore::sheetbend.LockingWarning")
def test_the_rows_hold_the_energy_of_the_law(make):
    """Whatever the deformation: turned, sheared, stretched twofold, and turned inside out."""
    scene, cube = block(make=make, **RUBBER)
    random = np.random.default_rng(0)
    shapes = [np.eye(3) + random.uniform(-0.8, 0.8, (3, 3)) for _ in range(20)]
    assert min(np.linalg.det(F) for F in shapes) < 0 < max(np.linalg.det(F) for F in shapes)
    for F in (np.diag([2.0, 2.0, 2.0]), np.diag([1.0, 1.0, -0.5]), *shapes):
        assert energy_of(scene, cube.mesh.vertices @ F.T) == approx(energy(F), rel=1e-10)
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert energy_of(scene, cube.mesh.vertices @ turn.T) == approx(0.0, abs=1e-20 * E)


@pytest.mark.parametrize(("s", "known"), PULLED)
def test_the_energy_of_a_bar_is_that_of_its_law(s, known):
    assert stress(s) == approx(known, rel=1e-6)
    scene, cube = block(**RUBBER)

    def stored(along: float, across: float) -> float:
        return energy_of(scene, cube.mesh.vertices * [along, across, across])

    t, d = narrowed(s), 1e-4
    slope = (8 * (stored(s + d, t) - stored(s - d, t)) - stored(s + 2 * d, t) + stored(s - 2 * d, t)) / (12 * d)
    assert slope == approx(stress(s), rel=1e-8)
    least = (8 * (stored(s, t + d) - stored(s, t - d)) - stored(s, t + 2 * d) + stored(s, t - 2 * d)) / (12 * d)
    assert least == approx(0.0, abs=1e-9 * E)


@pytest.mark.parametrize("s", [1.001, 1.1, 1.5])
def test_uniaxial_tension(s):
    rest = sb.equilibrium(pulled(stress(s), **RUBBER))
    cube = rest.scene.solids["solid"]
    corner = cube.particles[cube.mesh.nearest([[SIDE] * 3])]
    assert rest.positions[corner][0] / SIDE == approx([s, narrowed(s), narrowed(s)], abs=1e-8)


def test_derivatives_of_uniaxial_tension():
    s = 1.5
    rest = sb.equilibrium(pulled(stress(s), **RUBBER))
    cube = rest.scene.solids["solid"]
    (corner,) = cube.particles[cube.mesh.nearest([[SIDE, 0, 0]])]
    weights = pick(rest.scene, corner, 0, 1 / SIDE)

    def nominal(along: float, nu: float) -> float:
        return stress(along, E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)))

    d = 1e-5
    stiffness = (nominal(s + d, NU) - nominal(s - d, NU)) / (2 * d)
    assert static_sensitivity(rest, "solid_E", weights) == approx(twice(-stress(s) / E / stiffness), rel=1e-7)
    by_nu = (nominal(s, NU + d) - nominal(s, NU - d)) / (2 * d)
    assert static_sensitivity(rest, "solid_poisson", weights) == approx(twice(-by_nu / stiffness), rel=1e-7)


def bar(cells=(4, 1, 1), stretch=1.0, **options) -> sb.Scene:
    """A soft bar, clamped at one end, that falls."""
    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), cells)
    numbers = {"density": 1000.0, "E": 1e5, "poisson": 0.45, "damping": 4e-3, **RUBBER, **options}
    shape = mesh.vertices * [stretch, 1 / np.sqrt(stretch), 1 / np.sqrt(stretch)]
    return sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], positions=shape, **numbers)


@pytest.mark.parametrize("method", SOLVERS)
def test_gradients_are_exact(method):
    """Of a bar that snaps back from half its length more, against complex step."""
    found = sb.check_gradients(bar((2, 1, 1), stretch=1.5, E=1e4), [0.0, 0.006], SOLVERS[method], samples=3)
    assert all(row.passed for row in found.rows), str(found)
    assert {"bar_E", "bar_poisson", "bar_density", "bar_damping"} <= {row.name for row in found.rows}
    assert max(row.complex_step for row in found.rows if not row.unfelt) < 1e-8


@pytest.mark.parametrize("law", ["strain", "neo_hookean"])
def test_rows_are_zero_at_rest(law):
    """So "newton", which leaves out their curvature, moves a swinging bar as "implicit" does, with either law: within
    4e-6 m at 1/240 s."""
    times = np.arange(8) / 60
    ends = [sb.simulate(bar(law=law), times, sb.Solver(h=1 / 240, method=m)).positions for m in ("newton", "implicit")]
    assert np.abs(ends[1] - ends[0]).max() < 1e-5


def test_laws_agree_for_small_strains():
    """To first order in the strain: a bar sags by the same part of a tenth of a millimeter."""
    sag = [sb.equilibrium(bar(law=law, E=1e8)).positions[:, 2] for law in ("strain", "neo_hookean")]
    assert np.abs(sag[0] - bar().positions[:, 2]).max() > 1e-5
    assert sag[1] == approx(sag[0], abs=1e-8)


def test_a_stretched_bar_is_identified():
    """E and Poisson's ratio of a bar that falls along its length and swings, by strains of up to a third; with the
    other law the markers are somewhere else."""
    solver, times, sigma = sb.Solver(h=4e-3, method="newton"), np.arange(0, 0.32, 0.008), 2e-4
    points = [[x, y, z] for x in (0.03, 0.06, 0.1) for y, z in ((0.0, 0.01), (0.01, 0.02), (0.02, 0.005))]

    def hung(law: str) -> sb.Scene:
        return bar((3, 2, 2), E=4e3, law=law, gravity=(9.81, 0.0, -2.0))

    def seen(law: str) -> np.ndarray:
        x = sb.simulate(hung(law), times, solver).positions
        return np.stack([np.einsum("k,fkx->fx", p.weights, x[:, list(p.particles)]) for p in places], axis=1)

    scene = hung("neo_hookean")
    places = sb.on_solid(scene.solids["bar"], points)
    true = seen("neo_hookean")
    assert np.ptp(true[:, -3:, 0]) > 0.02
    assert np.abs(seen("strain") - true).max() > 20 * sigma
    noisy = true + sigma * np.random.default_rng(5).standard_normal(true.shape)
    recording = sb.Recording(positions=noisy, times=times, name="twin")
    start = {"bar_E": {"initial": 6e3}, "bar_poisson": {"initial": 0.3}}
    found = sb.fit(scene, recording, start, markers=places, solver=solver, sigma=sigma, refine=False)
    for name, truth in (("bar_E", 4e3), ("bar_poisson", 0.45)):
        assert found[name].lower < truth < found[name].upper, str(found.report())
        assert found[name].value == approx(truth, rel=0.02)


def test_refusals():
    mesh = sb.mesh.bricks((SIDE,) * 3, (1, 1, 1))
    wood = sb.Orthotropic((E,) * 3, (MU,) * 3, (NU,) * 3)
    both = {"E": E, "poisson": NU}
    for numbers, match in (
        ({**both, "law": "rubber"}, "strain, neo_hookean"),
        ({**both, **RUBBER, "poisson": 0.0}, "positive"),
        ({**both, **RUBBER, "volume_row": False}, "volume row"),
        ({**RUBBER, "orthotropic": wood}, "law"),
    ):
        with pytest.raises(sb.SceneError, match=match):
            sb.solid(mesh, **{"density": 1000.0, **numbers})
