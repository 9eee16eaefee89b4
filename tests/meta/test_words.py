"""The spelling and the phrasing of the repository's texts."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".md", ".py", ".pyi", ".h", ".cpp", ".toml", ".cmake", ".sh", ".yml", ".txt"}
OURS = re.compile(r"^(?!licenses/|python/sheetbend/page/vendor/|tests/meta/words\.txt|.*/(data|expected)/)")
# A gradient is taken with respect to something. What follows "by" may be how it was computed.
HOW = (
    r"tangents|finite|complex|forward|reverse|differences|central|hand\b|supports|blocks|\d|name\b|the implicit|"
    r"the adjoint|an evolution|L-BFGS|implicit|adjoint|autograd|rounding|several|five sweeps|checkpoints"
)
BY = re.compile(rf"\b(gradient|derivative|jacobian)s? by (?!{HOW})", re.IGNORECASE)


def texts() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    names = [name for name in listed.stdout.splitlines() if OURS.match(name)]
    return [ROOT / name for name in names if Path(name).suffix in TEXT and (ROOT / name).is_file()]


def test_american_spelling() -> None:
    """codespell, with British spellings as errors; words that it takes for others stand in words.txt."""
    pytest.importorskip("codespell_lib")
    names = [str(path.relative_to(ROOT)) for path in texts()]
    found = subprocess.run(
        [sys.executable, "-m", "codespell_lib", *names], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stdout + found.stderr


def test_gradients_are_with_respect_to_something() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {match.group()}"
        for path in texts()
        if path != Path(__file__)
        for match in BY.finditer(path.read_text(encoding="utf8"))
    ]
    assert found == []
