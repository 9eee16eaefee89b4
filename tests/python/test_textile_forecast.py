"""Laws that lock, the choice among laws and weights, and forecasts beyond the strain that was measured."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from sheetbend.textile import Curve
from sheetbend.textile.locking import strains
from sheetbend.textile.strip_laws import LOCKING, STRIP_LAWS, green

KNITS = Path(__file__).resolve().parents[2] / "experiments" / "knit_uniaxial"
STIFFNESS, LIMIT, YARN, SHARPNESS = 40.0, 0.5, 900.0, 1.4  # N/m, strain, N/m
NUMBERS = {"limit": (STIFFNESS, LIMIT), "two_regimes": (STIFFNESS, LIMIT, YARN, SHARPNESS)}
REACH = 0.3


@pytest.fixture(scope="module")
def foresee():
    names = ("knits", "foresee", "yarns", "reduce")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(KNITS))
        modules = [importlib.import_module(name) for name in names]
        for name in names:
            del sys.modules[name]
    return dict(zip(names, modules, strict=True))


def locked(law: str, end: float = REACH, gains: tuple[float, ...] = (0.97, 1.0, 1.03)) -> list[Curve]:
    loads = STIFFNESS * np.r_[0.0, np.geomspace(1e-4, 1e3, 4000)]
    s = strains(law, np.log(NUMBERS[law]), loads)
    grid = np.linspace(0.0, end, 120)
    load = np.interp(grid, s, loads)
    return [Curve(f"strip {k}", "tension", grid, gain * load, length=0.2, width=0.05) for k, gain in enumerate(gains)]


@pytest.mark.parametrize("law", ["linear", "exponential", "sinh"])
def test_a_strip_law_is_the_simulations(law):
    """Where Poisson's ratio is zero a specimen between jaws is an even strip."""
    b = 30.0
    laws = {"linear": sb.laws.Linear(), "exponential": sb.laws.Exponential(b, b, b), "sinh": sb.laws.Sinh(b, b, b)}
    fabric = sb.Fabric(density=0.1, warp=STIFFNESS, shear=20.0, bending=1e-5, law=laws[law])
    strain = textile.uniaxial(fabric, load=9.0, width=0.05, gauge=0.2, cells=2).extension.value
    power = {"linear": 0, "exponential": 2, "sinh": 1}[law]
    x = [np.log(b * green(np.array(REACH)) ** power)] if power else []
    log_load = STRIP_LAWS[law].log_load(np.array([strain]), np.array([np.log(STIFFNESS), *x]), REACH)
    assert np.exp(log_load) == approx(9.0, rel=1e-8)


@pytest.mark.parametrize("law", LOCKING)
def test_load_and_strain_of_a_law_that_locks_are_inverses(law):
    x = {"limit": [np.log(LIMIT / REACH - 1)], "two_regimes": np.log([LIMIT / REACH, YARN / STIFFNESS, SHARPNESS])}
    s = np.linspace(0.02, 0.45, 7)
    loads = np.exp(STRIP_LAWS[law].log_load(s, np.array([np.log(STIFFNESS), *x[law]]), REACH))
    assert strains(law, np.log(NUMBERS[law]), loads) == approx(s, rel=1e-7)


def test_nothing_stretches_beyond_a_limit_strain_and_a_yarn_does():
    s, u = np.array([0.29, 0.5, 0.7]), np.array([0.0, np.log(LIMIT / REACH - 1)])
    assert np.isinf(STRIP_LAWS["limit"].log_load(s, u, REACH)).tolist() == [False, True, True]
    both = STRIP_LAWS["two_regimes"].log_load(s, np.array([0.0, *np.log([LIMIT / REACH, 20.0, 1.4])]), REACH)
    assert np.isfinite(both).all() and (np.diff(both) > 0).all()


