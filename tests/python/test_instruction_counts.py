"""The comparison of instruction counts sees what is off, and its records are complete."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import ModuleType

import pytest
import sheetbend as sb

FOLDER = Path(__file__).resolve().parents[1] / "instructions"


@pytest.fixture
def count(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    import count

    return count


def test_counts_within_the_margin_pass(count: ModuleType) -> None:
    assert count.compare({"v2": {"distance": 102.9}}, {"v2": {"distance": 100.0}}) == []


@pytest.mark.parametrize("got", [103.1, 96.9], ids=["more", "fewer"])
def test_counts_outside_of_it_fail(count: ModuleType, got: float, capsys: pytest.CaptureFixture[str]) -> None:
    assert count.compare({"v2": {"distance": got}}, {"v2": {"distance": 100.0}}) == ["v2 distance"]
    assert "<- off" in capsys.readouterr().out


def test_what_is_missing_on_one_side_fails(count: ModuleType) -> None:
    known = {"distance forward": 1.0}
    assert count.compare({"v2": known | {"distance gradient": 1.0}}, {"v2": known}) == ["v2 distance gradient"]
    assert count.compare({"v2": {}}, {"v2": {"distance": 1.0}}) == ["v2 distance"]


def test_a_new_kind_is_told_of_and_passes(count: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    assert count.compare({"v2": {"tet_volume forward": 1.0}}, {"v2": {}}) == []
    assert "new" in capsys.readouterr().out


def test_only_what_grows_with_substeps_and_sweeps_counts(count: ModuleType) -> None:
    totals = {(8, s, k): 1000 + 70 * s + 30 * k + 12 * 8 * s * k for s in (1, 3) for k in (1, 4)}
    assert count.per_projection(totals) == 12


def test_without_valgrind_it_says_so(
    count: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(sys, "argv", ["count.py", "sweeps"])
    assert count.main() == 77 and "no valgrind" in capsys.readouterr().out


def test_kinds_are_recorded_whole_and_exist() -> None:
    for sets in json.loads((FOLDER / "expected.json").read_text()).values():
        assert set(sets) == {"x86-64-v3"}
        for counts in sets.values():
            kinds = {name.split()[0] for name in counts}
            assert kinds <= set(sb.KINDS) and "distance" in kinds
            assert set(counts) == {
                f"{kind}{damped} {what}"
                for kind in kinds
                for damped in ("", " damped")
                for what in ("forward", "gradient")
            }
