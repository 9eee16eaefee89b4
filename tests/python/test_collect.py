"""Fits of many specimens: one command for all, one table, and the population they are of."""

from __future__ import annotations

import csv
import json
import math
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from sheetbend.cli.ensemble import fit_all
from sheetbend.cli.fit import _single
from sheetbend.cli.outcome import Code
from sheetbend.cli.screen import Screen
from sheetbend.errors import InputError
from sheetbend.problem.journal import Journal
from sheetbend.report.collected import Collected
from sheetbend.report.fit_result import FitResult
from sheetbend.result.estimate import Estimate
from sheetbend.statistics.population import population

# --- populations


def test_means_and_spreads_are_inside_their_intervals() -> None:
    """20 populations of 50, with a spread of 10 % and errors of 4 to 12 %: each interval in at least 18."""
    rng, mean, spread = np.random.default_rng(25), math.log(2e-3), 0.1
    inside = np.zeros(2, dtype=int)
    for _ in range(20):
        sd = rng.uniform(0.04, 0.12, 50)
        y = mean + spread * rng.standard_normal(50) + sd * rng.standard_normal(50)
        p = population(y, sd**2)
        inside += [p.mean_interval[0] < mean < p.mean_interval[1], p.spread_interval[0] < spread < p.spread_interval[1]]
    assert (inside >= 18).all()


def test_intervals_cover_95_percent_of_small_populations() -> None:
    """Of 8 with errors as large as the spread: 400 draws, binomial bounds of 93 to 97.5 %."""
    rng, inside = np.random.default_rng(3), np.zeros(2)
    for _ in range(400):
        sd = rng.uniform(0.5, 1.5, 8)
        p = population(rng.standard_normal(8) + sd * rng.standard_normal(8), sd**2)
        inside += [p.mean_interval[0] < 0 < p.mean_interval[1], p.spread_interval[0] <= 1 <= p.spread_interval[1]]
    assert (inside / 400 > 0.925).all() and (inside / 400 < 0.99).all()


def test_equal_errors_have_closed_forms() -> None:
    """With equal variances the REML estimate is the sample's variance less that of the errors."""
    y = np.array([1.0, 2.0, 4.0, 7.0])
    p = population(y, np.full(4, 0.5))
    assert p.mean == pytest.approx(y.mean()) and p.spread**2 == pytest.approx(y.var(ddof=1) - 0.5, rel=1e-6)
    assert p.mean_interval[1] - p.mean == pytest.approx(3.182446 * y.std(ddof=1) / 2.0, rel=1e-5)
    chi = 3 * y.var(ddof=1)
    assert p.spread_interval[1] ** 2 == pytest.approx(chi / 0.2157953 - 0.5, rel=1e-5)
    assert p.share == pytest.approx(p.spread**2 / (p.spread**2 + 0.5))
    alike = population(np.array([1.0, 1.01, 0.99, 1.0]), np.full(4, 1.0))
    assert alike.spread == 0.0 and alike.spread_interval[0] == 0.0 and alike.share == 0.0


def test_too_few_and_no_errors_are_refused() -> None:
    for y, v in (([1.0, 2.0], [1.0, 1.0]), ([1.0, 2.0, 3.0], [1.0, 0.0, 1.0]), ([1.0, 2.0, 3.0], [1.0, np.inf, 1.0])):
        with pytest.raises(InputError):
            population(np.array(y), np.array(v))


# --- tables


def estimate(value: float, verdict: str = "identified", name: str = "rope_EI") -> Estimate:
    ends = (value / 1.1, value * 1.1) if verdict in ("identified", "weak") else (None, None)
    half = None if ends[0] is None or ends[1] is None else (ends[1] - ends[0]) / 2
    lower, upper = ends
    return Estimate(
        name=name, value=value, unit="N m^2", lower=lower, upper=upper, half_width=half, statistical=half,
        discretization=0.0, verdict=verdict, words="",
    )  # fmt: skip


def result(*estimates: Estimate) -> FitResult:
    return FitResult(
        estimates=estimates,
        recordings=(),
        cost=1.0,
        rows=9,
        optimizer="scipy",
        iterations=1,
        seconds=1.0,
        converged=True,
    )


