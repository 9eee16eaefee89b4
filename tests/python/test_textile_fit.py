"""Fabrics from laboratory readings: intervals in closed form, what readings do not tell, laws, and bad input."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from sheetbend.textile import Measured, Reading

FABRIC = sb.Fabric(density=0.2, warp=2000.0, weft=1500.0, shear=50.0, bending=2e-5)
START = replace(FABRIC, warp=900.0, weft=4000.0, shear=150.0, bending=6e-6)


def pulled(along: str, load: float = 20.0) -> Callable[[sb.Fabric], Reading]:
    return lambda fabric: textile.uniaxial(fabric, along, load=load).extension


def overhang(fabric: sb.Fabric) -> Reading:
    return textile.cantilever(fabric, cells=8).bending_length


def measured(
    test: Callable[[sb.Fabric], Reading], share: float = 0.01, fabric: sb.Fabric = FABRIC, off: float = 0.0
) -> Measured:
    """What the test of `fabric` reads, `off` sigmas too much."""
    value = test(fabric).laboratory
    return Measured(name="reading", test=test, value=value * (1.0 + off * share), sigma=value * share)


def test_rigidity_from_a_bending_length():
    """B is proportional to the cube of the bending length, so three times its error in ln B."""
    start = replace(FABRIC, bending=6e-6)
    found = textile.fit_fabric([measured(overhang, 0.02)], start, ["bending"])
    assert found.fabric.bending == approx(FABRIC.bending, rel=1e-6)
    assert replace(found.fabric, bending=FABRIC.bending) == FABRIC
    (estimate,) = found.estimates
    assert (estimate.name, estimate.verdict, estimate.unit) == ("bending", "identified", "N m")
    reach = 1.959964 * 3 * 0.02
    assert estimate.lower == approx(FABRIC.bending * math.exp(-reach), rel=1e-3)
    assert estimate.upper == approx(FABRIC.bending * math.exp(reach), rel=1e-3)
    assert found.misfit == approx(0.0, abs=1e-9) and found.freedom == 0


def product(**powers: float) -> Callable[[sb.Fabric], Reading]:
    """A test in closed form: a product of powers of the fabric's numbers."""

    def test(fabric: sb.Fabric) -> Reading:
        value = math.prod(getattr(fabric, name) ** power for name, power in powers.items())
        gradient = {f"cloth_{name}": power * value / getattr(fabric, name) for name, power in powers.items()}
        return Reading(value, "N", gradient, "gf", 100.0)

    return test


@pytest.mark.slow
def test_intervals_hold_the_truth_for_nineteen_of_twenty_laboratories():
    tests = [product(warp=1.0), product(warp=0.5, weft=0.5), product(weft=-1.0, shear=0.3), product(shear=2.0)]
    noise = np.random.default_rng(3).standard_normal((400, len(tests)))
    outside = 0
    for offs in noise:
        given = [measured(test, 0.05, off=off) for test, off in zip(tests, offs, strict=True)]
        found = textile.fit_fabric(given, START, ["warp", "weft", "shear"])
        outside += sum(not e.lower <= getattr(FABRIC, e.name) <= e.upper for e in found.estimates)
    assert 20 <= outside <= 75  # of 1200: 60 where no misfit widens them, fewer by what it does


def test_a_misfit_widens_what_rests_on_its_test_alone():
    """A pull of one strip that no law fits made a weight that was known to 2 % uncertain by a factor of 4.7."""
    off = [6.0, -8.0, 5.0, -4.0]
    strip = [replace(measured(product(warp=1.0), off=k), specimens={"strip": 1.0}) for k in off]
    weights = {"a": 19.9, "b": 20.0, "c": 20.1}  # in hundredths, as `product` reads
    weighed = Measured.of_specimens(weights, name="weight", test=product(density=1.0), error=0.4)
    found = textile.fit_fabric([*strip, weighed], START, ["warp", "density"])
    warp, density = (math.log(e.upper / e.lower) / 2 for e in found.estimates)
    assert density == approx(1.96 * 0.02, rel=0.05)
    residuals = np.array(off) - np.mean(off)
    scatter = math.sqrt(float(residuals @ residuals) / 3)
    assert warp == approx(1.96 * 0.01 * scatter / 2, rel=0.05)
    assert "widened by the misfit of the tests" in " ".join(str(found).split())


def test_scatter_of_few_specimens_counts_by_its_share():
    """The scatter of two strips is Student's t of one degree of freedom, unless most of the error is the machine's."""
    few = {"1": 99.0, "2": 101.0}
    test = lambda fabric: Reading(fabric.shear, "N/m", {"cloth_shear": 1.0}, "N/m", 1.0)  # noqa: E731
    for error, quantile in ((1e-6, 12.706), (20.0, 1.96)):
        given = [Measured.of_specimens(few, name="shear", test=test, error=error)]
        (estimate,) = textile.fit_fabric(given, START, ["shear"]).estimates
        reach = math.log(estimate.upper / estimate.lower) / 2
        assert reach == approx(quantile * given[0].sigma / 100.0, rel=5e-3)


