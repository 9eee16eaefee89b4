"""Results and reports: exact JSON round trip, strict values, readable text, the right figures."""

from __future__ import annotations

import dataclasses
import io
import itertools
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend.plot as plot
from rich.console import Console
from sheetbend.errors import InputError
from sheetbend.optional import MissingExtraError, require
from sheetbend.quantities.wording import short
from sheetbend.report.fit_result import FitResult
from sheetbend.report.report import figures, plain, rich_report
from sheetbend.report.report_premises import _shift_in_words
from sheetbend.result.estimate import Correlation, Estimate, Given, Premise
from sheetbend.result.motions import RecordingFit
from sheetbend.result.result import Misfit, Start

GAUGE = "rope_density^+1 * rope_EA^+1 stays free: only the ratio rope_EA/rope_density is known"


def estimate(name: str, value: float, half: float | None, verdict: str, words: str, **more: object) -> Estimate:
    ends = {"lower": None, "upper": None} if half is None else {"lower": value - half, "upper": value + half}
    fields = {"unit": "N", "half_width": half, "statistical": half, "discretization": 0.0, **ends, **more}
    return Estimate(name=name, value=value, verdict=verdict, words=words, **fields)


@pytest.fixture
def result() -> FitResult:
    return FitResult(
        estimates=(
            estimate("beam_E", 281300.0, 5213.0, "identified", "known to 1.9 %", unit="Pa", discretization=900.0),
            estimate("beam_damping", 3.1234e-5, 2.1e-6, "weak", "known only to 30 %", unit="s"),
            estimate("rope_EA", 1e4, None, "not identifiable", f"{GAUGE}; fix one of them or give it a prior"),
            estimate("rope_density", 0.05, None, "not identifiable", f"{GAUGE}; fix one of them or give it a prior"),
            estimate("grip", 5e3, None, "one-sided", "at least 930 N: larger values do as well", lower=930.0),
        ),
        given=(Given(name="mass", value=0.052, unit="kg", words="fixed"),),
        recordings=(
            RecordingFit(name="gravity_b", rows=12480, rms=0.00112, held_out=0.00213, baseline=0.0123),
            RecordingFit(name="load52_a", rows=0, held_out=0.004, baseline=None),
        ),
        correlations=(
            Correlation(first="beam_E", second="beam_damping", value=-0.71),
            Correlation(first="beam_E", second="grip", value=0.12),
        ),
        gauges=(GAUGE,),
        baseline="each marker stays at its mean",
        cost=0.125,
        rows=12480,
        autocorrelation_time=5.2,
        starts=(
            Start(cost=1.0, iterations=5, converged=True, values={"beam_E": 2.8e5}),
            Start(cost=3.0, iterations=9, converged=False, values={"beam_E": 1e5}),
        ),
        optimizer="SciPy least squares",
        iterations=14,
        seconds=3.2,
        converged=True,
        warnings=("links are longer than the bending length",),
    )


def test_json_round_trip_is_exact(result: FitResult, tmp_path: Path) -> None:
    result.save(tmp_path / "fit.json")
    assert FitResult.load(tmp_path / "fit.json") == result


def test_json_has_the_promised_keys(result: FitResult) -> None:
    data = result.to_dict()
    assert data["parameters"]["beam_E"]["interval"] == [281300.0 - 5213.0, 281300.0 + 5213.0]
    assert {"value", "unit", "verdict"} <= data["parameters"]["beam_E"].keys()
    assert data["parameters"]["grip"]["interval"] == [930.0, None]
    assert data["held_out"] == {"gravity_b": 0.00213, "load52_a": 0.004}
    assert data["baseline"] == {"gravity_b": 0.0123, "load52_a": None}
    assert data["seconds"] == 3.2


def test_json_is_strict(result: FitResult) -> None:
    odd = dataclasses.replace(result, cost=math.nan, autocorrelation_time=math.inf)
    data = json.loads(json.dumps(odd.to_dict(), allow_nan=False))
    assert data["cost"] is None
    assert data["autocorrelation_time"] is None


