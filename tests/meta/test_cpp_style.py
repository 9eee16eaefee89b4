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


def own_units() -> dict[str, tuple[set[Path], set[str]]]:
    """What the library and the modules are compiled from, with the options that headers depend on, in three parts that
    the linter reads as one file each: most of its time goes to the headers that they share. Names in the unnamed
    namespaces of a part have to differ, or the linter calls them ambiguous; the solver has some of the others'.
    CMakeLists.txt compiles units together within the same parts.

    Left out is what CMake writes, what is compiled once per instruction set, and rollouts over other scalars than
    double, which read the same headers for a minute and a half."""
    again = re.compile(r"/(kernel_table|cold_kinds)\.cpp$|/instances_(?!double)")
    parts: dict[str, tuple[set[Path], set[str]]] = defaultdict(lambda: (set(), set()))
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        for file in sources_of((Path(entry["directory"]) / entry["file"]).resolve()):
            place = file.relative_to(ROOT).as_posix() if file.is_relative_to(ROOT) else ""
            if place.startswith(("core/", "adjoint/", "python/bindings/")) and not again.search(place):
                units, headers = parts[re.match(r"core/solver|python|", place)[0]]
                units.add(file)
                headers.update(re.findall(r" (-[DI]\S+|-isystem \S+)", entry["command"]))
    return parts


def lint(units: set[Path], headers: set[str], folder: Path) -> str:
    together = folder / f"with_{min(units).name}"
    together.write_text("".join(f'#include "{unit}"\n' for unit in sorted(units)))
    options = ["-std=c++20", "-w", *" ".join(sorted(headers)).split()]
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
    parts = own_units()
    assert sum(len(units) for units, _ in parts.values()) > 60
    with ThreadPoolExecutor(2) as pool:
        found = "".join(pool.map(lambda part: lint(*part, tmp_path), parts.values()))
    assert not found, found
