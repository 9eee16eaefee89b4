"""The sources follow the linter, the formatter and the type checker."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("tool", ["ruff check", "ruff format --check", pytest.param("mypy", marks=pytest.mark.slow)])
def test_passes(tool: str, tmp_path: Path) -> None:
    cache = ["--cache-dir", str(tmp_path)]
    command = [sys.executable, "-m", *tool.split(), *cache, *([] if tool == "mypy" else ["."])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
