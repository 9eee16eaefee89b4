"""A network between substeps: it halves the error on throws that it has not seen, after two thirds of its training."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "one_substep"


def test_a_residual_force_halves_the_error_on_new_throws(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(FOLDER))
    residual = importlib.import_module("residual")
    monkeypatch.delitem(sys.modules, "residual")
    alone, helped = residual.main(steps=10)
    assert helped < 0.5 * alone
    assert "less error is the network's work" in capsys.readouterr().out
