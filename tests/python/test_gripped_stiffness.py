"""The two stiffnesses of a rope that slides inside, and what the mass of its markers does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion, fit_rope
from sheetbend.gripped.judging import predict
from sheetbend.gripped.report import counted
from sheetbend.gripped.stiffness import softest_place, stiffness_section, tangent_stiffness
from sheetbend.report.fit_result import FitResult
from sheetbend.result.estimate import Correlation, Estimate
from test_cli_gripped import result_of
from test_gripped_motion import carried_about, model_of


def estimate(name: str, value: float, half: float | None) -> Estimate:
    ends = (None, None) if half is None else (value - half, value + half)
    return Estimate(
        name=f"rope_{name}",
        value=value,
        unit="N m^2" if name == "EI" else "",
        lower=ends[0],
        upper=ends[1],
        half_width=half,
        statistical=half,
        discretization=0.0,
        verdict="identified",
        words="",
    )


def result(correlation: float, half: float | None = 0.02) -> FitResult:
    pairs = (Correlation(first="rope_yield_share", second="rope_EI", value=correlation),)
    estimates = (estimate("EI", 0.2, half), estimate("yield_share", 0.6, 0.04))
    return replace(result_of(), estimates=estimates, correlations=pairs)


class TestTangent:
    def test_it_is_what_does_not_slide(self) -> None:
        value, lower, upper = tangent_stiffness(result(0.0))
        reach = math.hypot(math.log(1.1), 0.04 / 0.4)
        assert (value, lower, upper) == pytest.approx((0.08, 0.08 * math.exp(-reach), 0.08 * math.exp(reach)))

    def test_it_is_known_better_than_either_where_they_trade(self) -> None:
        _, apart, _ = tangent_stiffness(result(0.0))
        _, together, _ = tangent_stiffness(result(0.95))
        assert 0.08 - together < 0.35 * (0.08 - apart)

    def test_an_open_end_stays_open(self) -> None:
        assert tangent_stiffness(result(0.0, None)) == (pytest.approx(0.08), None, None)

    def test_the_report_names_both(self) -> None:
        section = stiffness_section(result(0.0))
        assert section is not None
        assert [row[0] for row in section.rows] == ["EI at small strain", "EI where the rope slides inside"]
        assert section.rows[0][1:] == ("0.2", "0.18", "0.22", "N m^2")

    def test_what_had_slid_before_is_no_part_of_the_intervals(self) -> None:
        elastic = replace(result(0.0), estimates=(estimate("EI", 0.2, 0.02),))
        for found, told in ((result(0.0), True), (elastic, False)):
            (_, _), (label, words) = counted(found)
            assert label == "not counted" and ("what had slid inside before" in words) == told

    def test_an_elastic_rope_has_one(self) -> None:
        elastic = replace(result(0.0), estimates=(estimate("EI", 0.2, 0.02),))
        assert tangent_stiffness(elastic) is None and stiffness_section(elastic) is None


class TestSoftestPlace:
    """A soft place at 0.4 of the length, EI exp(-0.8) there, as six modes show it."""

    MODES = np.arange(1, 7)
    SOFTNESS = 0.9 * np.cos(np.pi * MODES * 0.4) * np.exp(-((MODES / 5.0) ** 2))

    def kinked(self, half: float | None = 0.05, size: float = 1.0) -> FitResult:
        modes = [estimate(f"softness_{k}", size * x, half) for k, x in zip(self.MODES, self.SOFTNESS, strict=True)]
        return replace(result_of(), estimates=(estimate("EI", 0.2, 0.02), *modes), correlations=())

    def test_it_is_where_the_modes_add_up(self) -> None:
        found = softest_place(self.kinked())
        assert found is not None
        place, (value, lower, upper) = found
        assert place == pytest.approx(0.4, abs=0.03)
        waves = np.cos(np.pi * self.MODES * place)
        assert value == pytest.approx(0.2 * math.exp(-waves @ self.SOFTNESS))
        reach = math.hypot(math.log(1.1), 0.05 * float(np.linalg.norm(waves)))
        assert (lower, upper) == pytest.approx((value * math.exp(-reach), value * math.exp(reach)))

    def test_correlations_of_its_modes_count(self) -> None:
        pair = Correlation(first="rope_softness_1", second="rope_EI", value=0.9)
        apart, together = softest_place(self.kinked()), softest_place(replace(self.kinked(), correlations=(pair,)))
        assert apart is not None and together is not None and apart[1][1] is not None and together[1][1] is not None
        assert together[1][1] > apart[1][1]  # where ln EI less the first mode is known better than either

    def test_the_report_says_where(self) -> None:
        section = stiffness_section(self.kinked())
        assert section is not None and [row[0] for row in section.rows] == [
            "EI of the whole rope",
            "EI at 0.40 of its length",
        ]
        assert "of the free length from its start" in section.notes[0][1] and "kink" in section.notes[0][1]

    @pytest.mark.parametrize(("half", "size"), [(1.0, 1.0), (None, 1.0), (0.05, 0.01)])
    def test_one_that_is_not_known_is_not_named(self, half: float | None, size: float) -> None:
        assert softest_place(self.kinked(half, size)) is None and stiffness_section(self.kinked(half, size)) is None


class TestMarkerMass:
    def test_heavy_markers_are_a_heavier_rope(self) -> None:
        """Lumps of a tenth of the rope move it as the same mass spread over it does."""
        motion = GrippedMotion.of(carried_about(), 0.08)
        model = model_of(motion)
        lump = 0.1 * model.density * motion.length / (len(motion.free) + 1)
        bare, lumps, spread = (
            predict(m, [motion], {})[0]
            for m in (model, replace(model, marker_mass=lump), replace(model, density=1.1 * model.density))
        )
        assert np.abs(lumps - bare).max() > 5e-4
        assert np.abs(lumps - spread).max() < 0.15 * np.abs(lumps - bare).max()

    @pytest.mark.parametrize(
        ("options", "words"),
        [({"density": 0.06, "marker_mass": -1.0}, "zero or more"), ({"marker_mass": 1e-3}, "needs the rope's density")],
    )
    def test_bad_masses_are_refused(self, options: dict[str, float], words: str) -> None:
        with pytest.raises(sb.InputError, match=words):
            fit_rope([carried_about()], **options)
