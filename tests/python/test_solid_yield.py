"""Solids that yield: a bar beyond yield, shear, a thick beam, gradients, a fit, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.optimize import brentq
from support import expect_exact, refusal, sensitivity

E, NU, STRESS, HARDENING = 1e5, 0.3, 20.0, 3e4  # Pa, yield at a strain of 2e-4
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
SIDE = 0.1  # m
RAMP, HOLD = 20, 150  # s, of the change and of all of a step of the load
QUASI_STATIC = sb.Solver(h=1.0, method="newton", integrator="bdf1", iterations=4)
"""Backward Euler damps what vibrates within a substep; the set settles over those of a step of the load."""


def block(cells=(1, 1, 1), size=(SIDE,) * 3, **options) -> tuple[sb.Scene, sb.Solid]:
    scene = sb.Scene("block", gravity=(0, 0, 0))
    given = {"density": 1000.0, "E": E, "poisson": NU, "yield_stress": STRESS, "hardening": HARDENING, **options}
    return scene, sb.add_solid(scene, sb.mesh.bricks(size, cells), "block", **given)


def in_steps(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Knots (times, values) that go from zero to one value after the other and rest at each; and when the rests end."""
    starts = float(HOLD) * np.arange(len(values))
    levels = np.repeat(np.concatenate([np.zeros_like(values[:1]), values]), 2, axis=0)[1:-1]
    return np.sort(np.concatenate([starts, starts + RAMP])), levels, starts + HOLD


def lead(
    scene: sb.Scene, solid: sb.Solid, ids: np.ndarray, moves: np.ndarray, far: float = 100.0
) -> tuple[np.ndarray, np.ndarray]:
    """Leads vertices along x (steps, vertices) and lets them move across: rigid links to particles far away. Returns
    those and when the steps end."""
    at = solid.mesh.vertices[ids] + [far, 0.0, 0.0]
    ends = scene.add_particles(at, 1.0)
    links = np.column_stack([solid.particles[ids], ends])
    scene.add_constraints("distance", links, name="links", compliance=np.zeros(len(ids)))
    knots, levels, rests = in_steps(moves)
    scene.drive(ends, knots, at + levels[..., None] * [1.0, 0.0, 0.0], interpolation="linear")
    return ends, rests


# --- a bar beyond yield


def at_rest(s: float, slid: float, hardening: float | None = HARDENING) -> tuple[float, float]:
    """Nominal stress and plastic strain of a bar that is stretched by s, from the plastic strain before: the energy
    mu (E1 - p)^2 + 2 mu (E2 + p/2)^2 + lambda (J - 1)^2/2 is least across, and p follows within yield."""
    ratio = (hardening or 0.0) / (3 * MU)

    def across(t: float, p: float) -> float:
        return 2 * MU * ((t * t - 1) / 2 + p / 2) * t + LAMBDA * (s * t * t - 1) * s * t

    def strain(t: float, p: float) -> float:
        return (s * s - t * t) / 3 - (1 + ratio) * p

    t, p = brentq(lambda t: across(t, slid), 0.9, 1.1, xtol=1e-16, rtol=1e-15), slid
    if abs(strain(t, p)) > STRESS / (3 * MU):
        limit = float(np.copysign(STRESS / (3 * MU), strain(t, p)))

        def flowed(t: float) -> float:
            return ((s * s - t * t) / 3 - limit) / (1 + ratio)

        t = brentq(lambda t: across(t, flowed(t)), 0.9, 1.1, xtol=1e-16, rtol=1e-15)
        p = flowed(t)
    return 2 * MU * ((s * s - 1) / 2 - p) * s + LAMBDA * (s * t * t - 1) * t * t, p