def test_a_limit_strain_is_found_and_a_spline_stands_in_for_it():
    curves = locked("limit")
    found = textile.fit_pull(curves, law="limit")
    truth = {"warp": STIFFNESS, "warp_limit": LIMIT}
    for estimate in found.estimates:
        assert estimate.value == approx(truth[estimate.name], rel=0.02)
        assert estimate.lower < truth[estimate.name] < estimate.upper
        assert estimate.verdict == "identified"
    assert "known to fit_pull and forecast_pull alone" in " ".join(str(found).split())
    loads = np.interp([0.1, 0.2, 0.3], curves[1].deformation, curves[1].load)
    assert textile.strains_under(found.fabric, curves, loads) == approx([0.1, 0.2, 0.3], rel=0.03)


def test_a_yarn_that_was_never_stretched_stays_open():
    """Up to 0.3 only the loops are seen: the yarn's stiffness is not known within a factor of two."""
    found = {e.name: e for e in textile.fit_pull(locked("two_regimes", 0.2), law="two_regimes").estimates}
    assert found["warp_yarn"].verdict in ("not identifiable", "weak")
    assert "warp_sharpness" in found


def test_the_law_is_chosen_by_what_the_pull_supports():
    chosen = textile.fit_pull(locked("limit", 0.42), law=["linear", "exponential", "limit"])
    assert [e.name for e in chosen.estimates] == ["warp", "warp_limit"]
    assert "law chosen by what the pulls support" in " ".join(str(chosen).split())
    straight = [replace(c, load=STIFFNESS * c.deformation * 1.02**k) for k, c in enumerate(locked("limit", 0.05))]
    assert [e.name for e in textile.fit_pull(straight, law=["linear", "exponential"]).estimates] == ["warp"]


def test_evidence_grows_little_with_the_number_of_points():
    """Points along one curve are no independent readings."""
    coarse = textile.forecast_pull([c.piece(0, 120) for c in locked("limit")])
    fine = [
        replace(c, deformation=d, load=np.interp(d, c.deformation, c.load))
        for c in locked("limit")
        for d in [np.linspace(0.0, REACH, 2000)]
    ]
    assert list(textile.forecast_pull(fine).shares.values()) == approx(list(coarse.shares.values()), abs=0.02)


def test_weights_loosen_small_loads():
    curves = locked("limit")
    even, loose = (textile.fit_pull(curves, law="linear", weights=w) for w in (0.0, 2.0))
    loads = [float(m.name.split()[2]) for m in even.measured]
    ratio = [b.sigma / a.sigma for a, b in zip(even.measured, loose.measured, strict=True)]
    assert ratio == approx((loads[-1] / np.array(loads)) ** 2, rel=1e-2)
    assert abs(loose.readings[-1].laboratory - 30.0) < 0.6 * abs(even.readings[-1].laboratory - 30.0)


def test_weights_are_chosen_within_the_range():
    """A linear law that must foresee a curve that stiffens does best when it looks at the largest loads alone."""
    found = textile.fit_pull(locked("limit"), law="linear", weights="chosen")
    assert "weights chosen: power 3" in " ".join(str(found).split())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"law": ["exponential", "spline"]}, "law: is a spline"),
        ({"law": []}, "law: is unknown"),
        ({"law": ["cubic", "sinh"]}, "law: is unknown"),
        ({"weights": -1.0}, "weights: must be a power"),
        ({"weights": "heavy"}, "weights: must be a power"),
        ({"weights": "chosen", "law": "spline"}, "law: is a spline"),
        ({"law": "limit", "poisson": 0.3}, "poisson: is of the simulation"),
    ],
)
def test_bad_options(change, message):
    with pytest.raises(sb.InputError, match=message):
        textile.fit_pull(locked("limit"), **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"laws": ["spline"]}, "laws: name no law of a strip"),
        ({"laws": []}, "laws: is empty"),
        ({"strain": [0.0, 0.1]}, "strain: must be positive"),
        ({"strain": [np.nan]}, "strain"),
        ({"up_to": 0.5}, "up_to: is not a strain"),
        ({"curves": [Curve("slack", "tension", [0.0, 0.01, 0.02], [0.0, 0.0, 5.0])]}, "bear nothing"),
        ({"curves": []}, "is empty"),
    ],
)
def test_bad_forecasts(change, message):
    with pytest.raises(sb.InputError, match=message):
        textile.forecast_pull(**({"curves": locked("limit")} | change))


