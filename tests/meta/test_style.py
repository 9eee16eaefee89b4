"""The sources follow the linter, the formatter and the type checker."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("tool", ["ruff check", "ruff format --check", pytest.param("mypy", marks=pytest.mark.slow)])
def test_passes(tool: str, tmp_path: Path) -> None:
    cache = ["--cache-dir", os.devnull if tool == "mypy" else str(tmp_path)]  # which mypy would take seconds to fill
    command = [sys.executable, "-m", *tool.split(), *cache, *([] if tool == "mypy" else ["."])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_no_source_file_is_long() -> None:
    """One idea a file: 400 lines at most."""
    sources = [p for top in ("core", "adjoint", "python") for p in (ROOT / top).rglob("*")]
    lines = {p: len(p.read_text().splitlines()) for p in sources if p.suffix in (".h", ".cpp", ".py", ".pyi")}
    assert len(lines) > 400
    assert {str(p.relative_to(ROOT)): n for p, n in lines.items() if n > 400} == {}