def bar(stretches: np.ndarray, **options) -> tuple[np.ndarray, np.ndarray]:
    """Nominal stresses of a bar that is led from one strain to the next, and its stretches, where it rests at each."""
    scene, cube = block(**options)
    x = cube.mesh.vertices
    scene.pin(cube.particles[cube.mesh.nearest([[0, 0, 0]])])
    led = np.flatnonzero(x.any(axis=1))
    ends, times = lead(scene, cube, led, SIDE * np.outer(stretches, x[led, 0] > 0))
    far = ends[x[led, 0] > 0].tolist()
    read = sb.simulate_forces(scene, times, far, QUASI_STATIC).forces[:, 0]
    moved = sb.simulate(scene, np.concatenate([[0.0], times]), QUASI_STATIC).positions[1:]
    ends_x = [moved[:, cube.particles[cube.mesh.sets[f"x_{end}"]], 0].mean(axis=1) for end in ("max", "min")]
    return read / SIDE**2, (ends_x[0] - ends_x[1]) / SIDE


YIELD = STRESS / E
STRAINS = YIELD * np.array([0.9, 2.0, 4.0, 3.5, 0.0, -3.0, 1.0])


@pytest.mark.parametrize("hardening", [HARDENING, None], ids=["hardening", "perfect"])
def test_a_bar_beyond_yield(hardening):
    """The law in closed form, and for small strains: E, then E H/(E + H), back with E, and yield the other way two
    yield stresses lower."""
    stresses, stretches = bar(STRAINS, hardening=hardening)
    slid, slope = 0.0, E * (hardening or 0.0) / (E + (hardening or 0.0))
    for stress, s in zip(stresses, stretches, strict=True):
        expected, slid = at_rest(s, slid, hardening)
        assert stress == approx(expected, abs=1e-8 * STRESS)
    small, stress, back = [], 0.0, 0.0
    for change in np.diff(STRAINS, prepend=0.0):
        trial, center = stress + E * change, back
        over = max(abs(trial - center) - STRESS, 0.0) * np.sign(trial - center)
        plastic = over / (E + (hardening or 0.0))
        stress, back = trial - E * plastic, back + (hardening or 0.0) * plastic
        small.append(stress)
    assert small[2] == approx(STRESS + 3 * slope * YIELD)
    assert stresses == approx(small, abs=2e-3 * STRESS)


def test_the_strain_that_is_left():
    """Pulled to four times the yield strain and let go: (s_max - s_y)/H, where no stress is left."""
    peak, slid = at_rest(1 + 4 * YIELD, 0.0)
    left = brentq(lambda strain: at_rest(1 + strain, slid)[0], 0.0, 4 * YIELD, xtol=1e-18)
    assert left == approx((peak - STRESS) / HARDENING, rel=2e-3)
    stresses, _ = bar(np.array([4 * YIELD, left]))
    assert stresses[0] == approx(peak, rel=1e-8)
    assert stresses[1] == approx(0.0, abs=1e-8 * STRESS)


def test_shear_yields_at_the_stress_over_the_root_of_three():
    """A cube whose faces are led in simple shear, perfectly plastic: s/sqrt(3) beyond yield, G before and after."""
    scene, cube = block((2, 2, 2), hardening=None)
    outer = np.unique(np.concatenate([cube.mesh.sets[f"{axis}_{end}"] for axis in "xyz" for end in ("min", "max")]))
    at, limit = cube.mesh.vertices[outer], STRESS / np.sqrt(3.0)
    knots, levels, times = in_steps(limit / MU * np.array([0.5, 3.0, 2.5]))
    scene.drive(cube.particles[outer], knots, at + levels[:, None, None] * at[:, 2:] * [1.0, 0.0, 0.0], "linear")
    top = cube.particles[cube.mesh.sets["z_max"]].tolist()
    read = sb.simulate_forces(scene, times, top, QUASI_STATIC).forces[:, 0]
    assert read / SIDE**2 == approx(limit * np.array([0.5, 1.0, 0.5]), rel=2e-3)