def test_files_that_hold_no_fit_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{}")
    (tmp_path / "b.json").write_text("not json")
    (tmp_path / "c.json").write_text("[1]")
    for name in ("a.json", "b.json", "c.json"):
        with pytest.raises(InputError, match=r"Fix:"):
            FitResult.load(tmp_path / name)


def test_unknown_verdicts_are_refused() -> None:
    with pytest.raises(InputError, match="verdict"):
        estimate("p", 1.0, 0.1, "perfect", "")


def test_access_by_name(result: FitResult) -> None:
    assert result["beam_E"].value == 281300.0
    assert result.values["mass"] == 0.052
    with pytest.raises(KeyError, match="beam_E"):
        result["nothing"]


def test_report_says_what_must_be_said(result: FitResult) -> None:
    text = result.report()
    assert text.startswith("Fit converged after 14 iterations, 3.2 s, SciPy least squares")
    assert max(map(len, text.splitlines())) <= 100
    assert "281300      5213      [276087, 286513]  Pa    identified" in text
    assert "3.12e-05  0.21e-05  [2.91e-05, 3.33e-05]" in text
    assert "[930, -]" in text
    assert text.count(GAUGE[:40]) == 1  # said once, though two parameters share it
    assert "rope_EA and rope_density:" in text
    assert "17.3 %" in text  # held-out against baseline
    assert "-0.71" in text
    assert "+0.12" not in text
    assert "1 of 2 ended" in text
    assert "links are longer" in text
    assert "discretization" in text


def test_report_of_a_motion_that_was_not_fitted(result: FitResult) -> None:
    moving = dataclasses.replace(result.recordings[0], motion=0.0142, measured_frequency=4.35, simulated_frequency=4.27)
    text = plain(dataclasses.replace(result, recordings=(moving, result.recordings[1])))
    (line,) = [line for line in text.split("Held-out motion")[1].splitlines() if line.startswith("  gravity_b")]
    assert line.split() == ["gravity_b", "14.2", "mm", "15", "%", "4.35", "4.27", "-1.8", "%"]
    assert "Held-out motion" not in plain(result)


def test_report_of_a_fit_that_failed(result: FitResult) -> None:
    assert "did NOT converge" in plain(dataclasses.replace(result, converged=False))
    assert "interrupted" in plain(dataclasses.replace(result, converged=False, interrupted=True))


def test_rich_report_shows_the_same(result: FitResult) -> None:
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(rich_report(result))
    text = console.export_text()
    for words in ("beam_E", "281300", "not identifiable", "17.3 %", "-0.71"):
        assert words in text


@pytest.mark.parametrize(
    ("numbers", "uncertainty", "shown"),
    [
        ((281300.0, 5213.0), 5213.0, ["281300", "5213"]),
        ((3.1234e-5, 2.1e-6), 2.1e-6, ["3.12e-05", "0.21e-05"]),
        ((0.123456, 0.0034), 0.0034, ["0.1235", "0.0034"]),
        ((0.0, 0.02), 0.02, ["0.000", "0.020"]),
        ((2.5, None), 0.1, ["2.50", ""]),
    ],
)
def test_figures(numbers: tuple[float | None, ...], uncertainty: float, shown: list[str]) -> None:
    assert figures(numbers, uncertainty) == shown


def test_short_numbers() -> None:
    assert [short(number) for number in (0.0, 9300.0, 123456.0, 1.5e7, 2e-5, 0.30)] == [
        "0",
        "9300",
        "123000",
        "1.5e+07",
        "2e-05",
        "0.3",
    ]


def test_missing_extras_are_named() -> None:
    with pytest.raises(MissingExtraError, match=r"sheetbend\[plot\]"):
        require("a_package_that_is_not_there.part", "plot")


def test_import_loads_numpy_only() -> None:
    code = "import sys\n"
    code += "import sheetbend.quantities.parameters\n"
    code += "import sheetbend.statistics.covariance\n"
    code += "import sheetbend.statistics.gauge\n"
    code += "import sheetbend.statistics.profile\n"
    code += "import sheetbend.statistics.identifiability\n"
    code += "import sheetbend.result.result\n"
    code += "import sheetbend.report.report\n"
    code += "import sheetbend.pictures.plotting\n"
    code += "print([m for m in ('scipy', 'rich', 'matplotlib', 'torch') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.fixture