def test_fits_in_one_table_with_petabs_columns() -> None:
    values = {"a": 1e-3, "b": 1.2e-3, "c": 1.5e-3, "d": 0.9e-3}
    fits = {name: result(estimate(value)) for name, value in values.items()}
    fits["bad"] = result(estimate(1.0, "doubtful"))
    found = Collected.of(fits)
    (trait,) = found.traits
    assert trait.log and trait.found is not None and trait.found.count == 4 and trait.left_out == {"bad": "doubtful"}
    assert min(values.values()) < math.exp(trait.found.mean) < max(values.values())
    rows = list(csv.DictReader(found.table().splitlines()))
    assert [row["specimen"] for row in rows] == list(fits) and float(rows[1]["value"]) == 1.2e-3
    (row,) = csv.DictReader(found.petab().splitlines(), delimiter="\t")
    assert row["parameterId"] == "rope_EI" and row["parameterScale"] == "log" and row["estimate"] == "1"
    assert float(row["lowerBound"]) < float(row["nominalValue"]) < float(row["upperBound"])
    assert "bad (doubtful)" in found.report()
    assert "not told" not in found.report()
    alike = Collected.of({name: result(estimate(1e-3)) for name in "abcdefgh"}).report()
    assert "not told: rope_EI: specimens differ by less than their intervals alone would make them" in alike
    few = Collected.of({"a": fits["a"], "b": fits["b"]})
    assert few.traits[0].found is None and "rope_EI" in few.report()


# --- commands

ROPE = """
[experiment]
name = "{name}"

[solver]
h = 0.005

[[scene.rope]]
name = "rope"
length = 0.5
segments = 6
density = 0.05
EI = 1e-3
clamp_start = [1, 0, 0]
pinned = [0]

[[recording]]
file = "{name}.npz"

[parameters.rope_EI]

[fit]
halve_step = false
double_segments = false
profiles = false

[output]
figures = "none"
"""


@pytest.fixture(scope="module")
def ropes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ropes")
    rng, times, solver = np.random.default_rng(1), np.arange(20) / 50, sb.Solver(h=0.005)
    for name, EI in zip("abcd", (1.8e-3, 2.0e-3, 2.3e-3, 2.1e-3), strict=True):
        scene = sb.rope(0.5, 6, density=0.05, EI=EI, clamp_start=(1, 0, 0))
        x = sb.simulate(scene, times, solver).positions
        (rope,) = scene.ropes.values()
        x = x[:, list(rope.particles)]
        recording = sb.Recording(x + 1e-4 * rng.standard_normal(x.shape), times, name=name)
        recording.save(folder / f"{name}.npz")
        (folder / f"{name}.toml").write_text(ROPE.format(name=name), encoding="utf-8")
    return folder


def test_one_command_fits_all_and_does_nothing_twice(ropes: Path) -> None:
    broken = ropes / "c.toml"
    good = broken.read_text()
    broken.write_text(good.replace('file = "c.npz"', 'file = "lost.npz"'))
    none = ropes / "none.toml"
    none.write_text(good.replace("[solver]", "[solver"), encoding="utf-8")
    out = ropes / "out"
    told = run("fit", ropes / "*.toml", "--output", out, "--json")
    codes = last_line(told)["fits"]
    bad = {name: code == 2 for name, code in codes.items()}
    assert bad == {str(none): True, "a": False, "b": False, "c": True, "d": False}
    assert told.exit_code == 2 and f"{none}: is not valid TOML" in told.stderr
    assert last_line(run("fit", ropes / "none*.toml", "--json"))["error"]["problem"].startswith("is not valid TOML")
    assert (out / "none" / "error.txt").read_text().startswith(f"{none}: is not valid TOML")
    without = last_line(run("collect", out, "--output", ropes / "part", "--json"))["without"]
    assert list(without) == ["c", "none"] and "lost.npz" in without["c"]
    alone = last_line(run("collect", out / "none", "--json"))["error"]
    assert f"hold no fit.json; none: {none}: is not valid TOML" in alone["problem"]
    none.unlink()
    (out / "none" / "error.txt").unlink()
    before = {name: (out / name / "fit.json").stat().st_mtime_ns for name in "abd"}
    broken.write_text(good)
    done = run("fit", ropes / "*.toml", "--output", out)
    assert "4 configurations, 3 of them done" in done.stdout
    listed = run("fit", *(ropes / f"{name}.toml" for name in "abcd"), "--output", out)  # as the shell expands *.toml
    assert "4 configurations, 4 of them done" in listed.stdout and listed.exit_code == done.exit_code
    assert {name: (out / name / "fit.json").stat().st_mtime_ns for name in "abd"} == before
    assert (out / "c" / "fit.json").is_file()
    again = last_line(run("fit", ropes / "*.toml", "--output", out, "--json"))["fits"]
    assert all(again[name] == codes[name] for name in "abd")
    collected = last_line(run("collect", out, "--output", ropes / "all", "--json"))
    assert collected["fits"] == ["a", "b", "c", "d"] and collected["without"] == {}
    assert 1.8e-3 < math.exp(collected["population"]["rope_EI"]["found"]["mean"]) < 2.3e-3
    written = {path.name for path in (ropes / "all").iterdir()}
    assert written >= {"fits.csv", "parameters.tsv", "population.json", "population.txt"}
    assert json.loads((ropes / "all/population.json").read_text())["rope_EI"]["found"]["count"] == 4
    broken.write_text(good.replace('file = "c.npz"', 'file = "lost.npz"'))
    (out / "a" / "fit.json").write_text("{}")  # as of another version
    mended = last_line(run("fit", ropes / "*.toml", "--output", out, "--json"))["fits"]
    assert mended["a"] == codes["a"] and mended["c"] == 2
    collected = last_line(run("collect", out, "--output", ropes / "all", "--json"))
    assert len(collected["fits"]) == 4 and collected["without"] == {} and list(collected["older"]) == ["c"]


