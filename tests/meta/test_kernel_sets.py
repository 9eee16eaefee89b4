"""Which instruction sets a build compiles kernels for (cmake/Kernels.cmake)."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def configure(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    for tool in ("cmake", "ninja"):
        if shutil.which(tool) is None:
            pytest.skip(f"there is no {tool}")
    command = ["cmake", "-G", "Ninja", "-S", str(ROOT), "-B", str(folder), f"-DPython_EXECUTABLE={sys.executable}"]
    return subprocess.run(
        [*command, "-DSHEETBEND_LIBRARY=OFF", "-DSHEETBEND_CERES=OFF", *options], capture_output=True, text=True
    )


def units(folder: Path, *options: str) -> dict[str, str]:
    """What is compiled: the object of each unit, and its command without folders."""
    done = configure(folder, *options)
    assert done.returncode == 0, done.stderr
    found = {}
    for entry in json.loads((folder / "compile_commands.json").read_text()):
        command = shlex.split(entry["command"].replace(str(folder), ""))
        found[command[command.index("-o") + 1]] = " ".join(command)
    return found


def kernels_of(found: dict[str, str], name: str) -> set[str]:
    return {unit for unit in found if f"sheetbend_kernels_{name}" in unit}


@pytest.fixture(scope="module")
def every_set(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return units(tmp_path_factory.mktemp("all"), "-DSHEETBEND_KERNELS=all")


# In the place of processors: what cmake/processor.cpp would say.
@pytest.mark.parametrize("widest", ["v4", "v3", "portable"])
def test_a_build_for_this_machine_compiles_units_of_the_whole_build(
    every_set: dict[str, str], tmp_path: Path, widest: str
) -> None:
    """So every unit that a user's build has is one that the tests have compared."""
    if not kernels_of(every_set, "v3"):
        pytest.skip("there is one instruction set here")
    found = units(tmp_path, f"-DSHEETBEND_WIDEST_KERNELS={widest}")
    assert kernels_of(found, "portable") == kernels_of(every_set, "portable")
    assert bool(kernels_of(found, "v4_hot")) == (widest == "v4")
    assert bool(kernels_of(found, "v3_hot")) == (widest == "v3")
    assert bool(kernels_of(found, "v3_cold")) == (widest != "portable")
    if widest == "portable":
        return  # compiled alone, it takes the quicker kernels
    (chooses,) = [unit for unit in found if unit.endswith("choose.cpp.o")]
    assert [unit for unit, command in found.items() if every_set.get(unit) != command] == [chooses]


def test_the_processor_is_asked(tmp_path: Path) -> None:
    done = configure(tmp_path)
    assert done.returncode == 0, done.stderr
    (told,) = [line for line in done.stdout.splitlines() if line.startswith("-- sheetbend: kernels ")]
    assert told.removeprefix("-- sheetbend: kernels ") in ("portable", "portable, v3", "portable, v4")


def test_another_value_is_refused(tmp_path: Path) -> None:
    done = configure(tmp_path, "-DSHEETBEND_KERNELS=native")
    assert done.returncode != 0 and "SHEETBEND_KERNELS: must be machine, all or portable" in done.stderr
