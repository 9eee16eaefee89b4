"""The first section of a report: did the fit work, how well does it predict, what to do next."""

from __future__ import annotations

from dataclasses import replace

import pytest
from sheetbend.report.fit_result import FitResult
from sheetbend.report.report import plain, sections
from sheetbend.result.estimate import VERDICTS, Estimate, Premise
from sheetbend.result.motions import ForceFit, RecordingFit
from sheetbend.result.result import Misfit


def estimate(name: str, verdict: str = "identified") -> Estimate:
    numbers = {"value": 2.0, "lower": 1.9, "upper": 2.1, "half_width": 0.1, "statistical": 0.1, "discretization": 0.0}
    return Estimate(name=name, unit="N", verdict=verdict, words=verdict, **numbers)


@pytest.fixture
def good() -> FitResult:
    return FitResult(
        estimates=(estimate("EI"), estimate("drag")),
        recordings=(RecordingFit(name="take", rows=900, rms=1e-3, held_out=1.2e-3, baseline=0.1, motion=0.05),),
        misfit=Misfit(reduced_chi_square=1.1, smallest_sigma=5e-4, largest_sigma=5e-4, model_error=1e-4),
        cost=500.0,
        rows=900,
        optimizer="scipy",
        iterations=7,
        seconds=2.0,
        converged=True,
    )


def told(result: FitResult) -> dict[str, str]:
    first = sections(result)[0]
    assert first.title == "Summary"
    return dict(first.notes)


def test_a_good_fit(good: FitResult) -> None:
    assert told(good) == {
        "result": "the optimizer converged; 2 of 2 parameters are identified",
        "fit": "the simulation misses the fitted data by 1 mm (rms), as expected from the given noise",
        "prediction": "data that were not fitted are missed by 1.2 mm (rms); a prediction without physics misses them "
        "by 100 mm",
        "next": "use the values with their intervals",
    }
    assert plain(good).index("Summary") < plain(good).index("Misfit")


def test_the_most_urgent_step_comes_first(good: FitResult) -> None:
    poor = replace(good, estimates=(estimate("EI", "doubtful"), estimate("drag", "weak")), converged=False)
    first = told(poor)
    assert first["result"] == (
        "the optimizer did not converge; 1 of 2 parameters is doubtful (EI), 1 of 2 parameters is weak (drag)"
    )
    assert "max_iterations" in first["next"] and "EI" in first["then"] and "What contradicts" in first["then"]
    assert "--resume" in told(replace(poor, interrupted=True))["next"]


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_but_identified_asks_for_something(good: FitResult, verdict: str) -> None:
    step = told(replace(good, estimates=(estimate("EI"), estimate("drag", verdict))))["next"]
    assert ("use the values with their intervals" in step) == (verdict == "identified") == ("drag" not in step)


@pytest.mark.parametrize(
    "change",
    [
        {"converged": False},
        {"interrupted": True},
        {"misfit": Misfit(reduced_chi_square=9.0, smallest_sigma=5e-4, largest_sigma=5e-4, model_error=1e-3)},
    ],
    ids=["stopped", "interrupted", "far from the noise"],
)
def test_values_are_not_to_be_used_while_something_speaks_against_them(
    good: FitResult, change: dict[str, object]
) -> None:
    """The second step after "the model lacks something there" was to use the values with their intervals."""
    poor = told(replace(good, **change))
    assert not any("use the values with" in poor.get(step, "") for step in ("next", "then"))


def test_no_minimum_is_no_convergence(good: FitResult) -> None:
    lost = replace(good, estimates=(estimate("EI", "no minimum"), estimate("drag", "no minimum")))
    assert told(lost)["result"] == "the optimizer stopped, but in no minimum; 2 of 2 parameters are without a minimum"
    assert told(replace(good, interrupted=True))["result"].startswith("the optimizer converged, and the fit was then")
    assert told(replace(good, estimates=()))["result"] == "the optimizer converged"


def test_warnings_are_to_be_read_first(good: FitResult) -> None:
    assert told(replace(good, warnings=("sigma is guessed",)))["next"].endswith("after you have read the warnings")


