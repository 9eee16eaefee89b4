"""Mutated files of every format, each reader in a process of its own: see `fuzz.py`, which also runs for longer."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

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
    "cloud": 300,
    "solid": 300,
    "outline": 200,
    "fabric": 200,
    "fabric_tests": 100,
    "many": 300,
    "many_table": 300,
}
NEEDS = {"mesh": "trimesh", "solid": "meshio", "outline": "contourpy"}


def lines_of(command: list[object]) -> tuple[int, dict[str, dict[str, Any]]]:
    """The exit status of a run and what it says of each reader."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert told, done.stderr
    return done.returncode, {one["reader"]: one for one in told}


@pytest.fixture(scope="module")
def fed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What the program says of each reader, after one start."""
    readers = [f"{name}:{cases}" for name, cases in CASES.items() if find_spec(NEEDS.get(name, "sheetbend"))]
    command = [sys.executable, PROGRAM, *readers, "--seed", "5", "--keep", tmp_path_factory.mktemp("fuzzed")]
    return lines_of(command)[1]


@pytest.mark.slow
@pytest.mark.parametrize("reader", CASES)
def test_no_mutated_file_does_harm(fed: dict[str, dict[str, Any]], reader: str) -> None:
    pytest.importorskip(NEEDS.get(reader, "sheetbend"))
    told = fed[reader]
    assert "ended" not in told and told["cases"] == CASES[reader] and told["findings"] == [], told
    assert told["outcomes"].get("read", 0) > 0  # else the mutations are too wild to get anywhere


def test_the_program_finds_what_it_looks_for(tmp_path: Path) -> None:
    """Another exception, too much memory, too much time."""
    code = """
import sys
sys.path.insert(0, {folder!r})
import fuzz, fuzz_targets, mutations
reads = {{
    "foreign": lambda path: {{}}[path],
    "memory": lambda path: fuzz.np.ones(3 * 10**8),
    "time": lambda path: [None for _ in iter(int, 1)],
}}
fuzz.SECONDS = 0.2
for name, read in reads.items():
    fuzz.TARGETS[name] = fuzz_targets.Target(lambda folder: [{{"a.csv": b"1"}}], read, mutations.mutated)
sys.argv[1:] = [*reads, "--cases", "1", "--keep", {keep!r}]
fuzz.main()
"""
    text = code.format(folder=str(PROGRAM.parent), keep=str(tmp_path))
    status, told = lines_of([sys.executable, "-c", text])
    assert status == 1 and told["time"] == {"reader": "time", "ended": signal.SIGPROF}
    for kind, words in (("foreign", "KeyError"), ("memory", "MemoryError")):
        (finding,) = told[kind]["findings"]
        assert words in finding, finding
    kept = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file())
    assert kept == ["foreign_0_1/a.csv", "memory_0_1/a.csv", "time/a.csv"]