def test_a_value_below_its_uncertainty_keeps_digits():
    """The table said 0.0000 N m, in 0.0000 to 0.0053."""
    found = textile.fit_fabric([measured(product(shear=1.0), 2.0)], START, ["shear"])
    ((name, value, interval, _),) = found.sections()[0].rows
    assert name == "shear" and float(value.split()[0]) == approx(found.fabric.shear, rel=0.05)
    low, high = map(float, interval.split(" to "))
    assert 0.0 < low < found.fabric.shear / 20 and high > 20 * found.fabric.shear


@pytest.mark.slow
def test_a_pull_along_the_yarns_does_not_contain_shear():
    found = textile.fit_fabric([measured(pulled("warp"))], START, ["warp", "shear"])
    warp, shear = found.estimates
    assert warp.verdict == "identified" and warp.value == approx(FABRIC.warp, rel=1e-6)
    assert shear.verdict == "not identifiable" and shear.lower is None
    assert "moves no reading" in shear.words and shear.words in str(found)
    assert found.freedom == 0


def test_numbers_that_share_one_reading_are_told_together():
    found = textile.fit_fabric([measured(product(shear=1.0, warp=0.5))], START, ["shear", "warp"])
    assert [e.verdict for e in found.estimates] == ["not identifiable"] * 2
    assert all("shear" in e.words and "warp" in e.words for e in found.estimates)


@pytest.mark.slow
def test_readings_that_contradict_widen_the_intervals():
    twice = [measured(pulled("warp"), off=off) for off in (-5.0, 5.0)]
    found = textile.fit_fabric(twice, START, ["warp"])
    alike = textile.fit_fabric([measured(pulled("warp")) for _ in range(2)], START, ["warp"])
    assert found.misfit == approx(50.0, rel=0.02) and found.freedom == 1
    wide, narrow = (math.log(f.estimates[0].upper / f.estimates[0].lower) for f in (found, alike))
    assert wide / narrow == approx(math.sqrt(found.misfit), rel=0.02)
    assert "widened" in str(found) and "widened" not in str(alike)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "name", "other"),
    [
        (sb.laws.Exponential(200.0, 100.0, 5.0), "warp_stiffening", sb.laws.Exponential(50.0, 100.0, 5.0)),
        (
            sb.laws.Spline((0.02, 0.02, 0.1), warp=(2.0, 3.0, 4.0, 5.0)),
            "warp_ratio_2",
            sb.laws.Spline((0.02, 0.02, 0.1), warp=(2.0, 1.0, 4.0, 5.0)),
        ),
    ],
)
def test_the_coefficients_of_a_law(law, name, other):
    stiffening = replace(FABRIC, law=law)
    loads = [20.0, 80.0, 200.0]
    given = [measured(pulled("warp", load), fabric=stiffening) for load in loads]
    found = textile.fit_fabric(given, replace(stiffening, warp=1500.0, law=other), ["warp", name])
    assert found.fabric.warp == approx(FABRIC.warp, rel=1e-5)
    values = {n: v for n, v, _ in found.fabric.law.coefficients()}
    wanted = {n: v for n, v, _ in law.coefficients()}
    assert values == approx(wanted, rel=1e-4)


def test_what_is_left_out_follows():
    """Weft follows warp, as in `Fabric`."""
    isotropic = replace(FABRIC, weft=None)
    found = textile.fit_fabric([measured(pulled("weft"), fabric=isotropic)], replace(isotropic, warp=500.0), ["warp"])
    assert found.fabric.weft is None
    assert found.fabric.warp == approx(FABRIC.warp, rel=1e-6)


def test_the_report():
    text = str(textile.fit_fabric([measured(pulled("warp"))], START, ["warp"]))
    assert "2000 N/m" in text and "95 % interval" in text and "known to 2 %" in text
    assert "+0.0" in text and "misfit" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"measured": []}, "measured"),
        ({"free": []}, "free"),
        ({"free": ["width"]}, "use names of: density, warp"),
        ({"free": ["warp_stiffening"]}, "use names of"),
        ({"free": ["bending_weft"]}, "give the start a value"),
    ],
)
def test_bad_input(change, message):
    given = {"measured": [measured(pulled("warp"))], "start": START, "free": ["warp"]} | change
    with pytest.raises(sb.InputError, match=message):
        textile.fit_fabric(**given)


@pytest.mark.parametrize(("field", "value"), [("value", math.nan), ("sigma", 0.0), ("sigma", math.inf)])
def test_bad_readings(field, value):
    with pytest.raises(sb.InputError, match=f"E20.{field}"):
        Measured(**({"name": "E20", "test": pulled("warp"), "value": 1.0, "sigma": 0.1} | {field: value}))