def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    times = np.linspace(0, 1, 50)
    simulated = np.zeros((50, 8, 3))
    simulated[:, :, 2] = np.sin(9 * times)[:, None] * np.linspace(0, 0.1, 8)
    measured = simulated + 1e-3
    measured[5:9, 2] = np.nan
    return measured, simulated, times


def test_trajectory_figure(motion: tuple[np.ndarray, ...], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from sheetbend.pictures.plotting import plot_residuals, plot_trajectories, save

    measured, simulated, times = motion
    panels = plot_trajectories(measured, simulated, times, held_out=(0.5, 1.0))
    assert len(panels) == 6  # of eight markers
    dots, line = panels[-1].lines
    np.testing.assert_allclose(line.get_ydata(), 1e3 * simulated[:, 7, 2])
    np.testing.assert_allclose(dots.get_ydata(), 1e3 * measured[:, 7, 2])
    (strip,) = set(panels[0].figure.axes) - set(panels)
    assert strip.get_xlabel() == "time [s]"
    np.testing.assert_allclose(strip.lines[1].get_ydata(), np.where(np.isnan(measured[:, 0, 2]), np.nan, -1.0))
    save(panels, tmp_path / "motion.png")
    assert (tmp_path / "motion.png").stat().st_size > 10_000

    residuals = plot_residuals(measured, simulated, times)
    mean = residuals.lines[-1].get_ydata()
    np.testing.assert_allclose(mean, math.sqrt(3), rtol=1e-9)  # 1 mm in x, y and z, gaps left out
    with pytest.raises(InputError, match="match simulated"):
        plot_trajectories(measured[:, :3], simulated, times)
    with pytest.raises(InputError, match="match the frames"):
        plot_trajectories(measured, simulated, times[:-1])


def test_motions_share_a_figure() -> None:
    pytest.importorskip("matplotlib")
    from sheetbend.pictures.plotting import Motion, plot_motions

    times = np.linspace(0, 1, 50)
    panels = plot_motions(
        [Motion("a", times, np.sin(times), np.cos(times), (0.5, 1.0)), Motion("b", times, times, times)]
    )
    assert [axes.get_title("left") for axes in panels] == ["a", "b"]
    assert [len(axes.patches) for axes in panels] == [1, 0]
    strips = [axes for axes in panels[0].figure.axes if axes not in panels]
    np.testing.assert_allclose(strips[0].lines[1].get_ydata(), 1e3 * (np.cos(times) - np.sin(times)))
    with pytest.raises(InputError, match="at least one"):
        plot_motions([])


def test_shape_and_estimate_figures(result: FitResult) -> None:
    pytest.importorskip("matplotlib")
    from sheetbend.pictures.estimate_plot import plot_estimates
    from sheetbend.pictures.plotting import plot_shapes

    line = np.column_stack([np.linspace(0, 1, 20), np.zeros(20), np.linspace(0, 1, 20) ** 2])
    panels = list(plot_shapes([line] * 4, [line] * 4, names=list("abcd")))
    assert [axes for axes in panels[0].figure.axes if axes.get_visible()] == panels
    assert [axes.get_title("left") for axes in panels] == list("abcd")
    assert all(axes.get_aspect() == 1 for axes in panels)
    panels = plot_estimates(result.estimates, published={"beam_E": (2.5e5, 3e5)})
    assert [axes.get_xlabel() for axes in panels] == ["[Pa]", "[s]", "[N]"]
    with pytest.raises(InputError, match="at least one"):
        plot_shapes([], [])
    with pytest.raises(InputError, match="at least one"):
        plot_estimates([])


@pytest.mark.parametrize(("lower", "upper"), [(18.0, 600.0), (10.0, 5e4)])
def test_numbers_of_a_wide_estimate_stand_apart(lower: float, upper: float) -> None:
    """Over one to a few decades: no two labels of the axis overlap."""
    pytest.importorskip("matplotlib")
    from sheetbend.pictures.estimate_plot import plot_estimates

    wide = dataclasses.replace(estimate("cloth_warp", 50.0, 20.0, "weak", ""), lower=lower, upper=upper)
    (panel,) = plot_estimates([wide])
    panel.figure.canvas.draw()
    axis = panel.xaxis
    texts = [*axis.get_ticklabels(), *axis.get_ticklabels(minor=True)]
    boxes = sorted((t.get_window_extent() for t in texts if t.get_text()), key=lambda box: box.x0)
    assert len(boxes) >= 3
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))


