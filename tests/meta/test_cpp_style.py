"""The C++ sources follow the formatter and a short list of the linter."""

from __future__ import annotations

import json
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("core", "adjoint", "python/bindings", "tests/cpp", "tests/instructions", "experiments/cpp")
BUILD = ROOT / "build" / "wheel"
DIAGNOSTICS = (
    "--extra-arg=-Wno-error",
    "--extra-arg=-w",
)  # those are of the compiler, and gcc has other names for them


def test_formatted() -> None:
    sources = [str(p) for top in FOLDERS for p in sorted((ROOT / top).rglob("*")) if p.suffix in (".h", ".cpp")]
    assert len(sources) > 300
    done = subprocess.run(["clang-format", "--dry-run", "--Werror", *sources], capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stderr[-2000:]}\nFix: clang-format -i FILE"


def own_units() -> list[str]:
    """What the library and the modules are compiled from, but for what CMake writes, what is compiled once per
    instruction set, and rollouts over other scalars than double: the same headers, for a minute and a half."""
    entries = json.loads((BUILD / "compile_commands.json").read_text())
    files = {str((Path(e["directory"]) / e["file"]).resolve()) for e in entries}
    mine = [str(ROOT / top) for top in ("core", "adjoint", "python/bindings")]
    again = re.compile(r"kernel_table\.cpp$|/instances_(?!double)")
    return sorted(f for f in files if f.startswith(tuple(mine)) and not again.search(f))


def lint(unit: str) -> str:
    done = subprocess.run(
        ["clang-tidy", "-p", str(BUILD), "--quiet", *DIAGNOSTICS, unit], capture_output=True, text=True, cwd=ROOT
    )
    return "" if done.returncode == 0 else done.stdout + done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.skipif(not (BUILD / "compile_commands.json").exists(), reason="./test builds what the linter reads")
def test_passes_the_linter() -> None:
    units = own_units()
    assert len(units) > 40
    with ThreadPoolExecutor(2) as pool:
        assert "".join(pool.map(lint, units)) == ""