def test_force_sensors_count_as_recordings_do(good: FitResult) -> None:
    """Where only forces were held out, the prediction was said to be untested."""
    force = ForceFit(recording="take", sensor="grip", rows=90, rms=0.1, held_out=0.3, baseline=0.2, unit="N")
    seen = replace(good.recordings[0], held_out=None, baseline=None)
    said = told(replace(good, recordings=(seen,), forces=(force,)))
    assert "by 1 mm and 0.1 N (rms)" in said["fit"]
    assert said["prediction"].startswith("data that were not fitted are missed by 0.3 N (rms); a prediction without")
    assert "grip of take is predicted worse" in said["next"] and "then" not in said


def test_names_of_many_parameters_are_cut(good: FitResult) -> None:
    many = tuple(estimate(f"k{i}", "doubtful") for i in range(400))
    assert "k3 and 396 more" in told(replace(good, estimates=many))["next"]


def test_a_prediction_that_is_worse_than_none_is_said(good: FitResult) -> None:
    poor = replace(good.recordings[0], held_out=0.2)
    assert "take is predicted worse than without physics" in told(replace(good, recordings=(poor,)))["next"]
    both = replace(good, recordings=(poor, replace(poor, name="second")))
    assert "take, second are predicted worse" in told(both)["next"]


def test_nothing_held_out_is_said(good: FitResult) -> None:
    seen = replace(good, recordings=(replace(good.recordings[0], held_out=None, baseline=None),))
    assert told(seen)["prediction"] == "not tested, because nothing was held out" and "`held_out`" in told(seen)["next"]
    elsewhere = told(replace(seen, prediction="2 recordings that were not fitted are missed by 0.8 mm"))
    assert elsewhere["prediction"].endswith("missed by 0.8 mm") and "`held_out`" not in elsewhere["next"]


@pytest.mark.parametrize(
    ("chi", "words"),
    [(9.0, "3 times what the given noise explains"), (0.01, ", less than the given noise")],
)
def test_residuals_are_compared_with_the_given_noise(good: FitResult, chi: float, words: str) -> None:
    assert good.misfit is not None
    result = replace(good, misfit=replace(good.misfit, reduced_chi_square=chi))
    assert told(result)["fit"].endswith(words) and ("lacks something" in told(result)["next"]) == (chi > 4)


def test_recordings_in_several_units_have_a_span_each(good: FitResult) -> None:
    (take,) = good.recordings
    more = (take, replace(take, name="b", rms=3e-3), replace(take, name="angle", unit="rad", rms=0.01))
    assert "by 1 to 3 mm and 0.01 rad (rms)" in told(replace(good, recordings=more))["fit"]


def test_the_given_value_that_matters_most_is_named(good: FitResult) -> None:
    premise = Premise(
        name="length", value=1.0, unit="m", off_by=0.01, words="1 %", moved={"EI": 0.5}, leaves=0.0, sd=None
    )
    found = told(replace(good, premises=(premise,)))
    assert (
        found["next"].startswith("check that the error in length is below 0.2 %. If it is not")
        and "EI" in found["next"]
    )
    assert "then" not in found


def test_a_parameter_of_one_recording_is_named_last(good: FitResult) -> None:
    """The half-width "+/- in all" that the summary named was in no table."""
    own = tuple(estimate(f"angle_of_the_clamp[recording_{i}]") for i in range(3))
    moved = {e.name: 0.5 for e in own} | {"EI": 0.4}
    given = {"value": 1.0, "unit": "m", "off_by": 0.01, "words": "1 %", "leaves": 0.0, "sd": None}
    moved_by = replace(good, estimates=(*own, estimate("EI")), premises=(Premise(name="length", moved=moved, **given),))
    assert "half-width of EI" in told(moved_by)["next"]
    wide = tuple(replace(e, in_all=50.0, unit="N m^2 of a long unit name") for e in moved_by.estimates)
    notes = dict({part.title: part.notes for part in sections(replace(moved_by, estimates=wide))}["Parameters"])
    assert notes["+/- in all"].startswith("EI 50")
    assert "(parameters.csv has those of the other parameters)" in notes["+/- in all"]
