"""Cloth with internal friction in bending: the loop of a strip bent back and forth, the crease that is left,
gradients, and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from support import expect_exact, refusal, sensitivity

B, SHARE, YIELD = 2e-5, 0.3, 10.0  # N m, none, 1/m
CELL, ALONG, ACROSS = 1e-3, 6, 16  # wide: sides that are free are softer by a part of a cell
H, HOLD, RAMP = 1e-3, 15, 45  # s, and substeps of a step of the curvature


def arc(curvature: float, along: np.ndarray, across: np.ndarray) -> np.ndarray:
    """(vertices, 3) m, a strip bent evenly about its middle row: a polygon whose cells keep their length."""
    turn = curvature * CELL
    angle = (along / CELL - ALONG / 2.0) * turn
    if turn == 0.0:
        return np.column_stack([along - CELL * ALONG / 2.0, across, np.zeros_like(along)])
    radius = CELL / (2.0 * np.sin(turn / 2.0))
    return np.column_stack([radius * np.sin(angle), across, radius * (1.0 - np.cos(angle))])


def strip(**options) -> tuple[sb.Scene, np.ndarray]:
    """A strip that two rows of vertices hold at either end; and these."""
    mesh = sb.mesh.grid(CELL * ALONG, CELL * ACROSS, ALONG, ACROSS, pattern="one_way")
    rows = np.round(mesh.vertices[:, 0] / CELL)
    held = np.flatnonzero((rows < 1.5) | (rows > ALONG - 1.5))
    scene = sb.Scene("strip", gravity=(0, 0, 0))
    flat = arc(0.0, *mesh.vertices[:, :2].T)
    given = {"density": 0.15, "warp": 1e3, "shear": 300.0, "bending": B, "drag_linear": 1.0, "held": held}
    sb.add_cloth(scene, mesh, positions=flat, **(given | {"yield_curvature": YIELD, "yield_share": SHARE} | options))
    return scene, held


def bent(stops: np.ndarray, **options) -> tuple[sb.Scene, np.ndarray]:
    """A strip whose ends are led so that it bends evenly from one curvature to the next, resting at each; and the
    times of these."""
    scene, held = strip(**options)
    ease = np.concatenate([(1.0 - np.cos(np.pi * np.arange(1, RAMP + 1) / RAMP)) / 2.0, np.ones(HOLD)])
    curvatures = np.concatenate([stops[:1], *[a + (b - a) * ease for a, b in pairwise(stops)]])
    cloth = scene.cloths["cloth"]
    u, v = cloth.mesh.vertices[held, 0], cloth.mesh.vertices[held, 1]
    knots = H * np.arange(len(curvatures))
    scene.drive(cloth.particles[held], knots, np.stack([arc(k, u, v) for k in curvatures]), interpolation="linear")
    return scene, knots[:: RAMP + HOLD]


def moments(stops: np.ndarray, **options) -> np.ndarray:
    """Moment per width, N, at every curvature but the first, as a torque sensor at the clamp reads it."""
    scene, times = bent(stops, **options)
    cloth = scene.cloths["cloth"]
    clamp = cloth.particles[cloth.mesh.vertices[:, 0] < 1.5 * CELL]
    solver = sb.Solver(h=H, method="newton", integrator="bdf1")
    read = sb.simulate_forces(scene, times[1:], [int(p) for p in clamp], solver)
    return read.torques[:, 1] / (CELL * ACROSS)


def law(stops: np.ndarray, share: float = SHARE, yield_curvature: float = YIELD) -> tuple[np.ndarray, np.ndarray]:
    """Moment per width in closed form, and what has slid, at every curvature but the first."""
    slid, found = 0.0, []
    for kappa in stops[1:]:
        slid = min(max(slid, kappa - yield_curvature), kappa + yield_curvature)
        found.append(slid)
    return B * (stops[1:] - share * np.array(found)), np.array(found)


LOOP = YIELD * np.concatenate([np.arange(5.0), np.arange(5, -5, -1.0), np.arange(-5, 6.0)])
HEIGHT = 2.0 * SHARE * B * YIELD


# --- O-40: the loop of Kawabata's bending test


def test_the_loop_of_a_strip_bent_back_and_forth():
    """In a closed cycle, wherever both branches slide, the loop is 2 share B yield high and (1 - share) B steep."""
    measured = moments(LOOP)
    assert measured == approx(law(LOOP)[0], abs=1e-3 * B * LOOP.max())
    back, out = measured[4:15], measured[14:25]  # from 5 to -5 times the yield curvature, and back again
    for k in range(-2, 3):
        assert out[5 + k] - back[5 - k] == approx(HEIGHT, rel=1e-3), k
    assert (out[10] - out[5]) / (5.0 * YIELD) == approx((1.0 - SHARE) * B, rel=1e-3)


def test_a_laboratory_reads_the_yield_off_the_loop():
    stops = np.append(LOOP, YIELD * np.arange(4, -1, -1.0))
    curve = textile.Curve("strip", "bending", stops[1:], moments(stops))
    found = textile.bending_yield(curve)
    assert found.bending.value == approx(B, rel=2e-3)
    assert found.yield_share.value == approx(SHARE, rel=5e-3)
    assert found.yield_curvature.value == approx(YIELD, rel=5e-3)
    assert found.misfit < 1e-3
    loop = textile.bending_loop(curve, -1, slope=(15.0, 45.0), at=20.0)
    assert loop.rigidity.value == approx((1.0 - SHARE) * B, rel=1e-3)
    assert loop.hysteresis.value == approx(HEIGHT, rel=1e-3)


def test_below_yield_a_strip_is_elastic():
    scene, times = bent(YIELD * np.array([0.0, 0.9, -0.9, 0.5]))
    plain, _ = bent(YIELD * np.array([0.0, 0.9, -0.9, 0.5]), yield_curvature=None, yield_share=None)
    solver = sb.Solver(h=H, method="newton")
    moved = [sb.simulate(s, times, solver).positions for s in (scene, plain)]
    assert np.abs(moved[0] - moved[1]).max() < 1e-12


@pytest.mark.parametrize(("share", "left"), [(0.7, 0.7 * 3.0), (0.3, 0.3 / 0.7)], ids=["once", "back"])
def test_the_crease_that_unloading_leaves(share, left):
    """Bent to four times the yield curvature y and let go, a strip keeps share (4 - 1) y; where the elastic part is
    strong enough to slide the other one back, (1 - share) (4 - 1) > 1, it keeps share y/(1 - share)."""
    rest = YIELD * left
    measured = moments(np.array([0.0, 4.0 * YIELD, rest, 1.01 * rest, 0.99 * rest]), yield_share=share)
    assert measured[1] == approx(0.0, abs=1e-3 * HEIGHT)
    assert measured[2] > 1e-3 * HEIGHT and measured[3] < -1e-3 * HEIGHT


def test_a_sheet_with_one_rigidity_yields_alike_in_all_directions():
    """A square bent to a cylinder along any direction, to twice its yield: the first substep slides by the half."""
    for degrees in (0.0, 30.0, 45.0, 90.0):
        mesh = sb.mesh.grid(0.02, 0.02, 10, 10, pattern="one_way")
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        along, across = mesh.vertices[:, :2] @ [c, s], mesh.vertices[:, :2] @ [-s, c]
        kappa = 4.0 * YIELD
        x, z = np.sin(along * kappa) / kappa, (1.0 - np.cos(along * kappa)) / kappa
        positions = np.column_stack([x * c - across * s, x * s + across * c, z])
        scene = sb.Scene("sheet", gravity=(0, 0, 0))
        cloth = sb.add_cloth(
            scene, mesh, density=0.15, warp=1e3, shear=500.0, bending=B, positions=positions,
            yield_curvature=2.0 * YIELD, yield_share=SHARE,
        )  # fmt: skip
        scene.pin(cloth.particles[:1])
        moved = sb.simulate(scene, [0.0, 1e-9], sb.Solver(h=1e-9))
        slid = moved.nodes[-1][scene.groups[-1].particles[:, 6]]
        assert np.linalg.norm(slid, axis=1) == approx(kappa / 2.0, rel=2e-2), degrees
        twist = np.sqrt(2.0) * c * s
        assert slid.mean(axis=0) / (kappa / 2.0) == approx([c * c, s * s, twist], abs=1e-2), degrees


# --- gradients


def falling(**options) -> sb.Scene:
    mesh = sb.mesh.grid(0.008, 0.006, 4, 3, pattern="one_way")
    scene, held = sb.Scene("sheet"), mesh.sets["left"]
    given = {"bending": 1e-6, "bending_weft": 2e-6, "bending_twist": 1.5e-6, "bend_damping": 2e-3, "held": held}
    given |= {"density": 0.3, "warp": 200.0, "shear": 60.0, "yield_curvature": 3.0, "yield_share": SHARE}
    cloth = sb.add_cloth(scene, mesh, **(given | options))
    scene.pin(cloth.particles[held])
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["direct", "newton", "newton_cg", "gauss_seidel", "implicit"])
def test_gradients(method, integrator):
    solver = sb.Solver(h=1e-3, method=method, integrator=integrator)
    report = sb.check_gradients(falling(), [0.0, 0.01, 0.02], solver)
    yields = "cloth_yield_share", "cloth_yield_curvature"
    expect_exact(report, "cloth_bending", "cloth_bending_weft", "cloth_bending_twist", *yields)


def test_it_slides_in_that_motion():
    scene = falling()
    moved = sb.simulate(scene, [0.0, 0.02], sb.Solver(h=1e-3))
    slid = moved.nodes[-1][scene.group("cloth_bend")[0].particles[:, 6]]
    assert (np.linalg.norm(slid, axis=1) > 0.5).mean() > 0.3


def test_gradients_with_respect_to_the_rest_shape_and_what_had_slid():
    scene, times = falling(), np.array([0.0, 0.02])
    weights = np.zeros((2, scene.particle_count, 3))
    weights[1, :, 2] = 1.0
    group = scene.group("cloth_bend")[0]
    rng, count = np.random.default_rng(0), len(group.rest)
    angles = [np.zeros_like(g.rest) for g in scene.groups]
    angles[-1][:, 11:14] = rng.standard_normal((count, 3))
    slid = np.zeros_like(scene.nodes)
    slid[group.particles[:, 6]] = rng.standard_normal((count, 3))
    for direction in ({"rest": np.concatenate([a.ravel() for a in angles])}, {"position": slid}):
        forward, reverse = sensitivity(scene, times, sb.Solver(h=1e-3), weights, direction)
        assert forward != 0.0 and reverse == approx(forward, rel=1e-9)


# --- what a person gives


def test_cuts_of_a_fabric_share_its_yield():
    scene = falling(fabric="twill")
    sb.add_cloth(
        scene, sb.mesh.grid(0.01, 0.01, 4, 4, pattern="one_way"), "other", fabric="twill", density=0.3, warp=200.0,
        shear=60.0, bending=1e-6, bending_weft=2e-6, bending_twist=1.5e-6, bend_damping=2e-3, yield_curvature=3.0,
        yield_share=SHARE,
    )  # fmt: skip
    assert {"twill_yield_curvature", "twill_yield_share"} <= set(scene.quantities)
    with pytest.raises(sb.SceneError, match=r"third.yield_share.*is not that of its fabric, twill"):
        sb.add_cloth(
            scene, sb.mesh.grid(0.01, 0.01, 4, 4, pattern="one_way"), "third", fabric="twill", density=0.3, warp=200.0,
            shear=60.0, bending=1e-6, bending_weft=2e-6, bending_twist=1.5e-6, bend_damping=2e-3, yield_curvature=3.0,
            yield_share=0.5,
        )  # fmt: skip


REFUSED = {
    "no share": ({"yield_share": None}, "cloth.yield_share", "belong together"),
    "no curvature": ({"yield_curvature": None}, "cloth.yield_share", "belong together"),
    "all of it": ({"yield_share": 1.0}, "cloth.yield_share", "between 0 and 1"),
    "negative": ({"yield_curvature": -3.0}, "cloth.yield_curvature", "must be positive"),
    "no bending": (
        {"bending": None, "bending_weft": None, "bending_twist": None, "bend_damping": None},
        "cloth.yield_curvature",
        "belongs to the curvature model",
    ),
    "hinges": (
        {"bending_weft": None, "bending_twist": None, "bending_model": "dihedral"},
        "cloth.yield_curvature",
        "belongs to the curvature model",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    options, field, words = REFUSED[case]
    with refusal(field, words):
        falling(**options)


def test_extrapolation_refuses_it_by_name():
    with pytest.raises(sb.InputError, match="yield_curvature"):
        sb.simulate(falling(), [0.0, 0.01], sb.Solver(extrapolate=2))
