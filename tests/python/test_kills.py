"""Fits that are killed at random moments and resumed end at the bits of uninterrupted ones: one fit of each kind here,
more of them by `python tools/kills.py`."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from sheetbend.minimum.by_ceres import has_ceres

PROGRAM = Path(__file__).resolve().parents[2] / "tools" / "kills.py"
KINDS = ["ceres", "scipy", "profiles", "gripped"]


@pytest.fixture(scope="module")
def told() -> dict[str, str]:
    """What the program says of each kind, after one start."""
    kinds = [kind for kind in KINDS if kind != "ceres" or has_ceres()]
    command = [sys.executable, PROGRAM, "--kinds", *kinds, "--fits", "1", "--kills", "2", "--seed", "1", "--size", "1"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    lines = dict(re.findall(r"^(\w+) 1: (.*)$", done.stdout, re.M))
    assert list(lines) == kinds, done.stderr
    return lines


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_killed_fits_end_at_the_same_bits(told: dict[str, str], kind: str) -> None:
    if kind == "ceres" and not has_ceres():
        pytest.skip("built without Ceres")
    (kept,) = re.findall(r"kept after kills \[(\d+), (\d+)\]: the same bits", told[kind])
    assert int(kept[-1]) > 0, told[kind]  # not all before the first evaluation was kept
