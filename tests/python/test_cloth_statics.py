"""Cloth at rest against closed forms: strips, patches and cantilevers. Values, and derivatives by tangents and by the
adjoint."""

import math
import re

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.integrate import quad
from scipy.optimize import brentq
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from support import static_sensitivity, twice

WARP, SHEAR = 1000.0, 50.0
TENSION = 50.0  # N/m
BENDING = 1e-3  # of a membrane under tension, where it has no part in the answer


def pulled(mesh: sb.TriangleMesh, tension: float = TENSION, along: str = "right", **options) -> sb.Scene:
    """A sheet under uniform dead tension [N/m] on two opposite sides, free to narrow.

    One corner is pinned. The traction balances, so the pin carries nothing; a spring of no account stops the turn about
    the pull and the turn in the plane.
    """
    scene = sb.Scene("strip", gravity=(0, 0, 0))
    cloth = sb.add_cloth(scene, mesh, density=0.2, bending=BENDING, bending_model="dihedral", **options)
    load = np.zeros((len(mesh.vertices), 3))
    axis = 0 if along == "right" else 1
    for side, sign in zip(("left", "right") if axis == 0 else ("bottom", "top"), (-1.0, 1.0), strict=True):
        ids = mesh.sets[side]
        x = mesh.vertices[ids]
        for a, b, length in zip(ids[:-1], ids[1:], np.linalg.norm(np.diff(x, axis=0), axis=1), strict=True):
            load[[a, b], axis] += sign * tension * length / 2.0
    loaded = np.flatnonzero(load.any(axis=1))
    scene.add_force(cloth.particles[loaded], load[None, loaded])
    corner = mesh.sets["corners"]
    scene.pin(cloth.particles[[corner[0]]])
    anchors = scene.add_particles(mesh.vertices[corner[1:]] + [0, 0, 1e3], 1.0)
    scene.pin(anchors)
    pairs = np.column_stack([cloth.particles[corner[1:]], anchors])
    scene.add_constraints("distance", pairs, name="hold", compliance=np.full(3, 1e6))
    return scene


def stretch(rest: sb.Equilibrium) -> tuple[float, float]:
    """Length and width over those at rest."""
    cloth = rest.scene.cloths["cloth"]
    x, mesh = rest.positions[cloth.particles], cloth.mesh
    corner = mesh.sets["corners"]
    before = mesh.vertices[corner]
    after = x[corner]
    return tuple(float(np.linalg.norm(after[k] - after[0]) / np.linalg.norm(before[k] - before[0])) for k in (1, 3))  # type: ignore[return-value]


def strip(**options) -> sb.TriangleMesh:
    return sb.mesh.grid(0.3, 0.2, 6, 4, **options)


# --- O-24: uniaxial strip, free sides


@pytest.mark.parametrize("poisson", [0.0, 0.3])
@pytest.mark.parametrize("pattern", ["alternating", "crossed"])
def test_a_strip_of_st_venant_kirchhoff(poisson, pattern):
    rest = sb.equilibrium(pulled(strip(pattern=pattern), warp=WARP, shear=SHEAR, poisson=poisson))
    longer = brentq(lambda s: WARP * s * (s * s - 1.0) / 2.0 - TENSION, 1.0, 2.0, xtol=1e-15)
    assert longer == approx(1.0466805318, abs=1e-10)
    narrower = math.sqrt(1.0 - poisson * (longer**2 - 1.0))
    assert stretch(rest) == approx((longer, narrower), abs=1e-8)


def test_derivatives_of_the_strip_by_stiffness_and_poisson():
    scene = pulled(strip(), warp=WARP, weft=WARP, shear=SHEAR, poisson=0.3)
    rest = sb.equilibrium(scene)
    s = stretch(rest)[0]
    far = np.zeros((scene.particle_count, 3))
    corner = scene.cloths["cloth"].mesh.sets["corners"]
    far[corner[1], 0] = 1 / 0.3
    # with warp and weft apart the strip along the warp depends on the warp alone
    assert static_sensitivity(rest, "cloth_warp", far) == approx(twice(-4.37326631e-5), rel=1e-7)
    assert static_sensitivity(rest, "cloth_weft", far) == approx(twice(0.0), abs=1e-11)
    assert static_sensitivity(rest, "cloth_shear", far) == approx(twice(0.0), abs=1e-11)
    wide = np.zeros((scene.particle_count, 3))
    wide[corner[3], 1] = 1 / 0.2
    narrow = stretch(rest)[1]
    assert static_sensitivity(rest, "cloth_poisson", wide) == approx(twice(-(s**2 - 1.0) / (2.0 * narrow)), rel=1e-7)