def moment(layers: int, bend: float, **options) -> float:
    """Over that at first yield: the moment of a beam that is bent to so many times the curvature at first yield. A
    slice of it, whose faces stay plane; nearly incompressible, since plastic strain is."""
    half, width, slice_ = SIDE / 2, SIDE / 40, SIDE / 40  # thin, since bricks do not curve
    scene, part = block((1, 1, layers), (slice_, width, SIDE), poisson=0.499, hardening=None)
    x = part.mesh.vertices
    scene.pin(part.particles[part.mesh.nearest([[0, 0, 0]])])
    led = np.flatnonzero(x.any(axis=1))
    strain = bend * STRESS / E * (x[led, 2] - half) / half
    ends, times = lead(scene, part, led, (strain * x[led, 0])[None])
    far = ends[x[led, 0] > 0].tolist()
    read = sb.simulate_forces(scene, times, far, QUASI_STATIC, arm=(0.0, 0.0, 0.0))
    first = STRESS * width * SIDE**2 / 6
    return float(read.torques[0, 1] / first)


@pytest.mark.parametrize("bend", [1.5, 3.0])
def test_a_thick_beam_bends_beyond_yield(bend):
    """M = M_y (3/2 - (kappa_y/kappa)^2/2), as the layers get thinner."""
    exact = 1.5 - 0.5 / bend**2
    for layers, most in ((4, 1.2e-2), (8, 2.5e-3), (16, 1e-3)):
        assert moment(layers, bend) == approx(exact, rel=most), layers


# --- gradients


def falling(cells=(2, 1, 1), **options) -> sb.Scene:
    """A soft bar clamped at one end that sags beyond yield."""
    mesh = sb.mesh.bricks((0.04, 0.02, 0.02), cells)
    moved = mesh.vertices + np.random.default_rng(0).uniform(-1e-3, 1e-3, mesh.vertices.shape)
    mesh = sb.SolidMesh(moved, mesh.elements, dict(mesh.sets))
    numbers = {"density": 1000.0, "E": 1e4, "poisson": 0.4, "damping": 4e-3, "yield_stress": 30.0, "hardening": 4e3}
    return sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], **(numbers | options))


def flowed(scene: sb.Scene) -> np.ndarray:
    """The nodes that hold the sets."""
    return scene.group("bar_strain")[0].particles[:, 8:]


SOLVERS = ("newton", "newton_cg", "direct", "gauss_seidel", "implicit")


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", SOLVERS)
def test_gradients_are_exact(method, integrator):
    solver = sb.Solver(h=2e-3, method=method, integrator=integrator)
    report = sb.check_gradients(falling(), [0.0, 0.01, 0.02], solver, samples=3)
    felt = "bar_E", "bar_poisson", "bar_yield_stress", "bar_hardening", "bar_density", "bar_damping"
    expect_exact(report, *felt)
    assert max(row.complex_step for row in report.rows if not row.unfelt) < 1e-8


def test_it_flows_in_that_motion_and_keeps_its_volume():
    scene = falling()
    moved = sb.simulate(scene, [0.0, 0.02], sb.Solver(h=2e-3, method="newton"))
    sets = moved.nodes[-1][flowed(scene)].reshape(-1, 6)
    assert (np.linalg.norm(sets, axis=1) > 1e-4).mean() > 0.3
    assert np.abs(sets[:, :3].sum(axis=1)).max() < 1e-15


def test_gradients_with_respect_to_what_had_flowed():
    """Of a state before, whose parts along the volume do not move the flow, and of all gradients of the shape."""
    scene, times, rng = falling(), np.array([0.0, 0.02]), np.random.default_rng(0)
    weights = np.zeros((2, scene.particle_count, 3))
    weights[1, :, 2] = 1.0
    slid = np.zeros_like(scene.nodes)
    slid[flowed(scene)] = rng.standard_normal((*flowed(scene).shape, 3))
    rest = rng.standard_normal(sum(g.rest.size for g in scene.groups))
    for direction in ({"position": slid}, {"rest": rest}):
        forward, reverse = sensitivity(scene, times, sb.Solver(h=2e-3, method="newton"), weights, direction)
        assert forward != 0.0 and reverse == approx(forward, rel=1e-9)


