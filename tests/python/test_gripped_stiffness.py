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
from sheetbend.gripped.stiffness import stiffness_section, tangent_stiffness
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
