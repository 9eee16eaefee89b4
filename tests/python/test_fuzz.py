"""Mutated files of every format, each reader in a process of its own: see `fuzz.py`, which also runs for longer."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).with_name("fuzz.py")
CASES = {
    "csv": 1500,
    "mocap": 1000,
    "npz": 1500,
    "npy": 500,
    "pickle": 2000,
    "c3d": 2000,
    "json": 1000,
    "toml": 400,
    "fit": 1000,
    "mesh": 400,
    "curve": 150,
    "trc": 500,
    "poses": 400,
    "scene": 400,
    "forces": 500,
    "journal": 150,
}


@pytest.mark.slow
@pytest.mark.parametrize("reader", CASES)
def test_no_mutated_file_does_harm(tmp_path: Path, reader: str) -> None:
    if reader == "mesh":
        pytest.importorskip("trimesh")
    command = [sys.executable, PROGRAM, reader, "--seed", "5", "--cases", str(CASES[reader]), "--keep", tmp_path]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    left = [str(path) for path in tmp_path.rglob("*") if path.is_file()]
    assert done.returncode == 0, f"{done.returncode}: {done.stdout}{done.stderr}, see {left}"
    told = json.loads(done.stdout)
    assert told["cases"] == CASES[reader] and told["findings"] == []
    assert told["outcomes"].get("read", 0) > 0  # else the mutations are too wild to get anywhere


def test_the_program_finds_what_it_looks_for(tmp_path: Path) -> None:
    """Another exception, too much memory, too much time."""
    code = """
import sys
sys.path.insert(0, {folder!r})
from pathlib import Path
import fuzz, fuzz_targets, mutations
reads = {{
    "foreign": lambda path: {{}}[path],
    "memory": lambda path: fuzz.np.ones(3 * 10**8),
    "time": lambda path: [None for _ in iter(int, 1)],
}}
fuzz.SECONDS = 0.2
fuzz.TARGETS["csv"] = fuzz_targets.Target(
    lambda folder: [{{"a.csv": b"1"}}], reads[sys.argv[1]], mutations.mutated
)
sys.argv[1:] = ["csv", "--cases", "1", "--keep", {keep!r}]
fuzz.main()
"""
    for kind, status in (("foreign", 1), ("memory", 1), ("time", -27)):
        text = code.format(folder=str(PROGRAM.parent), keep=str(tmp_path / kind))
        done = subprocess.run([sys.executable, "-c", text, kind], capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        assert [path.name for path in (tmp_path / kind).rglob("*") if path.is_file()] == ["a.csv"]