@pytest.mark.parametrize("method", ["newton", "implicit"])
def test_a_short_tape_and_threads_have_the_same_bits(method):
    """Of the motion and of every gradient, with few states kept and with two threads."""
    times, weights = np.arange(11) / 100, np.random.default_rng(1)
    solver, scene = sb.Solver(h=2e-3, method=method), falling((4, 1, 1))
    plan = sb.tape_plan(scene, times, solver)
    tight = sb.tape_plan(scene, times, replace(solver, memory=plan.least))
    assert tight.recomputed > 0
    bar, runs = weights.standard_normal((11, scene.particle_count, 3)), []
    for one in (solver, replace(solver, memory=plan.least), replace(solver, threads=2)):
        run = sb.rollout(scene, times, one)
        runs.append((run.nodes, run.gradient(bar)))
    (nodes, whole), *others = runs
    for again, gradient in others:
        assert np.array_equal(nodes, again)
        assert gradient.quantities == whole.quantities
        assert all(np.array_equal(gradient.inputs[name], values) for name, values in whole.inputs.items())


def test_below_yield_it_is_elastic():
    stiff, elastic = falling(yield_stress=1e6), falling(yield_stress=None, hardening=None)
    moved = [sb.simulate(s, [0.0, 0.02, 0.04], sb.Solver(h=2e-3, method="newton")).positions for s in (stiff, elastic)]
    assert np.abs(moved[0] - moved[1]).max() < 1e-14


# --- a fit


def test_a_pressed_block_tells_modulus_and_yield_stress():
    """Pressed by a known force to beyond yield and let go, then harder: noise of 10 um on its markers."""

    def pressed(**options) -> tuple[sb.Scene, list[sb.Marker]]:
        mesh = sb.mesh.bricks((SIDE,) * 3, (2, 2, 2))
        numbers = {"density": 1000.0, "E": 1e5, "poisson": 0.4, "damping": 5e-3, "yield_stress": 2e3, "hardening": 2e4}
        scene = sb.solid(mesh, name="block", gravity=(0, 0, 0), pinned=mesh.sets["z_min"], **(numbers | options))
        top = mesh.sets["z_max"]
        inside = ((mesh.vertices[top, :2] > 1e-9) & (mesh.vertices[top, :2] < SIDE - 1e-9)).sum(axis=1)
        share = np.array([0.25, 0.5, 1.0])[inside] / 4
        push = np.array([0.0, 25.0, 0.0, 32.0, 0.0])
        force = -push[:, None, None] * share[:, None] * [0.0, 0.0, 1.0]
        scene.add_force(scene.solids["block"].particles[top], force, [0.0, 0.1, 0.2, 0.3, 0.4])
        seen = [
            sb.on_particle(int(p)) for p in scene.solids["block"].particles[np.flatnonzero(mesh.vertices[:, 2] > 0)]
        ]
        return scene, seen

    solver, times = sb.Solver(h=5e-3, method="newton"), np.arange(51) / 100
    scene, seen = pressed()
    x = sb.simulate(scene, times, solver).positions[:, [m.particles[0] for m in seen]]
    recording = sb.Recording(x + 1e-5 * np.random.default_rng(3).standard_normal(x.shape), times)
    start, seen = pressed(E=1.4e5, yield_stress=1.5e3, hardening=4e4)
    names = ["block_E", "block_yield_stress", "block_hardening"]
    fit = sb.fit(start, recording, names, markers=seen, solver=solver, sigma=1e-5, refine=False, profiles=False)
    for name, truth in zip(names, (1e5, 2e3, 2e4), strict=True):
        assert fit[name].lower < truth < fit[name].upper, name
        assert fit[name].value == approx(truth, rel=0.03), name
        assert fit[name].verdict == "identified", name


# --- contact


def column(layers: int, pressure: float, gap: float = 0.0) -> tuple[sb.Scene, sb.Solid, np.ndarray, np.ndarray]:
    """A column that is pressed onto a smooth table, and which of its vertices are at the bottom and on top."""
    scene = sb.Scene("column", gravity=(0.0, 0.0, 0.0))
    mesh = sb.mesh.bricks((0.02, 0.02, 0.04), (1, 1, layers))
    numbers = {"density": 1000.0, "E": E, "poisson": NU, "yield_stress": STRESS, "hardening": HARDENING}
    solid = sb.add_solid(scene, mesh, "clay", **numbers)
    z = mesh.vertices[:, 2]
    low, top = z < z.min() + 1e-9, z > z.max() - 1e-9
    scene.add_contact(solid.particles[low], sb.Plane((0.0, 0.0, float(z.min()) - gap), name="table"), friction=0.0)
    scene.add_force(solid.particles[top], [[0.0, 0.0, -pressure * 0.02**2 / 4]] * 4)
    return scene, solid, low, top


