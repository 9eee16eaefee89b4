"""The cantilever test: what it reads is the fabric's rigidity, and its derivatives are those of the overhang."""

import math

import pytest
import sheetbend as sb
from oracles import bending
from pytest import approx
from sheetbend import textile
from support import by_fabric

# nearly without stretch, so that the elastica is right
STIFF = sb.Fabric(density=0.2, warp=2e4, weft=2e4, shear=1e4, bending=2e-5)
WEIGHT = 0.2 * 9.81


def test_the_elastica_falls_to_the_inclined_plane_at_its_overhang():
    """O-18."""
    assert math.degrees(bending.heavy_elastica(8.004197).chord_angle) == approx(41.5, abs=1e-4)
    test = textile.cantilever(STIFF)
    gamma = WEIGHT * test.overhang.value**3 / STIFF.bending
    assert math.degrees(bending.heavy_elastica(gamma).chord_angle) == approx(41.5, abs=0.1)
    assert gamma == approx(8.004197, rel=5e-3)


def test_the_error_falls_with_the_square_of_the_cell():
    exact = (8.004197 * STIFF.bending / WEIGHT) ** (1 / 3)
    coarse, fine = (textile.cantilever(STIFF, cells=n).overhang.value / exact - 1.0 for n in (8, 16))
    assert coarse / fine == approx(4.0, rel=0.15)


@pytest.mark.slow
def test_the_rule_of_peirce_is_right_to_a_two_thousandth():
    fine, finer = (textile.cantilever(STIFF, cells=n).rigidity.value / STIFF.bending for n in (12, 24))
    assert finer + (finer - fine) / 3.0 == approx(8.004197 / 8.0, abs=5e-4)


@pytest.mark.parametrize("along", ["warp", "weft"])
def test_a_strip_has_the_rigidity_of_its_direction(along):
    fabric = sb.Fabric(density=0.2, warp=2e3, shear=100.0, bending=2e-5, bending_weft=8e-6, bending_twist=5e-6)
    expected = 2e-5 if along == "warp" else 8e-6
    test = textile.cantilever(fabric, along)
    assert test.rigidity.value == approx(expected, rel=6e-3)
    assert test.rigidity.laboratory == approx(1e6 * test.rigidity.value)
    own, other = ("cloth_bending", "cloth_bending_weft")[:: 1 if along == "warp" else -1]
    # dl/dB = l/(3 B)
    assert test.overhang.gradient[own] == approx(test.overhang.value / (3.0 * expected), rel=5e-3)
    assert abs(test.overhang.gradient[other] * 1e-5) < 1e-3 * test.overhang.value


def test_fast_2_rule():
    """O-18b: rigidity in uN m is weight in g/m^2 times c^3 in mm times 9.81e-6."""
    c, weight = 15e-3, 0.168
    assert approx(5.562, abs=5e-4) == 168 * 15**3 * 9.81e-6
    fabric = sb.Fabric(density=weight, warp=2e4, shear=1e4, bending=weight * 9.81 * c**3)
    test = textile.cantilever(fabric)
    assert test.bending_length.laboratory == approx(15.0, rel=2e-3)
    assert test.rigidity.laboratory == approx(5.562, rel=6e-3)


@pytest.mark.parametrize("number", ["overhang", "bending_length", "rigidity"])
@pytest.mark.parametrize("field", ["density", "warp", "shear", "poisson", "bending", "bending_weft"])
def test_gradient(number, field):
    fabric = sb.Fabric(density=0.2, warp=300.0, weft=200.0, shear=40.0, poisson=0.2, bending=2e-5, bending_weft=1e-5)
    test = getattr(textile.cantilever(fabric, cells=6), number)
    difference = by_fabric(lambda f: getattr(textile.cantilever(f, cells=6), number).value, fabric, field)
    # of a number that hardly depends on a field the difference is rounding
    noise = 1e-7 * abs(test.value / getattr(fabric, field))
    assert test.gradient[f"cloth_{field}"] == approx(difference, rel=1e-6, abs=noise)
    assert test.gradient[f"cloth_{field}"] != 0.0


@pytest.mark.parametrize("c", [1.3e-3, 2.7e-3, 9e-3, 70e-3])
def test_limp_and_stiff_fabrics(c):
    """2.7 mm was refused: the number of cells across, and with it that of the inputs, changed with the length."""
    fabric = sb.Fabric(density=0.08, warp=300.0, shear=20.0, bending=0.08 * 9.81 * c**3)
    test = textile.cantilever(fabric, cells=12)
    assert test.bending_length.laboratory == approx(1e3 * c, rel=6e-3)
    assert test.overhang.gradient["cloth_bending"] == approx(test.overhang.value / (3.0 * fabric.bending), rel=5e-3)