class TestAxesOfOthers:
    """Every figure goes into axes that the caller has."""

    def test_each_draws_where_it_is_told(self, motion: tuple[np.ndarray, ...], result: FitResult) -> None:
        figure = pytest.importorskip("matplotlib.figure").Figure()
        measured, simulated, times = motion
        line = np.column_stack([times, times, times])
        given = figure.subplots(2, 2).ravel()
        assert list(plot.trajectories(measured[:, :2], simulated[:, :2], times, ax=given[:2])) == list(given[:2])
        assert plot.residuals(measured, simulated, times, ax=given[2]) is given[2]
        assert list(plot.shapes([line], [line], ax=given[3])) == [given[3]]
        assert len(given[0].lines) == len(given[1].lines) == 2
        alone = figure.add_axes((0.1, 0.1, 0.5, 0.5))  # of no grid
        assert list(plot.motions([plot.Motion("a", times, times, times)], ax=alone)) == [alone]
        assert alone.get_position().y0 > 0.2 and figure.axes[-1].get_position().y0 == pytest.approx(0.1)

    @pytest.mark.parametrize("count", [0, 1, 3])
    def test_too_many_or_few_are_refused(self, result: FitResult, count: int) -> None:
        figure = pytest.importorskip("matplotlib.figure").Figure()
        given = [figure.add_axes((0, 0, 1, 1)) for _ in range(count)]
        two = [e for e in result.estimates if e.unit in ("Pa", "s")]
        with pytest.raises(InputError, match="2 of them"):
            plot.estimates(two, ax=given)
        with pytest.raises(InputError, match="must be axes"):
            plot.estimates(two, ax=[figure, 3])


def test_a_sigma_in_millimeters_is_named(result: FitResult) -> None:
    """0.5 in place of 5e-4 passed without a word."""
    misfit = Misfit(reduced_chi_square=4e-6, smallest_sigma=0.5, largest_sigma=0.5, model_error=0.0)
    assert "sigma: is 500 times the residuals. Check that it is in m" in plain(
        dataclasses.replace(result, misfit=misfit)
    )
    right = dataclasses.replace(misfit, reduced_chi_square=0.07)
    assert "times the residuals" not in plain(dataclasses.replace(result, misfit=right))


def test_large_percentages_have_no_exponent() -> None:
    e = estimate("drag", 0.03, 0.02, "weak", "")
    moved = Premise(name="table about x", value=None, unit="", off_by=1.0, words="1 degree", moved={"drag": -0.096})
    assert _shift_in_words(moved, e) == "-320 %"
    assert _shift_in_words(dataclasses.replace(moved, moved={"drag": 0.0031}), e) == "+10 %"


def test_panels_over_one_time_begin_at_one_place() -> None:
    """The last one, whose strip has wider numbers, began farther right, and "held out" stood on a curve."""
    times = np.linspace(0.0, 1.0, 20)
    x = np.random.default_rng(0).normal(size=(20, 3, 3))
    panels = plot.trajectories(x, x + 1e-6, times, markers=("a", "b", "c"), held_out=(0.5, 1.0))
    figure = panels[0].figure
    figure.canvas.draw()
    assert len(panels) == 3 and len(figure.axes) == 4
    assert len({round(panel.get_position().x0, 6) for panel in figure.axes}) == 1
    words = [area.get_text() for area in figure.findobj(lambda part: hasattr(part, "get_text"))]
    assert "shaded: held out" in words and "held out" not in words