def test_a_column_on_a_table_is_pressed_together():
    """By sigma/E and (sigma - sigma_y)/H per length."""
    scene, solid, low, top = column(2, 3 * STRESS)
    solver = sb.Solver(h=0.02, method="implicit", integrator="bdf1")
    x = sb.simulate(scene, [0.0, 2.0], solver).positions[:, solid.particles, 2]
    sunk = x[0] - x[1]
    exact = 0.04 * (3 * STRESS / E + 2 * STRESS / HARDENING)
    assert sunk[top].mean() - sunk[low].mean() == approx(exact, rel=5e-3)


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients_beside_a_contact(integrator):
    scene = column(2, 20 * STRESS, 1e-4)[0]
    solver = sb.Solver(h=2e-3, method="implicit", integrator=integrator)
    report = sb.check_gradients(scene, [0.0, 0.01, 0.02], solver, samples=3)
    expect_exact(report, "clay_yield_stress", "clay_hardening")


# --- what a person gives

REFUSED = {
    "negative": ({"yield_stress": -1.0}, "bar.yield_stress", "must be positive"),
    "hardening below zero": ({"hardening": -1.0}, "bar.hardening", "must be positive"),
    "hardening alone": ({"yield_stress": None}, "bar.hardening", "needs a yield stress"),
    "rubber": ({"law": "neo_hookean"}, "bar.yield_stress", 'needs law = "strain"'),
    "no volume row": ({"volume_row": False}, "bar.yield_stress", "needs the volume row"),
    "clusters": (
        {"clusters": [range(12)], "poisson": None, "hardening": None}, "bar.yield_stress", "is given beside clusters"
    ),
    "orthotropic": (
        {"orthotropic": sb.Orthotropic((1e4,) * 3, (4e3,) * 3), "E": None, "poisson": None},
        "bar.yield_stress",
        "is given beside orthotropic",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    options, field, words = REFUSED[case]
    with refusal(field, words):
        falling(**options)


def test_tetrahedra_are_refused():
    tetrahedra = sb.mesh.tetrahedra((0.04, 0.02, 0.02), (2, 1, 1))
    with pytest.raises(sb.SceneError, match=r"solid.yield_stress.*linear tetrahedra lock.*Fix: use sb.mesh.bricks"):
        sb.solid(tetrahedra, density=1000.0, E=1e4, poisson=0.4, yield_stress=30.0)


def test_extrapolation_refuses_it_by_name():
    with pytest.raises(sb.InputError, match="yield_stress"):
        sb.simulate(falling(), [0.0, 0.01], sb.Solver(method="newton", extrapolate=2))


def test_solids_of_one_material_share_their_yield():
    scene = falling(material="clay")
    numbers = {"density": 1000.0, "E": 1e4, "poisson": 0.4, "damping": 4e-3, "yield_stress": 30.0}
    mesh = sb.mesh.bricks((0.04, 0.02, 0.02), (2, 1, 1))
    sb.add_solid(scene, mesh, "other", material="clay", hardening=4e3, **numbers)
    assert {"clay_yield_stress", "clay_hardening"} <= set(scene.quantities)
    with pytest.raises(sb.SceneError, match=r"third.hardening.*is not that of its material, clay"):
        sb.add_solid(scene, mesh, "third", material="clay", hardening=5e3, **numbers)


def test_an_equilibrium_keeps_what_has_flowed():
    """It takes the plastic strain from the start, zero: the shape at rest is that of the elastic solid."""
    plain = falling(yield_stress=None, hardening=None)
    found = [sb.equilibrium(s).positions for s in (falling(), plain)]
    assert found[0] == approx(found[1], abs=1e-12)
