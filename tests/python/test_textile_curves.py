"""Measured loops: cycles, pretension, means, KES numbers in closed form, and the way to a fabric."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.special import stdtrit
from sheetbend import textile
from sheetbend.textile import Curve, Measured, Reading

GF = textile.GRAM_FORCE
POINTS = 201


def path(*stops: float) -> np.ndarray:
    """From one stop to the next, each turning point once."""
    parts = [np.linspace(a, b, POINTS)[1:] for a, b in pairwise(stops)]
    return np.concatenate([[stops[0]], *parts])


def tensile(end: float = 0.04, peak: float = 490.0, residue: float = 0.01, name: str = "loop") -> Curve:
    """F = peak (e/end)^2 out, peak ((e - residue)/(end - residue))^2 back."""
    out, back = path(0.0, end), path(end, residue)
    load = np.concatenate([peak * (out / end) ** 2, peak * ((back - residue) / (end - residue))[1:] ** 2])
    return Curve(name, "tension", np.concatenate([out, back[1:]]), load)


def parallelogram(test: str, slope: float, half: float, end: float) -> Curve:
    """Load = slope * deformation +- half, out and back on both sides, as KES instruments go."""
    x = path(0.0, end, -end, 0.0)
    sign = np.repeat([1.0, -1.0, 1.0], POINTS - 1)
    load = slope * x + half * np.concatenate([[1.0], sign])
    corners = [POINTS - 1, 2 * (POINTS - 1)]  # the load jumps where it turns
    x, load = (
        np.insert(x, [c + 1 for c in corners], x[corners]),
        np.insert(load, [c + 1 for c in corners], slope * x[corners] - half * np.sign(x[corners])),
    )
    return Curve("loop", test, x, load)


def noisy(curve: Curve, share: float, seed: int = 2) -> Curve:
    rng = np.random.default_rng(seed)
    noise = share * np.ptp(curve.load) * rng.standard_normal(len(curve.load))
    jitter = 0.1 * share * np.ptp(curve.deformation) * rng.standard_normal(len(curve.load))
    return replace(curve, load=curve.load + noise, deformation=curve.deformation + jitter)


def test_tensile_numbers():
    loop = textile.tensile_loop(tensile())
    assert loop.extension.laboratory == approx(4.0)
    assert loop.energy.value == approx(490.0 * 0.04 / 3.0, rel=1e-4)
    assert loop.energy.laboratory == approx(490.0 * 0.04 / 3.0 / (100 * GF), rel=1e-4)
    assert loop.linearity.value == approx(2.0 / 3.0, rel=1e-4)
    assert loop.resilience is not None and loop.resilience.laboratory == approx(75.0, rel=1e-4)
    assert textile.tensile_loop(tensile().branches()[0]).resilience is None


@pytest.mark.parametrize("share", [0.0, 0.01])
def test_shear_numbers_of_a_parallelogram(share):
    G, half, end = 60.0, 2.0, math.radians(8)
    loop = textile.shear_loop(noisy(parallelogram("shear", G, half, end), share))
    close = 1e-9 if share == 0 else 0.05
    assert loop.stiffness.value == approx(G, rel=close)
    assert loop.stiffness.laboratory == approx(G * math.pi / 180 / (100 * GF), rel=close)
    assert loop.hysteresis.value == approx(2 * half, rel=close)
    assert loop.hysteresis_far.laboratory == approx(2 * half / (100 * GF), rel=close)
    assert loop.lost == approx(2 * half * end / (G * end**2 / 2 + half * end), rel=close or 1e-9)


def test_bending_numbers_of_a_parallelogram():
    B, half = 8e-6, 3e-4
    loop = textile.bending_loop(parallelogram("bending", B, half, 250.0))
    assert loop.rigidity.value == approx(B)
    assert loop.rigidity.laboratory == approx(B / (GF * 0.01))  # gf cm^2/cm
    assert loop.hysteresis.value == approx(2 * half)
    assert loop.hysteresis.laboratory == approx(2 * half / GF)  # gf cm/cm


def test_one_side_and_no_way_back():
    x = np.linspace(0.0, math.radians(4), POINTS)
    loop = textile.shear_loop(Curve("out", "shear", x, 60.0 * x))
    assert loop.stiffness.value == approx(60.0)
    assert loop.hysteresis is None and loop.hysteresis_far is None and loop.lost is None
    back = parallelogram("shear", 60.0, 2.0, math.radians(4))
    assert textile.shear_loop(back).hysteresis.value == approx(4.0)
    assert textile.shear_loop(back).hysteresis_far is None


def test_cycles_of_a_noisy_test():
    x = path(0.0, 0.04, 0.005, 0.04, 0.008)
    curve = noisy(Curve("cyclic", "tension", x, 5e3 * x), 0.01)
    assert len(curve.branches()) == 4
    first, second = curve.cycles()
    assert first.unloading is not None and second.unloading is not None
    assert second.loading.deformation[0] == approx(0.005, abs=2e-4)
    assert second.loading.deformation[-1] == approx(0.04, abs=2e-4)
    assert first.lost == approx(1 - (0.04**2 - 0.005**2) / 0.04**2, abs=0.02)
    with pytest.raises(sb.InputError, match="not one of the 2"):
        textile.tensile_loop(curve, cycle=2)


def test_pretension():
    curve = replace(tensile(end=0.04, peak=160.0), length=0.2, width=0.05)
    cut = curve.from_pretension(10.0)  # F = 160 (e/0.04)^2 reaches it at e = 0.01
    assert cut.load[0] == approx(10.0) and cut.deformation[0] == 0.0
    assert cut.length == approx(0.2 * 1.01, rel=1e-6)
    assert cut.deformation.max() == approx(1.04 / 1.01 - 1.0, rel=1e-6)
    assert cut.pretension == 10.0
    assert curve.from_pretension(0.0).deformation == approx(curve.deformation)
    for load, message in ((200.0, "never reaches"), (-1.0, "starts above")):
        with pytest.raises(sb.InputError, match=message):
            curve.from_pretension(load)


def test_the_mean_and_its_scatter():
    peaks = np.array([90.0, 100.0, 125.0])
    curves = [tensile(end=end, peak=p * (end / 0.04) ** 2) for end, p in zip((0.04, 0.05, 0.045), peaks, strict=True)]
    mean = textile.mean_curve(curves, points=21)
    assert mean.deformation[[0, -1]] == approx([0.0, 0.04])
    assert mean.load == approx(peaks.mean() * (mean.deformation / 0.04) ** 2, abs=1e-2)
    assert mean.scatter == approx(peaks.std(ddof=1) * (mean.deformation / 0.04) ** 2, abs=1e-2)
    assert mean.count == 3
    assert np.isnan(textile.mean_curve(curves[:1]).scatter).all()


def test_the_skeleton_lies_between():
    loop = tensile()
    (cycle,) = loop.cycles()
    skeleton = cycle.way("skeleton")
    assert skeleton.load_at(0.03) == approx(490 * ((0.03 / 0.04) ** 2 + (0.02 / 0.03) ** 2) / 2, rel=1e-3)
    assert skeleton.load_at(0.005) == approx(490 * (0.005 / 0.04) ** 2 / 2, rel=1e-2)  # slack on the way back
    with pytest.raises(sb.InputError, match="no unloading"):
        replace(cycle, unloading=None).way("skeleton")
    half = loop.piece(0, POINTS + POINTS // 4)
    with pytest.raises(sb.InputError, match="not unloaded to the end"):
        half.cycles()[0].way("skeleton")


def recorded(fabric: sb.Fabric, along: str, name: str = "strip", share: float = 1.0) -> Curve:
    """What a machine would write of a strip of the fabric, stretched by `share` more."""
    loads = np.linspace(2.0, 100.0, 60)
    pulls = [textile.uniaxial(fabric, along, load=load, width=0.05, gauge=0.2) for load in loads]
    strain = np.array([0.0, *(share * p.extension.value for p in pulls)])
    return Curve(name, "tension", strain, np.array([0.0, *loads]), length=0.2, width=0.05)


FUNG = sb.laws.Exponential(300.0, 40.0, 1.0)
FABRIC = sb.Fabric(density=0.1, warp=1200.0, weft=500.0, shear=50.0, bending=1e-5, law=FUNG)


@pytest.mark.parametrize("along", ["warp", "weft"])
def test_a_fabric_from_its_pulls(along):
    found = textile.fit_pull([recorded(FABRIC, along)], along)
    truth = {n: v for n, v, _ in FABRIC.law.coefficients()} | {along: getattr(FABRIC, along)}
    for estimate in found.estimates:
        assert estimate.value == approx(truth[estimate.name], rel=2e-3)
        assert estimate.lower < truth[estimate.name] < estimate.upper
    assert found.misfit < 0.1
    assert "no unloading" in str(found)


def test_grips_that_slip_are_seen_by_no_curve():
    """In proportion to the stretch: warp came out 17 % low, "known to 3 %". The report says what it takes as exact."""
    found = textile.fit_pull([recorded(FABRIC, "warp", share=1.2)], "warp")
    assert found.misfit < 1.0 and found.fabric.warp / FABRIC.warp < 0.9
    assert "no curve shows it" in " ".join(str(found).split())


def test_a_law_that_stiffens_fast_reaches_its_load():
    """60 N/m on 148 N/m: half of the linear strain would be a tension of e^67."""
    stiff = replace(FABRIC, warp=148.0, law=sb.laws.Exponential(1400.0, 1400.0, 1400.0))
    strain = textile.uniaxial(stiff, load=60.0, width=0.05, gauge=0.2).extension.value
    green = strain + strain**2 / 2
    assert 148.0 * green * math.exp(1400.0 * green**2) * (1 + strain) == approx(60.0, rel=1e-9)


def test_a_spline_from_pulls():
    found = textile.fit_pull([recorded(FABRIC, "warp")], "warp", "spline")
    assert found.fabric.warp == approx(FABRIC.warp, rel=0.03)
    assert max(abs(r.laboratory / m.value - 1) for r, m in zip(found.readings, found.measured, strict=True)) < 0.01


@pytest.mark.slow
def test_poisson_is_what_jaws_hide():
    """A wide specimen reads warp/(1 - poisson^2); told the number, the pull gives the warp."""
    coupled = replace(FABRIC, law=sb.laws.Linear(), poisson=0.4)
    curve = recorded(coupled, "warp")
    alone, told = (textile.fit_pull([curve], "warp", "linear", poisson=nu).fabric.warp for nu in (0.0, 0.4))
    assert told == approx(coupled.warp, rel=0.01)
    assert 1.02 < alone / coupled.warp < 1 / (1 - 0.4**2)


@pytest.mark.slow
def test_the_scatter_of_specimens_is_in_the_interval():
    """Strains of 0.97, 1 and 1.03: whatever the number of loads, three specimens are three."""
    plain = replace(FABRIC, law=sb.laws.Linear())
    curves = [recorded(plain, "warp", f"strip {k}", 1 + 0.03 * k) for k in (-1, 0, 1)]
    (estimate,) = textile.fit_pull(curves, "warp", "linear", error=1e-4).estimates
    reach = float(stdtrit(2, 0.975)) * 0.03 / math.sqrt(3)
    assert math.log(estimate.upper / estimate.lower) / 2 == approx(reach, rel=0.15)
    assert estimate.lower < plain.warp < estimate.upper


def test_specimens_as_wholes_in_closed_form():
    """A number that four readings give directly: the interval is Student's of the specimens' means."""
    offs = np.array([-0.04, 0.01, 0.03, -0.01, 0.01])
    specimens = {f"{k}": 1000 * math.exp(off) for k, off in enumerate(offs)}
    test = lambda fabric: Reading(fabric.warp, "N/m", {"cloth_warp": 1.0}, "N/m", 1.0)  # noqa: E731
    values = np.array(list(specimens.values()))
    for count in (1, 4):
        given = [Measured.of_specimens(specimens, name="E", test=test) for _ in range(count)]
        (estimate,) = textile.fit_fabric(given, FABRIC, ["warp"]).estimates
        reach = float(stdtrit(4, 0.975)) * values.std(ddof=1) / math.sqrt(5) / values.mean()
        assert math.log(estimate.upper / estimate.lower) / 2 == approx(reach, rel=1e-6)


def test_what_the_loop_loses_is_told():
    loop = replace(tensile(end=0.04, peak=60.0), length=0.2, width=0.05)
    for way, words in (("loading", "follows loading"), ("skeleton", "mean of loading and unloading")):
        text = str(textile.fit_pull([loop], way=way))
        assert "lose 25 %" in text and words in " ".join(text.split())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"curves": []}, "is empty"),
        ({"law": "cubic"}, "law: is unknown"),
        ({"along": "bias"}, "along: is unknown"),
        ({"poisson": 1.0}, "poisson: must lie between"),
        ({"way": "up"}, "way: is unknown"),
        ({"cycle": 1}, "cycle: is not one"),
        ({"curves": [tensile(), tensile()]}, "share a name"),
        ({"curves": [Curve("slack", "tension", [0.0, 0.01, 0.02], [0.0, 0.0, 5.0])]}, "bear nothing"),
        ({"curves": [tensile(), replace(tensile(name="b"), width=0.1)]}, "different widths"),
        ({"curves": [parallelogram("shear", 1.0, 0.1, 0.1)]}, "not pulls"),
    ],
)
def test_bad_pulls(change, message):
    with pytest.raises(sb.InputError, match=message):
        textile.fit_pull(**({"curves": [tensile()]} | change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": "tear"}, "test: is unknown"),
        ({"load": np.zeros(3)}, "load: has the wrong shape"),
        ({"deformation": np.full(402 - 1, 0.1)}, "never changes"),
        ({"deformation": np.arange(2.0), "load": np.arange(2.0)}, "too few"),
        ({"load": np.full(402 - 1, np.nan)}, "not finite"),
        ({"load": -tensile().load}, "not positive at the largest strain"),
        ({"deformation": -tensile().deformation}, "not positive at the largest strain"),
    ],
)
def test_bad_curves(change, message):
    with pytest.raises(sb.InputError, match=message):
        replace(tensile(), **change)


def sliding(B: float, share: float, yield_curvature: float, offset: float, *stops: float) -> Curve:
    """The moments of a spring beside one that slides, along a path of curvatures."""
    x, slid, load = path(*stops), 0.0, []
    for kappa in x:
        slid = min(max(slid, kappa - yield_curvature), kappa + yield_curvature)
        load.append(B * (kappa - share * slid) + offset)
    return Curve("loop", "bending", x, np.array(load))


def test_the_yield_of_a_bending_loop():
    B, share, kappa, offset = 2e-5, 0.3, 40.0, 1e-4
    for stops in ((0.0, 250.0, -250.0, 0.0), (0.0, 250.0, 0.0), (0.0, -100.0, 30.0)):
        found = textile.bending_yield(sliding(B, share, kappa, offset, *stops))
        values = [found.bending.value, found.yield_share.value, found.yield_curvature.value, found.offset.value]
        assert values == approx([B, share, kappa, offset], rel=1e-6), stops
        assert found.misfit < 1e-6
    curve = sliding(B, share, kappa, offset, 0.0, 250.0, -250.0, 0.0)
    read = textile.bending_loop(curve)
    assert read.rigidity.value == approx((1.0 - share) * B, rel=1e-3)
    found = textile.bending_yield(
        replace(curve, load=curve.load + 2e-5 * np.random.default_rng(1).standard_normal(601))
    )
    assert [found.bending.value, found.yield_share.value] == approx([B, share], rel=0.03)
    assert found.misfit == approx(2e-5 / (2.0 * share * B * kappa), rel=0.1)
    assert [e.name for e in found.estimates] == ["bending", "yield_share", "yield_curvature"]
    assert all(e.verdict == "identified" and e.half_width < 0.05 * e.value for e in found.estimates)


def sheared(G: float, share: float, at: float, tension: float, *stops: float) -> Curve:
    """The forces of a spring beside one that slides, along a path of shear angles, under a tension that is kept."""
    angle, slid, load = path(*stops), 0.0, []
    for s in np.tan(angle):
        slid = min(max(slid, s - at), s + at)
        load.append(G * (s - share * slid) + tension * s)
    return Curve("loop", "shear", angle, np.array(load))


KES = (0.0, math.radians(8), math.radians(-8), 0.0)


def test_the_yield_of_a_shear_loop():
    G, share, at, tension = 56.0, 0.3, 0.02, 1e3 * GF
    curve = sheared(G, share, at, tension, *KES)
    found = textile.shear_yield(curve)
    values = [found.shear.value, found.yield_shear_share.value, found.yield_shear.value, found.hysteresis.value]
    assert values == approx([G, share, at, 2.0 * share * G * at], rel=1e-6)
    assert found.misfit < 1e-6 and found.shear.laboratory == approx(G * math.radians(0.01 / GF), rel=1e-6)
    read = textile.shear_loop(curve)
    assert read.hysteresis_far is not None
    assert read.hysteresis_far.value == approx(found.hysteresis.value, rel=1e-3)  # at 5 degrees, where both ways slide
    whole = textile.shear_yield(curve, tension=0.0)
    assert whole.shear.value == approx(G + tension, rel=1e-6)
    assert whole.hysteresis.value == approx(found.hysteresis.value, rel=1e-6)
    assert [e.name for e in found.estimates] == ["shear", "yield_shear_share", "yield_shear"]
    with pytest.raises(sb.InputError, match="is not a test of shear"):
        textile.shear_yield(sliding(2e-5, 0.3, 40.0, 0.0, 0.0, 250.0, -250.0))


@pytest.mark.parametrize("together", [0.0, 0.8], ids=["white", "alike"])
def test_intervals_of_a_yield_hold_it(together):
    """Of 20 draws of noise of 6 % of the loop's height, also where neighboring points have nearly the same error."""
    true, held = (56.0, 0.3, 0.02), np.zeros(3)
    curve = sheared(*true, 1e3 * GF, *KES)
    for seed in range(20):
        error = 0.05 * np.random.default_rng(seed).standard_normal(len(curve.load))
        for k in range(1, len(error)):
            error[k] = together * error[k - 1] + math.sqrt(1.0 - together**2) * error[k]
        found = textile.shear_yield(replace(curve, load=curve.load + error))
        held += [e.lower <= value <= e.upper for e, value in zip(found.estimates, true, strict=True)]
    assert (held >= 17).all()