def test_an_orthotropic_strip_narrows_by_its_own_poisson_ratio():
    weft, coupling = 400.0, 0.25
    rest = sb.equilibrium(pulled(strip(), warp=WARP, weft=weft, shear=SHEAR, poisson=coupling))
    longer = 1.0466805318
    narrower = math.sqrt(1.0 - coupling * math.sqrt(WARP / weft) * (longer**2 - 1.0))
    assert stretch(rest) == approx((longer, narrower), abs=1e-8)
    across = sb.equilibrium(pulled(strip(), along="top", warp=WARP, weft=weft, shear=SHEAR, poisson=coupling))
    wider = brentq(lambda s: weft * s * (s * s - 1.0) / 2.0 - TENSION, 1.0, 2.0, xtol=1e-15)
    shorter = math.sqrt(1.0 - coupling * math.sqrt(weft / WARP) * (wider**2 - 1.0))
    assert stretch(across) == approx((shorter, wider), abs=1e-8)


# --- nonlinear fabrics: the force of a strip is its law's


def tangent(ratios: tuple[float, ...], spacing: float, e: float) -> float:
    return float(np.interp(e, spacing * np.arange(5), [1.0, *ratios]))


RATIOS = (2.0, 5.0, 9.0, 12.0)
LAWS = {
    "exponential": (
        sb.laws.Exponential(30.0, 30.0, 5.0),
        lambda e: WARP * e * math.exp(30.0 * e * e),
    ),
    "sinh": (
        sb.laws.Sinh(12.0, 12.0, 5.0),
        lambda e: WARP * math.sinh(12.0 * e) / 12.0,
    ),
    "spline": (
        sb.laws.Spline((0.06, 0.06, 0.1), RATIOS, RATIOS),
        lambda e: WARP * quad(lambda s: tangent(RATIOS, 0.06, s), 0.0, e, points=[0.06, 0.12, 0.18, 0.24])[0],
    ),
}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("tension", [20.0, 300.0, 3000.0])
def test_a_strip_of_a_stiffening_fabric(name, tension):
    law, stress = LAWS[name]
    rest = sb.equilibrium(pulled(strip(), tension, warp=WARP, shear=SHEAR, law=law))
    longer = brentq(lambda s: s * stress((s * s - 1.0) / 2.0) - tension, 1.0, 3.0, xtol=1e-14)
    assert stretch(rest) == approx((longer, 1.0), abs=1e-8)


@pytest.mark.parametrize(
    ("law", "b", "stress"),
    [
        (sb.laws.Exponential, 30.0, lambda b, e: e * math.exp(b * e * e)),
        (sb.laws.Sinh, 12.0, lambda b, e: math.sinh(b * e) / b),
    ],
)
def test_derivative_by_a_stiffening(law, b, stress):
    scene = pulled(strip(), 300.0, warp=WARP, shear=SHEAR, law=law(b, b, 5.0))
    rest = sb.equilibrium(scene)

    def length(b):
        return brentq(lambda s: WARP * s * stress(b, (s * s - 1.0) / 2.0) - 300.0, 1.0, 3.0, xtol=1e-15)

    far = np.zeros((scene.particle_count, 3))
    far[scene.cloths["cloth"].mesh.sets["corners"][1], 0] = 1 / 0.3
    closed = (length(b + 1e-3) - length(b - 1e-3)) / 2e-3
    assert static_sensitivity(rest, "cloth_warp_stiffening", far) == approx(twice(closed), rel=1e-6)


# --- O-24b: off-axis modulus


def test_modulus_at_45_degrees():
    mesh = strip()
    c = math.sqrt(0.5)
    turned = sb.TriangleMesh(mesh.vertices, mesh.triangles, mesh.vertices[:, :2] @ [[c, -c], [c, c]], mesh.sets)
    tension = 1e-3
    E, nu, G = 1000.0, 0.3, 50.0
    scene = pulled(turned, tension, warp=E, weft=E, shear=G, poisson=nu)
    rest = sb.equilibrium(scene)
    x = rest.positions[scene.cloths["cloth"].particles]
    corner = mesh.sets["corners"]
    modulus = tension / ((x[corner[1], 0] - x[corner[0], 0]) / 0.3 - 1.0)
    expected = 1.0 / (0.25 * (1 / E + 1 / G - 2 * nu / E + 1 / E))
    assert expected == approx(186.9159, abs=1e-4)
    assert modulus == approx(expected, rel=1e-4)
    far = np.zeros((scene.particle_count, 3))
    far[corner[1], 0] = 1 / 0.3
    # d(strain)/dG = -tension/(4 G^2)
    assert static_sensitivity(rest, "cloth_shear", far) == approx(twice(-tension / (4 * G * G)), rel=1e-3)