def test_a_specimen_that_lacks_a_marker_is_named(ropes: Path, tmp_path: Path) -> None:
    for name in "abcd":
        (tmp_path / f"{name}.toml").write_text(ROPE.format(name=name), encoding="utf-8")
        r = sb.Recording.load(ropes / f"{name}.npz")
        x, markers = r.positions.copy(), r.markers
        if name == "b":  # the last marker fell off before the recording, so the others move along the rope
            x, markers = x[:, :-1], markers[:-1]
        if name == "c":
            x[4:, 3] = np.nan
        sb.Recording(x, r.times, markers, name=name).save(tmp_path / f"{name}.npz")
    run("fit", tmp_path / "*.toml", "--output", tmp_path / "out")
    whole, short = ((tmp_path / "out" / name / "report.txt").read_text() for name in "ac")
    assert "markers: all of them, at equal distances from end to end" in whole and "seen in few" not in whole
    assert "c: markers seen in few of the fitted frames: m3 (20 %)" in short
    told = last_line(run("collect", tmp_path / "out", "--output", tmp_path / "all", "--json"))
    assert told["markers"] == {"b": "lacks m6", "c": "m3 is seen in 20 % of the frames"}
    rows = csv.DictReader((tmp_path / "all" / "fits.csv").read_text().splitlines())
    assert {row["specimen"]: row["markers"] for row in rows} == {"a": "", "d": "", **told["markers"]}
    assert "markers: b: lacks m6; c: m3 is seen" in (tmp_path / "all" / "population.txt").read_text()


class Interrupted(Executor):
    """The first fit is done; Ctrl-C comes while the second one is waited for."""

    def __init__(self) -> None:
        self.done = 0

    def submit(self, fn: Any, /, *args: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.done == 0:
            future.set_result(fn(*args, **options))
        else:
            future.set_exception(KeyboardInterrupt())
        self.done += 1
        return future


def test_ctrl_c_while_workers_fit_keeps_what_is_done(ropes: Path, tmp_path: Path) -> None:
    console = Screen()
    with console.capture() as told:
        found = fit_all(console, [str(ropes / "[ab].toml")], tmp_path, False, _single, Interrupted())
    assert found.code is Code.INTERRUPTED and found.data["fits"]["b"] == 130
    assert "interrupted: the same command continues from here" in told.get()
    assert (tmp_path / "a" / "fit.json").is_file() and not (tmp_path / "b").exists()


def test_an_unfinished_run_of_another_configuration_begins_anew(ropes: Path, tmp_path: Path) -> None:
    """Its journal is of no use, and nobody gave the `--resume` that the error asks to leave out."""
    (tmp_path / "a").mkdir()
    Journal(tmp_path / "a" / "journal.sqlite", {"[fit]": "another"}).close()
    told = run("fit", ropes / "[a]*.toml", "--output", tmp_path)
    assert told.exit_code in (0, 4) and "is of another fit; different are" in " ".join(told.stdout.split())
    assert (tmp_path / "a" / "fit.json").is_file() and not list((tmp_path / "a").glob("journal*"))


def test_several_fits_refuse_what_is_for_one(ropes: Path) -> None:
    assert last_line(run("fit", ropes / "*.toml", "--movie", "x.gif", "--json"))["error"]["field"] == "--movie"
    assert last_line(run("fit", ropes / "none*.toml", "--json"))["error"]["field"] == "config"
    assert last_line(run("fit", ropes / "a.toml", ropes / "e.toml", "--json"))["error"]["got"].endswith("e.toml'")
    (ropes / "sub").mkdir()
    for name in ("one", "two"):
        (ropes / "sub" / f"{name}.toml").write_text((ropes / "a.toml").read_text(), encoding="utf-8")
    told = last_line(run("fit", ropes / "sub" / "*.toml", "--json"))["error"]
    assert told["field"].endswith("experiment.name") and "another one's" in told["problem"]
    assert last_line(run("collect", ropes / "sub", "--json"))["error"]["field"] == "results"
