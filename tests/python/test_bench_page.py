"""The benchmarks' page holds what the measurements say, and the peers' scripts run where their tools are."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from sheetbend_bench.reference import shipped

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "experiments" / "bench"


@pytest.fixture
def scripts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCH))


@pytest.fixture
def table(scripts: None) -> ModuleType:
    pytest.importorskip("matplotlib")
    import table

    return table


def results() -> tuple[Path, str]:
    """The file that the page names, and the page."""
    page = (ROOT / "docs" / "benchmarks.md").read_text()
    (name,) = re.findall(r"\(\.\./experiments/bench/results/(\S+\.json)\)", page)
    return BENCH / "results" / name, page


def test_the_page_is_made_from_the_results(table: ModuleType) -> None:
    path, page = results()
    assert table.filled(page, json.loads(path.read_text()), path.name) == page


def test_a_changed_result_changes_the_page(table: ModuleType) -> None:
    path, page = results()
    data = json.loads(path.read_text())
    data["results"][0]["forward_cpu_ns"] *= 2
    assert table.filled(page, data, path.name) != page


def test_results_tell_the_machine_and_keep_the_bounds() -> None:
    data = json.loads(results()[0].read_text())
    assert {"processor", "cores", "isa", "caches", "memory_gb", "compiler"} <= set(data["machine"])
    bounds = {"W1": 1e-9, "W1s": 1e-8, "W2": 1e-8, "W5": 1e-9}
    for row in data["results"]:
        if row["tool"] == "sheetbend":
            assert row["gradient_error"] <= bounds[row["workload"]]


def test_a_page_without_a_place_is_refused(table: ModuleType) -> None:
    path, page = results()
    with pytest.raises(SystemExit, match="no place for workloads"):
        table.filled(page.replace("<!-- end of workloads -->", ""), json.loads(path.read_text()), path.name)


def test_unknown_peers_are_refused(tmp_path: Path) -> None:
    command = [str(BENCH / "setup_peers.sh"), str(tmp_path), "other"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "no peer is called other" in done.stderr and list(tmp_path.iterdir()) == []


def test_a_tool_that_is_not_there_is_left_out_with_a_word(
    scripts: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import compare

    assert compare.compare(tmp_path, ["W1"], ["jax"], 1) == []
    assert "W1   jax        left out: there is no" in capsys.readouterr().out


def test_what_is_measured_again_replaces_the_old(scripts: None) -> None:
    import compare

    old = {"results": [{"workload": "W2", "tool": "jax", "a": 1}, {"workload": "W1", "tool": "sheetbend", "a": 1}]}
    new = {"results": [{"workload": "W1", "tool": "sheetbend", "a": 2}], "threads": [{"workload": "W2"}]}
    found = compare.merged({**old, "chain": 1}, {**new, "chain": 2})
    assert [(r["workload"], r["tool"], r["a"]) for r in found["results"]] == [("W1", "sheetbend", 2), ("W2", "jax", 1)]
    assert found["threads"] == [{"workload": "W2"}] and found["chain"] == 2


@pytest.mark.slow
def test_the_plain_loop_gives_the_shipped_reference(scripts: None, tmp_path: Path) -> None:
    import plain

    if plain.compiler() is None:
        pytest.skip("there is no C++ compiler")
    program = plain.build(tmp_path, "-ffp-contract=off")
    found = plain.run(program, "W1", "--reference", 1e-4, 1e-2, 0.1)
    np.testing.assert_allclose(found["gradient"], shipped("W1")[0], rtol=1e-10)
    assert plain.run(program, "W1s", 1)["losses"][0] == pytest.approx(0.0748491949, rel=1e-8)


@pytest.mark.slow
def test_the_plain_sheet_is_the_package_s(scripts: None, tmp_path: Path) -> None:
    """Value and gradient of a sheet with strain and hinges, by a program that shares no code with the package."""
    import plain
    import plain_cloth
    from sheetbend_bench import cloth

    if plain.compiler() is None:
        pytest.skip("there is no C++ compiler")
    ours, _ = cloth.sheets(*cloth.CHECKED)
    cells, substeps = cloth.CHECKED
    direction = np.random.default_rng(7).standard_normal(ours.inputs.shape[1]) * np.abs(ours.inputs[0])
    plain_cloth.write(tmp_path / "sheet.txt", cloth.sheet(cells), cloth.SOLVER, substeps, direction)
    program = plain.build(tmp_path, "-ffp-contract=off", name="plain_cloth")
    states = ours.core.states(ours.inputs[0], [substeps], 0.0)
    assert plain.run(program, tmp_path / "sheet.txt", 1)["sum"] == pytest.approx(states.sum(), rel=1e-13)
    derivative = plain.run(program, tmp_path / "sheet.txt", "--derivative")["derivative"]
    assert np.vdot(ours.gradient(), direction) == pytest.approx(derivative, rel=1e-11)
