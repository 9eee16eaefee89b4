"""The C++ sources follow the formatter and a short list of the linter."""

from __future__ import annotations

import json
import re
import subprocess
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("core", "adjoint", "python/bindings", "tests/cpp", "tests/instructions", "experiments/cpp")
BUILD = ROOT / "build" / "wheel"


def test_formatted() -> None:
    sources = [str(p) for top in FOLDERS for p in sorted((ROOT / top).rglob("*")) if p.suffix in (".h", ".cpp")]
    assert len(sources) > 300
    done = subprocess.run(["clang-format", "--dry-run", "--Werror", *sources], capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stderr[-2000:]}\nFix: clang-format -i FILE"


def sources_of(unit: Path) -> list[Path]:
    """The unit, or the units that CMake has put together in it."""
    return list(map(Path, re.findall(r'#include "(.+)"', unit.read_text()))) if unit.parent.name == "Unity" else [unit]


def own_units() -> dict[tuple[str, ...], set[Path]]:
    """What the library and the modules are compiled from, by folder and by the options that its headers depend on.

    Left out is what CMake writes, what is compiled once per instruction set, and rollouts over other scalars than
    double, which read the same headers for a minute and a half."""
    mine = [ROOT / top for top in ("core", "adjoint", "python/bindings")]
    again = re.compile(r"kernel_table\.cpp$|/instances_(?!double)")
    units = defaultdict(set)
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        for file in sources_of((Path(entry["directory"]) / entry["file"]).resolve()):
            if any(file.is_relative_to(top) for top in mine) and not again.search(str(file)):
                units[str(file.parent), *re.findall(r" (-[DI]\S+|-isystem \S+)", entry["command"])].add(file)
    return units


def lint(headers: list[str], units: list[Path], folder: Path) -> str:
    """Reads all units of a folder as one, since most of the time goes to the headers that they share. Names in their
    unnamed namespaces have to differ, or the linter calls them ambiguous."""
    together = folder / f"with_{units[0].name}"
    together.write_text("".join(f'#include "{unit}"\n' for unit in units))
    options = ["-std=c++20", "-w", *" ".join(headers).split()]
    done = subprocess.run(
        ["clang-tidy", f"--config-file={ROOT / '.clang-tidy'}", "--quiet", str(together), "--", *options],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    return "" if done.returncode == 0 else done.stdout + done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.skipif(not (BUILD / "compile_commands.json").exists(), reason="./test builds what the linter reads")
def test_passes_the_linter(tmp_path: Path) -> None:
    units = own_units()
    assert sum(map(len, units.values())) > 60
    with ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda key: lint(list(key[1:]), sorted(units[key]), tmp_path), units)
        assert "".join(found) == ""
