"""The benchmark workloads are what they are said to be, their gradients are right, and `measure.py` tells them.
No time is asserted anywhere."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from measure import app
from sheetbend.errors import SheetbendError
from sheetbend_bench import WORKLOADS, measure, workload
from sheetbend_bench import ladder as ladder_module
from sheetbend_bench.bodies import measure_bodies
from sheetbend_bench.chain import gradient_error, lengths, measure_chain
from sheetbend_bench.cloth import measure_cloth
from sheetbend_bench.ladder import measure_ladder, rung
from sheetbend_bench.machine import LEVELS, machine
from sheetbend_bench.problem import Problem
from sheetbend_bench.reference import largest_error, reference, shipped
from sheetbend_bench.rod import measure_rod
from sheetbend_bench.timing import in_fresh_process, peak_mb, timed
from sheetbend_bench.workloads import colors, direction, pinned, projections, start
from typer.testing import CliRunner, Result

KEYS = {
    "workload": str,
    "particles": int,
    "projections": int,
    "threads": int,
    "lanes": int,
    "isa": str,
    "forward_ns": float,
    "gradient_ns": float,
    "forward_ns_min": float,
    "gradient_ns_min": float,
    "forward_cpu_ns": float,
    "gradient_cpu_ns": float,
    "repeats": int,
    "gradient_error": float,
    "gradient_error_bound": float,
    "peak_mb": float,
    "sheetbend": str,
    "machine": dict,
    "exit_code": int,
}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def last_line(result: Result) -> dict[str, Any]:
    (line,) = result.stdout.splitlines()
    found = json.loads(line)
    assert isinstance(found, dict) and found["exit_code"] == result.exit_code
    return found


def expect_figures(found: dict[str, Any]) -> None:
    assert {key: type(found[key]) for key in KEYS} == KEYS
    assert found["gradient_error"] <= found["gradient_error_bound"]
    assert 0 < found["forward_ns_min"] <= found["forward_ns"]
    assert 0 < found["gradient_ns_min"] <= found["gradient_ns"]
    assert found["peak_mb"] > 0


class TestDefinitions:
    @pytest.mark.parametrize(
        ("name", "particles", "stretch", "bend", "color_count", "total"),
        [
            ("W1", 100, 99, 98, 4, 2_364_000),
            ("W1s", 100, 99, 98, 4, 472_800),
            ("W2", 4096, 8064 + 7938, 7936, 12, 71_814_000),
            ("W5", 100, 99, 98, 4, 256 * 2_364_000),
        ],
    )
    def test_counts(self, name: str, particles: int, stretch: int, bend: int, color_count: int, total: int) -> None:
        w, found = workload(name), colors(workload(name))
        assert w.particles == particles and len(found) == color_count and projections(w) == total
        assert sum(len(c.rest) for c in found if not c.bend) == stretch
        assert sum(len(c.rest) for c in found if c.bend) == bend

    @pytest.mark.parametrize("w", [*WORKLOADS.values(), rung(21, 8)], ids=lambda w: w.name)
    def test_a_color_shares_no_particle_and_no_link_comes_twice(self, w: Any) -> None:
        every = np.concatenate([c.particles for c in colors(w)])
        assert len(np.unique(np.sort(every, axis=1), axis=0)) == len(every)
        for c in colors(w):
            assert len(np.unique(c.particles)) == c.particles.size

    def test_the_solver_keeps_the_colors(self) -> None:
        for name, count in (("W1", 4), ("W2", 12)):
            assert Problem(workload(name).shortened(1)).colors == count

    def test_the_solver_finds_about_as_few_colors_itself(self) -> None:
        w, scene = workload("W2"), sb.Scene("own")
        scene.add_particles(start(w), 1e-3)
        for bend in (False, True):
            links = np.concatenate([c.particles for c in colors(w) if c.bend == bend])
            scene.add_constraints("distance", links[np.argsort(links[:, 0], kind="stable")], name=f"bend{bend}")
        assert sb.Solver(method="gauss_seidel").core(scene.compiled).colors == 13

    def test_shape_and_pins(self) -> None:
        x = start(workload("W2"))
        assert x.min(axis=0).tolist() == [0, 0, 0] and x.max(axis=0).tolist() == [1, 0, 1]
        assert sorted(map(tuple, x[pinned(workload("W2"))][:, ::2])) == [(0, 0), (0, 1), (1, 0), (1, 1)]
        assert start(workload("W1"))[-1].tolist() == [1, 0, 0] and pinned(workload("W1")).tolist() == [0]

    def test_batch_is_nominal_first_and_spread_over_a_decade(self) -> None:
        factors = workload("W5").parameters / workload("W5").nominal
        assert factors.shape == (256, 3) and (factors[0] == 1).all()
        assert factors.min() >= 10**-0.5 and factors.max() <= 10**0.5
        assert (np.ptp(np.log10(factors), axis=0) > 0.97).all()

    def test_the_ladder_takes_the_cloths_substep(self) -> None:
        assert rung(1000, 8).h == pytest.approx(workload("W2").h, rel=1e-15)
        assert colors(rung(64, 8))[5].particles.tolist() == colors(workload("W2"))[5].particles.tolist()

    def test_problems_of_others_read_the_same(self, tmp_path: Path) -> None:
        w = workload("W1").shortened(2)
        Problem(w).export(tmp_path / "w.npz")
        with np.load(tmp_path / "w.npz") as saved:
            assert saved["links"].shape == (197, 2) and saved["first_of_color"].tolist() == [0, 50, 99, 149, 197]
            assert saved["target"].shape == (2, 100, 3) and saved["parameters"].shape == (1, 3)
            assert saved["bend"].sum() == 98 and saved["inverse_mass_factor"].tolist() == [0] + [100] * 99


class TestGradients:
    @pytest.mark.parametrize(("name", "frames"), [("W1", 12), ("W1s", 12), ("W2", 1), ("W5", 2)])
    def test_shortened_against_complex_step(self, name: str, frames: int) -> None:
        problem = Problem(workload(name).shortened(frames))
        found = problem.gradient()
        np.testing.assert_allclose(found.loss, problem.forward(), rtol=1e-12)
        assert set(reference(problem)) == set(problem.workload.checked)
        assert largest_error(problem, found) <= problem.workload.bound

    @pytest.mark.parametrize("name", ["W1", "W1s"])
    def test_whole_against_the_plain_loop(self, name: str) -> None:
        problem = Problem(workload(name))
        assert largest_error(problem, problem.gradient()) <= problem.workload.bound

    @pytest.mark.slow
    def test_whole_cloth_against_the_plain_loop(self) -> None:
        problem = Problem(workload("W2"))
        assert largest_error(problem, problem.gradient()) <= problem.workload.bound

    @pytest.mark.parametrize("name", list(WORKLOADS))
    def test_references_keep_the_scaling_law(self, name: str) -> None:
        """Under gravity alone only the products of compliance and mass count."""
        w, known = workload(name), shipped(name)
        assert sorted(known) == w.checked
        for scene, (stretch, bend, mass, _) in known.items():
            s, b, m = w.parameters[scene]
            assert s * stretch + b * bend == pytest.approx(m * mass, rel=1e-8)

    def test_a_wrong_gradient_is_seen(self) -> None:
        problem = Problem(workload("W1").shortened(2))
        found = problem.gradient()
        found.start[:] *= 1 + 1e-6
        assert largest_error(problem, found) == pytest.approx(1e-6, rel=1e-2)

    def test_threads_change_no_bit(self) -> None:
        w = workload("W5").shortened(1)
        one, two = Problem(w, 1).gradient(), Problem(w, 2).gradient()
        assert (one.parameters == two.parameters).all() and (one.start == two.start).all()

    @pytest.mark.slow
    def test_chain(self) -> None:
        assert gradient_error() <= 1e-9


class TestMeasuring:
    def test_repeats_and_the_last_result(self) -> None:
        calls: list[int] = []
        times, result = timed(lambda: calls.append(1) or len(calls), 3)
        assert len(times.seconds) == 3 and result == 4
        found = times.figures("forward", 10)
        assert found["forward_ns"] == 1e8 * sorted(times.seconds)[1] and found["forward_ns_min"] <= found["forward_ns"]
        assert found["forward_cpu_ns"] == 1e8 * sorted(times.processor)[1]

    def test_peak_memory_is_that_of_the_call(self) -> None:
        megabytes = in_fresh_process(_peak_of_an_array)
        assert megabytes == pytest.approx(80.0, abs=4.0)

    def test_a_process_that_dies_is_told(self) -> None:
        with pytest.raises(SheetbendError, match="ended from outside"):
            in_fresh_process(os._exit, 1)

    def test_machine(self) -> None:
        found = machine()
        assert found["processor"] and found["cores"] >= 1 and found["memory_gb"] > 0.1
        assert found["isa"] in (*LEVELS, "portable") and isinstance(found["caches"], dict)

    def test_library(self) -> None:
        found = measure(workload("W1").shortened(1), repeats=1)
        assert found["workload"] == "W1" and found["frames"] == 1 and found["repeats"] == 1


def _peak_of_an_array() -> float:
    """Of 80 MB, after twice as much that is given back."""
    np.ones(20_000_000).sum()
    return peak_mb(lambda: np.ones(10_000_000).sum())


class TestCommand:
    @pytest.mark.parametrize(("name", "particles"), [("W1", 100), ("W1s", 100), ("W2", 4096), ("W5", 25600)])
    def test_json(self, name: str, particles: int) -> None:
        found = last_line(run(name, "--frames", 1, "--repeats", 1, "--json"))
        expect_figures(found)
        assert found["workload"] == name and found["particles"] == particles and found["exit_code"] == 0
        assert found["projections"] * WORKLOADS[name].frames == projections(WORKLOADS[name])

    def test_words(self) -> None:
        result = run("W1", "--frames", 1, "--repeats", 1)
        assert result.exit_code == 0
        for word in ("W1", "forward", "gradient", "ns per projection", "complex step", "MB"):
            assert word in result.stdout

    @pytest.mark.parametrize(
        ("arguments", "field"),
        [
            (("W3",), "WORKLOAD"),
            (("W1", "--threads", 0), "--threads"),
            (("W1", "--repeats", 0), "--repeats"),
            (("W1", "--frames", 121), "frames"),
            (("chain", "--frames", 2), "--frames"),
            (("W1", "--figure", "w.png"), "--figure"),
        ],
    )
    def test_bad_input(self, arguments: tuple[object, ...], field: str) -> None:
        result = run(*arguments, "--json")
        assert result.exit_code == 2 and last_line(result)["error"]["field"] == field

    def test_unknown_workloads_are_answered_with_the_known(self) -> None:
        assert "W1, W1s, W2, W5, chain, bodies, rod, cloth, ladder" in last_line(run("sheet", "--json"))["error"]["fix"]

    def test_a_wrong_gradient_exits_5(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("sheetbend_bench.measurement.largest_error", lambda problem, found: 1e-3)
        result = run("W1", "--frames", 1, "--repeats", 1)
        assert result.exit_code == 5 and "<- fails" in result.stdout


class TestChainAndLadder:
    @pytest.mark.slow
    def test_rod(self) -> None:
        found = measure_rod(repeats=1, substeps=20)
        assert found["gradient_error"] <= found["gradient_error_bound"]
        ways = ("forward", "two_iterations", "gradient", "jacobian", "forward_batch", "gradient_singly")
        assert all(found[f"{name}_ns"] > 0 for name in ways)

    def test_chain(self) -> None:
        assert [length.segments for length in lengths()] == [20, 50, 200, 1000, 5000, 20000]
        assert [length.substeps for length in lengths(60_000)] == [3000, 1200, 300, 60, 12, 3]
        found = {**measure_chain(repeats=1, work=600, segments=(20, 50, 300)), "exit_code": 0}
        expect_figures(found)
        assert [(row["segments"], row["substeps"]) for row in found["rows"]] == [(20, 30), (50, 12), (300, 3)]
        assert found["particles"] == 301 and found["projections"] == 900
        assert found["batch"]["ropes"] == 64 and found["batch"]["gradient_speedup"] > 0

    def test_bodies(self) -> None:
        found = {**measure_bodies(repeats=1, work=120, bodies=(5, 20)), "exit_code": 0}
        expect_figures(found)
        assert [(row["bodies"], row["substeps"]) for row in found["rows"]] == [(5, 24), (20, 6)]
        assert all(row["segment_forward_cpu_ns"] > 0 for row in found["rows"])

    @pytest.mark.slow
    def test_cloth(self) -> None:
        found = {**measure_cloth(repeats=1, cells=(4, 6), vertex_substeps=1_000), "exit_code": 0}
        expect_figures(found)
        assert [row["particles"] for row in found["rows"]] == [25, 49]
        assert [row["substeps"] for row in found["rows"]] == [40, 20]
        assert all(row["gradient_step_ms"] > row["forward_step_ms"] > 0 for row in found["rows"])
        assert found["swatch"]["batch"]["sheets"] == 8 and found["swatch"]["newton"]["iterations"] == 2

    def test_ladder(self, tmp_path: Path) -> None:
        pytest.importorskip("matplotlib")
        from sheetbend_bench.figure import draw_ladder, sweep_bytes

        seen: list[dict[str, Any]] = []
        found = measure_ladder(repeats=1, sides=(21, 90), particle_substeps=8_000, progress=seen.append)
        expect_figures({**found, "exit_code": 0})
        assert seen == found["rows"] and [row["particles"] for row in seen] == [441, 8100]
        assert found["rows"][0]["projections"] == 18 * 5 * sum(len(c.rest) for c in colors(rung(21, 18)))
        assert sweep_bytes(found["rows"][-1]) == pytest.approx(32 + 32 * 5.89, rel=0.01)
        draw_ladder(found, tmp_path / "ladder.png")
        assert (tmp_path / "ladder.png").stat().st_size > 5000

    def test_the_ladder_goes_to_a_million(self) -> None:
        assert ladder_module.SIDES[0] ** 2 == 441 and ladder_module.SIDES[-1] ** 2 == 1_000_000

    def test_direction_is_zero_where_pinned(self) -> None:
        assert (direction(workload("W2"))[pinned(workload("W2"))] == 0).all()
