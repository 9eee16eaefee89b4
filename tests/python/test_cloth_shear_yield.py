"""Cloth with friction between yarns in shear: the loop of a sheet sheared back and forth, gradients, and what is
refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from support import expect_exact, refusal, sensitivity

WARP, WEFT, G, SHARE, YIELD = 2e3, 1e3, 40.0, 0.4, 0.02  # N/m, N/m, N/m, none, none
CELL, CELLS = 2e-3, 4  # m
H, HOLD, RAMP = 1e-3, 15, 45  # s, and substeps of a step of the shear


def sheared(stops: np.ndarray, **options) -> tuple[sb.Scene, np.ndarray]:
    """A square sheet whose border is led in simple shear along the warp from one shear strain to the next, resting at
    each; and the times of these."""
    mesh = sb.mesh.grid(CELL * CELLS, CELL * CELLS, CELLS, CELLS)
    scene = sb.Scene("sheet", gravity=(0, 0, 0))
    given = {"density": 0.15, "warp": WARP, "weft": WEFT, "shear": G, "drag_linear": 5.0}
    given |= {"bending": 1e-4, "bending_model": "dihedral"}  # stiff enough not to buckle across the shear
    cloth = sb.add_cloth(scene, mesh, **(given | {"yield_shear": YIELD, "yield_shear_share": SHARE} | options))
    ease = np.concatenate([(1.0 - np.cos(np.pi * np.arange(1, RAMP + 1) / RAMP)) / 2.0, np.ones(HOLD)])
    strains = np.concatenate([stops[:1], *[a + (b - a) * ease for a, b in pairwise(stops)]])
    border = np.unique(mesh.borders)
    places = mesh.vertices[border]
    knots = H * np.arange(len(strains))
    moved = places + strains[:, None, None] * places[:, [1]] * [1.0, 0.0, 0.0]
    scene.drive(cloth.particles[border], knots, moved, interpolation="linear")
    return scene, knots[:: RAMP + HOLD]


def forces(stops: np.ndarray, method: str = "newton", **options) -> np.ndarray:
    """Shear force per width, N/m, at every strain but the first, as a force sensor at the upper jaw reads it. What the
    sides bear at its corners is opposite."""
    scene, times = sheared(stops, **options)
    cloth = scene.cloths["cloth"]
    jaw = cloth.particles[cloth.mesh.vertices[:, 1] > CELL * (CELLS - 0.5)]
    solver = sb.Solver(h=H, method=method, integrator="bdf1")
    read = sb.simulate_forces(scene, times[1:], [int(p) for p in jaw], solver)
    return read.forces[:, 0] / (CELL * CELLS)


def law(stops: np.ndarray, share: float = SHARE) -> tuple[np.ndarray, np.ndarray]:
    """Force per width in closed form, and what has slid, at every shear strain but the first. The height is kept, so
    that the weft is pulled by a strain of s^2/2, along a direction that leans by s."""
    slid, found = 0.0, []
    for s in stops[1:]:
        slid = min(max(slid, s - YIELD), s + YIELD)
        found.append(slid)
    s = stops[1:]
    return G * (s - share * np.array(found)) + WEFT * s**3 / 2.0, np.array(found)


LOOP = YIELD * np.concatenate([np.arange(5.0), np.arange(5, -5, -1.0), np.arange(-5, 6.0)])
HEIGHT = 2.0 * SHARE * G * YIELD


# --- the loop of Kawabata's shear test


@pytest.mark.parametrize("method", ["newton", "direct", "implicit"])
def test_the_loop_of_a_sheet_sheared_back_and_forth(method):
    """In a closed cycle, wherever both branches slide, the loop is 2 share G yield high."""
    measured = forces(LOOP, method)
    assert measured == approx(law(LOOP)[0], abs=1e-4 * HEIGHT)
    back, out = measured[4:15], measured[14:25]  # from 5 to -5 times the yield strain, and back again
    for k in range(-2, 3):
        assert out[5 + k] - back[5 - k] == approx(HEIGHT, rel=1e-4), k


def test_a_laboratory_reads_the_yield_off_the_loop():
    """Under a tension that is kept the yarns across are not stretched further: without that part of the force."""
    stops = np.append(LOOP, YIELD * np.arange(4, -1, -1.0))
    tension = 9.80665
    load = forces(stops) - WEFT * stops[1:] ** 3 / 2.0 + tension * stops[1:]
    curve = textile.Curve("sheet", "shear", np.arctan(stops[1:]), load)
    found = textile.shear_yield(curve)
    assert found.shear.value == approx(G, rel=1e-3)
    assert found.yield_shear_share.value == approx(SHARE, rel=1e-3)
    assert found.yield_shear.value == approx(YIELD, rel=1e-3)
    assert found.hysteresis.value == approx(HEIGHT, rel=1e-3)
    slope = (2.5, 5.0)  # degrees
    loop = textile.shear_loop(curve, -1, slope=slope, at=(1.0, 2.0))
    per_angle = np.diff(np.tan(np.radians(slope)))[0] / np.diff(np.radians(slope))[0]
    assert loop.stiffness.value == approx(((1.0 - SHARE) * G + tension) * per_angle, rel=1e-3)
    assert loop.hysteresis.value == approx(HEIGHT, rel=1e-3)


def test_below_yield_a_sheet_is_elastic():
    stops = YIELD * np.array([0.0, 0.9, -0.9, 0.5])
    moved = []
    for scene, times in (sheared(stops), sheared(stops, yield_shear=None, yield_shear_share=None)):
        moved.append(sb.simulate(scene, times, sb.Solver(h=H, method="newton")).positions)
    assert np.abs(moved[0] - moved[1]).max() < 1e-12


@pytest.mark.parametrize(("share", "left"), [(0.7, 0.7 * 3.0), (0.4, 0.4 / 0.6)], ids=["once", "back"])
def test_the_angle_that_unloading_leaves(share, left):
    """Sheared to four times the yield strain y and let go, a sheet keeps share (4 - 1) y; where the elastic part is
    strong enough to slide the other one back, (1 - share) (4 - 1) > 1, it keeps share y/(1 - share)."""
    stops = YIELD * np.array([0.0, 4.0, left])
    measured = forces(stops, yield_shear_share=share) - WEFT * stops[1:] ** 3 / 2.0
    assert measured[1] == approx(0.0, abs=1e-4 * HEIGHT)


def test_tension_does_not_slide():
    """Stretched along warp and weft by half a yield strain and more, nothing slides and the forces are elastic."""
    found = []
    for options in ({}, {"yield_shear": None, "yield_shear_share": None}):
        mesh = sb.mesh.grid(CELL * CELLS, CELL * CELLS, CELLS, CELLS)
        scene = sb.Scene("sheet", gravity=(0, 0, 0))
        given = {"yield_shear": YIELD, "yield_shear_share": SHARE} | options
        sb.add_cloth(
            scene,
            mesh,
            density=0.15,
            warp=WARP,
            weft=WEFT,
            shear=G,
            positions=mesh.vertices * [1.05, 1.1, 1.0],
            **given,
        )
        moved = sb.simulate(scene, [0.0, 0.005], sb.Solver(h=H))
        found.append(moved.positions[-1])
        if not options:
            slid = moved.nodes[-1][scene.group("cloth_membrane")[0].particles[:, 3]]
            assert np.abs(slid[:, :2]).max() == 0.0
    assert np.abs(found[0] - found[1]).max() < 1e-12


# --- gradients


def hanging(**options) -> sb.Scene:
    """A sheet in the x-z plane, which is to be held at its left side."""
    mesh = sb.mesh.grid(0.008, 0.006, 4, 3, pattern="one_way")
    scene, held = sb.Scene("sheet"), mesh.sets["left"]
    given = {"bending": 1e-6, "membrane_damping": 2e-3, "held": held, "weft": 150.0, "poisson": 0.2}
    given |= {"density": 0.3, "warp": 200.0, "shear": 6.0, "yield_shear": 1e-3, "yield_shear_share": SHARE}
    sb.add_cloth(scene, mesh, positions=mesh.vertices[:, [0, 2, 1]], **(given | options))
    return scene


def side(scene: sb.Scene) -> np.ndarray:
    cloth = scene.cloths["cloth"]
    return cloth.particles[cloth.mesh.sets["left"]]


def falling(**options) -> sb.Scene:
    scene = hanging(**options)
    scene.pin(side(scene))
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["direct", "newton", "newton_cg", "gauss_seidel", "implicit"])
def test_gradients(method, integrator):
    solver = sb.Solver(h=1e-3, method=method, integrator=integrator)
    report = sb.check_gradients(falling(), [0.0, 0.01, 0.02], solver)
    yields = "cloth_yield_shear_share", "cloth_yield_shear"
    expect_exact(report, "cloth_warp", "cloth_weft", "cloth_shear", *yields)


def test_it_slides_in_that_motion():
    scene = falling()
    moved = sb.simulate(scene, [0.0, 0.02], sb.Solver(h=1e-3))
    slid = moved.nodes[-1][scene.group("cloth_membrane")[0].particles[:, 3]]
    assert (np.abs(slid[:, 2]) > 1e-5).mean() > 0.3


def test_gradients_with_respect_to_what_had_slid():
    scene, times = falling(), np.array([0.0, 0.02])
    weights = np.zeros((2, scene.particle_count, 3))
    weights[1, :, 2] = 1.0
    group = scene.group("cloth_membrane")[0]
    slid = np.zeros_like(scene.nodes)
    slid[group.particles[:, 3]] = np.random.default_rng(0).standard_normal((len(group.rest), 3))
    forward, reverse = sensitivity(scene, times, sb.Solver(h=1e-3), weights, {"position": slid})
    assert forward != 0.0 and reverse == approx(forward, rel=1e-9)


def shaken(**options) -> sb.Scene:
    """The same sheet, whose held side is shaken up and down, so that its shear turns back."""
    scene = hanging(**options)
    times = np.arange(81) / 1000
    height = 3e-3 * np.sin(2.0 * np.pi * 25.0 * times)
    scene.drive(side(scene), times, scene.positions[side(scene)] + height[:, None, None] * [0.0, 0.0, 1.0])
    return scene


def test_a_fit_finds_the_yield_from_a_motion():
    times, solver = np.arange(61) / 1000, sb.Solver(h=1e-3, method="newton")
    x = sb.simulate(shaken(), times, solver).positions
    x = x + 1e-6 * np.random.default_rng(1).standard_normal(x.shape)
    scene = shaken(yield_shear=2e-3, yield_shear_share=0.25)
    found = sb.fit(
        scene,
        sb.Recording(x, times),
        ["cloth_yield_shear", "cloth_yield_shear_share"],
        markers=[sb.on_particle(int(i)) for i in range(x.shape[1])],
        solver=solver,
        sigma=1e-6,
        refine=False,
        profiles=False,
    )
    for name, value in (("cloth_yield_shear", 1e-3), ("cloth_yield_shear_share", SHARE)):
        assert found[name].lower < value < found[name].upper, name
        assert found[name].half_width < 0.1 * value, name


# --- what a person gives

REFUSED = {
    "no share": ({"yield_shear_share": None}, "cloth.yield_shear_share", "belong together"),
    "no strain": ({"yield_shear": None}, "cloth.yield_shear_share", "belong together"),
    "all of it": ({"yield_shear_share": 1.0}, "cloth.yield_shear_share", "between 0 and 1"),
    "negative": ({"yield_shear": -3.0}, "cloth.yield_shear", "must be positive"),
    "a law": ({"law": sb.laws.Sinh(3.0, 2.0, 8.0)}, "cloth.yield_shear", "belongs to the linear law"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    options, field, words = REFUSED[case]
    with refusal(field, words):
        falling(**options)


def test_cuts_of_a_fabric_share_its_yield():
    scene = falling(fabric="twill")
    assert {"twill_yield_shear", "twill_yield_shear_share"} <= set(scene.quantities)


def test_extrapolation_refuses_it_by_name():
    with pytest.raises(sb.InputError, match="yield_shear"):
        sb.simulate(falling(), [0.0, 0.01], sb.Solver(extrapolate=2))