def test_a_forecast_says_what_it_rests_on_and_keeps_its_bits():
    curves = locked("two_regimes")
    one, other = (textile.forecast_pull(curves, [0.7, 0.31, 0.4]) for _ in range(2))
    assert (one.load == other.load).all() and (one.upper == other.upper).all()
    assert one.half_width[1] < one.half_width[2] < one.half_width[0]
    text = " ".join(str(one).split())
    assert "no interval was ever checked" in text and "specimens differ by" in text and "not simulated" in text
    assert "ever checked" not in str(textile.forecast_pull(curves))
    assert sum(one.shares.values()) == approx(1.0)


def test_one_specimen_has_a_forecast_too():
    """What it says of other specimens is then the prior's word."""
    (alone,) = locked("limit", gains=(1.0,))
    found = textile.forecast_pull([alone], [0.31])
    assert found.scatter == approx(0.07)
    assert found.lower[0] < found.load[0] < found.upper[0]


def test_a_wavy_yarn_starts_as_a_bent_beam_and_ends_at_its_length(foresee):
    """Stiffness at rest by Castigliano's theorem, limit strain by the length over its span."""
    bend, cells = 0.9, 4000
    (tiny, huge) = foresee["yarns"].loop_strains(np.array([bend]), np.array([1e9]), np.array([1.0]), [1e-5, 4e4])[:, 0]
    theta = bend * np.cos(np.pi * (np.arange(cells) + 0.5) / (2 * cells))
    height = np.cumsum(np.sin(theta)) / cells  # lever arm of the force about each section
    span = np.cos(theta).mean()
    assert tiny / 1e-5 == approx((height**2).mean() / span, rel=0.01)
    assert huge == approx(1.0 / span - 1.0, rel=0.02)


def test_unseen_forces_lie_inside(foresee):
    """A sample of the README's 200 yarns and all pulls of the four knits, from 60 % of the strain to its end."""
    study = foresee["foresee"]
    inside, width = study.counted(study.synthetic(12))["all"]
    assert inside >= 0.88 and width <= 40
    recorded = study.recorded()
    assert len(recorded) == 8
    inside, width = study.counted(recorded)["all"]
    assert inside >= 0.9 and width <= 40
    assert np.mean([one.error for one in recorded.values()]) < 13.5


def test_a_folder_of_the_source_reads_like_the_reduced_one(foresee, tmp_path):
    """As the source has them: frames of each repeat, and pins in px."""
    knits, reduce = foresee["knits"], foresee["reduce"]
    path = knits.DATA / "garter_x.npz"
    force, pins = reduce.reduced(path)
    frames = {f"force_{k + 1}": np.repeat(f, 4) for k, f in enumerate(force)}
    frames |= {f"pins_px_{k + 1}": np.repeat(p, 4, axis=0) * 100.0 for k, p in enumerate(pins)}
    np.savez(
        tmp_path / "garter_x.npz", **{k: v[~np.isnan(v).reshape(len(v), -1).any(axis=1)] for k, v in frames.items()}
    )
    (tmp_path / "garter_x.json").write_text('{"clamp_px": 100.0, "fabric_width_px": 99.0}', encoding="utf-8")
    raw, shipped = knits.read("garter", "x", folder=tmp_path), knits.read("garter", "x")
    assert raw.fitted == approx(shipped.fitted, rel=0.02)
    assert raw.repeats[0].force_at(0.2) == approx(shipped.repeats[0].force_at(0.2), rel=0.02)
