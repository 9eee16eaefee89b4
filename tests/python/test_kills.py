"""Fits that are killed at random moments and resumed end at the bits of uninterrupted ones: one fit of each kind here,
more of them by `python tools/kills.py`."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from sheetbend.minimum.optimizers import has_ceres

TOOLS = Path(__file__).resolve().parents[2] / "tools"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ceres", "scipy", "profiles", "gripped"])
def test_killed_fits_end_at_the_same_bits(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TOOLS))
    kills = importlib.import_module("kills")
    if kind == "ceres" and not has_ceres():
        pytest.skip("built without Ceres")
    study = kills.Study(tmp_path)
    whole, seconds = study.whole(kind, seed=1)
    killed = study.killed(kind, 1, 2, seconds)
    assert len(killed.kept) == 2 and killed.kept[-1] > 0  # not all before the first evaluation was kept
    assert kills.without_times(killed.result) == kills.without_times(whole)
