"""Tests in the plane: tension and shear between jaws, picture frame, bias extension. Values in closed form, and
derivatives against differences."""

import math

import pytest
import sheetbend as sb
from pytest import approx
from scipy.optimize import brentq
from sheetbend import textile
from support import by_fabric, refusal

APPAREL = sb.Fabric(density=0.2, warp=2000.0, weft=1500.0, shear=50.0, poisson=0.2, bending=2e-5, bending_weft=1e-5)
FIELDS = ["density", "warp", "weft", "shear", "poisson"]


def check(run, number: str, field: str, fabric: sb.Fabric = APPAREL) -> None:
    reading = getattr(run(fabric), number)
    difference = by_fabric(lambda f: getattr(run(f), number).value, fabric, field)
    noise = 1e-8 * max(abs(reading.value), 1e-3) / (getattr(fabric, field) or 1.0)
    assert reading.gradient[f"cloth_{field}"] == approx(difference, rel=1e-6, abs=noise)
    assert not [name for name in reading.gradient if name.startswith(("jaw", "frame"))]


# --- KES tension


@pytest.mark.parametrize(("along", "stiffness"), [("warp", 1000.0), ("weft", 400.0)])
def test_extension_of_a_fabric_that_does_not_narrow(along, stiffness):
    """O-24: Y s (s^2 - 1)/2 = load."""
    fabric = sb.Fabric(density=0.2, warp=1000.0, weft=400.0, shear=50.0, bending=1e-5)
    test = textile.uniaxial(fabric, along, load=50.0)
    s = brentq(lambda s: stiffness * s * (s * s - 1.0) / 2.0 - 50.0, 1.0, 2.0, xtol=1e-15)
    if along == "warp":
        assert s == approx(1.0466805318, abs=1e-10)
        assert test.extension.gradient["cloth_warp"] == approx(-4.37326631e-5, rel=1e-7)
    assert test.extension.value == approx(s - 1.0, rel=1e-8)
    work = stiffness * (s * s - 1.0) ** 2 / 8.0
    assert test.energy.value == approx(work, rel=1e-8)
    assert test.linearity.value == approx(work / (50.0 * (s - 1.0) / 2.0), rel=1e-8)
    assert test.extension.laboratory == approx(100.0 * test.extension.value)


def test_shear_cannot_be_seen_in_a_pull_along_the_yarns():
    """Section 5 of the oracles: G is not observable without narrowing."""
    fabric = sb.Fabric(density=0.2, warp=1000.0, shear=50.0, bending=1e-5)
    assert textile.uniaxial(fabric).extension.gradient["cloth_shear"] == approx(0.0, abs=1e-12)


def test_a_stiffening_fabric_at_500_gram_force_per_cm():
    law = sb.laws.Exponential(200.0, 200.0, 5.0)
    fabric = sb.Fabric(density=0.2, warp=1000.0, shear=50.0, bending=1e-5, law=law)
    test = textile.uniaxial(fabric)
    load = 490.3325

    def pull(s):
        e = (s * s - 1.0) / 2.0
        return s * 1000.0 * e * math.exp(200.0 * e * e)

    s = brentq(lambda s: pull(s) - load, 1.0, 1.5, xtol=1e-15)
    assert test.extension.value == approx(s - 1.0, rel=1e-8)
    assert test.linearity.value < 0.8
    assert test.extension.gradient["cloth_warp_stiffening"] < 0.0


@pytest.mark.parametrize("number", ["extension", "energy", "linearity"])
@pytest.mark.parametrize("field", FIELDS)
def test_gradient_of_tension(number, field):
    check(lambda f: textile.uniaxial(f, cells=3), number, field)


# --- KES shear


def test_shear_of_yarns_that_hardly_stretch():
    """O-26c: F/w = G angle, and the tension's own part tension * tan(angle)."""
    fabric = sb.Fabric(density=0.2, warp=2e6, shear=56.19, bending=1e-5)
    tension = 1e3 * textile.GRAM_FORCE
    test = textile.shear(fabric)
    assert test.stiffness.value - tension == approx(56.19, rel=5e-3)
    assert test.stiffness.laboratory == approx(test.stiffness.value / 56.19, rel=1e-4)
    assert test.stiffness.gradient["cloth_shear"] == approx(1.0, abs=5e-3)