def test_what_shows_no_yield_is_refused():
    curve = sliding(2e-5, 0.3, 40.0, 0.0, 0.0, 250.0, -250.0, 0.0)
    rng = np.random.default_rng(1)
    elastic = replace(curve, load=2e-5 * curve.deformation + 1e-6 * rng.standard_normal(601))
    with pytest.raises(sb.InputError, match="has no loop of a spring that slides"):
        textile.bending_yield(elastic)
    with pytest.raises(sb.InputError, match="never turns back"):
        textile.bending_yield(curve.piece(0, POINTS))
    with pytest.raises(sb.InputError, match="is not a test of bending"):
        textile.bending_yield(tensile())


def test_a_loop_is_not_read_as_another_test():
    for reader in (textile.shear_loop, textile.bending_loop):
        with pytest.raises(sb.InputError, match="is not a test of"):
            reader(tensile())
    with pytest.raises(sb.InputError, match="choose slope="):
        textile.shear_loop(parallelogram("shear", 1.0, 0.1, math.radians(2)))


def test_specimens_need_scatter_or_an_error():
    test = lambda fabric: Reading(1.0, "N", {}, "N", 1.0)  # noqa: E731
    with pytest.raises(sb.InputError, match="tell no scatter"):
        Measured.of_specimens({"1": 2.0}, name="E", test=test)
    assert Measured.of_specimens({"1": 2.0}, name="E", test=test, error=0.1).sigma == 0.1
    both = Measured.of_specimens({"1": 2.0, "2": 2.4}, name="E", test=test, error=0.1)
    assert both.value == approx(2.2) and both.sigma == approx(math.hypot(0.1, 0.2))