# --- O-26a: simple shear


def test_simple_shear():
    gamma, n = 0.1, 6
    mesh = sb.mesh.grid(0.2, 0.2, n, n)
    edge = np.unique(mesh.borders)
    sheared = mesh.vertices.copy()
    sheared[:, 0] += gamma * mesh.vertices[:, 1]
    scene = sb.Scene("frame", gravity=(0, 0, 0))
    cloth = sb.add_cloth(
        scene, mesh, density=0.2, warp=WARP, shear=SHEAR, held=edge, bending=BENDING, positions=sheared
    )
    scene.pin(cloth.particles[edge])
    rest = sb.equilibrium(scene, stable=False)  # a sheared sheet buckles
    assert rest.positions == approx(sheared, abs=1e-12)
    strains = sb.constraint_values(scene, rest.positions)["cloth_membrane"]
    assert strains[:, 0] == approx(0.0, abs=1e-14)
    assert strains[:, 1] == approx(gamma**2 / 2, abs=1e-14)
    assert strains[:, 2] * math.sqrt(WARP / SHEAR) == approx(gamma, abs=1e-14)
    # the top support's force per width is (S_uv + gamma S_vv, S_vv); nodes by the corners lack the triangles left out
    inner = sb.support_forces(rest)[cloth.particles[mesh.sets["top"][2:-2]]].sum(axis=0) / (0.2 * (n - 3) / n)
    S_vv = WARP * gamma**2 / 2
    assert inner[:2] == approx([SHEAR * gamma + gamma * S_vv, S_vv], rel=1e-10)


def test_a_trial_value_that_makes_the_start_infinite_has_no_answer():
    mesh = strip()
    positions = mesh.vertices * [1.5, 1.0, 1.0]
    options = {"warp": WARP, "shear": SHEAR, "law": sb.laws.Exponential(2.0, 2.0, 2.0), "bending_model": "dihedral"}
    scene = sb.Scene("strip", gravity=(0, 0, 0))
    ends = np.concatenate([mesh.sets["left"], mesh.sets["right"]])
    cloth = sb.add_cloth(scene, mesh, density=0.2, bending=BENDING, held=ends, positions=positions, **options)
    scene.pin(cloth.particles[ends])
    recording = sb.Recording(np.zeros((1, 1, 3)), np.zeros(1), ("m",))
    markers = {"m": sb.on_cloth(cloth, [[0.15, 0.1]])[0]}
    experiment = sb.Experiment(scene=scene, recording=recording, markers=markers, static=True)
    problem = FitProblem([experiment], as_parameters(["cloth_warp_stiffening"], [experiment]))
    assert problem.evaluate(np.log([2.0]))[0]
    assert not problem.evaluate(np.log([1e5]))[0]  # exp(b e^2) overflows
    assert "not finite" in problem.core.failure


def test_a_scene_with_one_cloth() -> None:
    """As `rope` and `rod`: the scene, with the options of `add_cloth` and pinned vertices."""
    mesh = sb.mesh.equilateral(0.3, 0.3, 3)
    top = mesh.sets["corners"][2:]
    made = sb.cloth(mesh, density=0.2, warp=60, shear=4, bending=3e-5, name="towel", pinned=top)
    by_hand = sb.Scene("towel")
    added = sb.add_cloth(by_hand, mesh, "towel", density=0.2, warp=60, shear=4, bending=3e-5, held=top)
    by_hand.pin(added.particles[top])
    assert made.quantities == by_hand.quantities and made.pinned == by_hand.pinned
    assert np.array_equal(made.compiled.inputs(), by_hand.compiled.inputs())
    assert list(made.cloths) == ["towel"]
    assert not sb.cloth(mesh, density=0.2, warp=60, shear=4).pinned  # one that falls
    with pytest.raises(sb.SceneError, match=re.escape("cloth.pinned")):
        sb.cloth(mesh, density=0.2, warp=60, shear=4, pinned=[10_000])