def test_free_sides_bear_less_where_yarns_stretch():
    soft = textile.shear(sb.Fabric(density=0.2, warp=500.0, shear=50.0, bending=1e-5))
    stiff = textile.shear(sb.Fabric(density=0.2, warp=5000.0, shear=50.0, bending=1e-5))
    assert soft.stiffness.gradient["cloth_shear"] < stiff.stiffness.gradient["cloth_shear"] < 1.0


@pytest.mark.parametrize("field", FIELDS)
def test_gradient_of_shear(field):
    check(lambda f: textile.shear(f, cells=3), "stiffness", field)


# --- picture frame


def test_picture_frame():
    """O-26a and c: in Green strain the shear force per length is G sin(angle), whatever the yarns."""
    angle = math.degrees(math.asin(0.1))
    test = textile.picture_frame(APPAREL, angle=angle)
    assert test.shear_force.value == approx(5.0, abs=1e-10)
    assert test.shear_force.gradient["cloth_shear"] == approx(0.1, abs=1e-12)
    assert test.shear_force.gradient["cloth_warp"] == approx(0.0, abs=1e-12)
    assert test.stiffness.value == approx(50.0, rel=2e-3)
    # the corner's force is to the shear force as 2 cos of half of the bars' angle is to 1
    half = math.pi / 4.0 - math.radians(angle) / 2.0
    assert test.force.value == approx(5.0 * 0.2 * 2.0 * math.cos(half), rel=1e-10)


@pytest.mark.parametrize("number", ["force", "stiffness"])
@pytest.mark.parametrize("field", FIELDS)
def test_gradient_of_the_picture_frame(number, field):
    check(lambda f: textile.picture_frame(f, cells=3), number, field)


# --- bias extension


def test_yarns_that_hardly_stretch_turn_like_a_trellis():
    """O-26b."""
    fabric = sb.Fabric(density=0.2, warp=5e4, shear=50.0, bending=1e-5)
    test = textile.bias_extension(fabric, extension=0.02, length=0.4, width=0.2)
    assert math.degrees(test.kinematic_angle) == approx(12.12235, abs=1e-5)
    assert test.angle.laboratory == approx(12.12235, abs=0.5)
    assert test.stiffness.value == approx(50.0, rel=0.05)


def test_yarns_of_a_long_specimen_share_the_extension_unevenly():
    fabric = sb.Fabric(density=0.2, warp=5e5, shear=50.0, bending=1e-5)
    test = textile.bias_extension(fabric, extension=0.02, length=0.3, width=0.1)
    assert test.angle.value == approx(5.0 / 6.0 * test.kinematic_angle, rel=0.02)
    assert test.stiffness.value == approx(50.0, rel=0.03)  # the work is hardly more


def test_softer_yarns_shear_less():
    angles = [
        textile.bias_extension(sb.Fabric(density=0.2, warp=y, shear=50.0, bending=1e-5), cells=4).angle.value
        for y in (500.0, 2e3, 2e4)
    ]
    assert angles == sorted(angles)


@pytest.mark.parametrize("number", ["force", "angle", "stiffness"])
@pytest.mark.parametrize("field", FIELDS)
def test_gradient_of_bias_extension(number, field):
    check(lambda f: textile.bias_extension(f, cells=4), number, field)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: textile.bias_extension(APPAREL, length=0.15), "length"),
        (lambda: textile.bias_extension(APPAREL, extension=0.1), "extension"),
        (lambda: textile.uniaxial(APPAREL, "bias"), "along"),
        (lambda: textile.uniaxial(APPAREL, load=0.0), "uniaxial.load"),
        (lambda: textile.uniaxial(APPAREL, load=-1.0), "uniaxial.load"),
        (lambda: textile.uniaxial(APPAREL, width=float("nan")), "uniaxial.width"),
        (lambda: textile.shear(APPAREL, tension=0.0), "shear.tension"),
        (lambda: textile.cantilever(APPAREL, angle=0.0), "cantilever.angle"),
        (lambda: textile.picture_frame(APPAREL, angle=0.0), "picture_frame.angle"),
        (lambda: sb.Fabric(density=-0.2, warp=600.0, shear=40.0, bending=3e-5), "fabric.density"),
        (lambda: sb.Fabric(density=0.2, warp="600", shear=40.0, bending=3e-5), "fabric.warp"),
        (lambda: sb.Fabric(density=0.2, warp=600.0, shear=40.0, bending=3e-5, bending_weft=0.0), "fabric.bending_weft"),
    ],
)
def test_what_cannot_be_tested_is_refused(call, field):
    with refusal(field, error=sb.InputError):
        call()
