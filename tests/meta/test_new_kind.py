"""A kind of constraint is added in three places: header, registry, test cases. Its kernels are compiled alone."""

from __future__ import annotations

import importlib.util
import json
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.quantities.kind_reference import page
from sheetbend.scene import rest_values

ROOT = Path(__file__).resolve().parents[2]
TOY = ROOT / "tests" / "new_kind"
pytestmark = pytest.mark.slow


def run(command: list[str], **options: object) -> str:
    done = subprocess.run(command, capture_output=True, text=True, **options)  # type: ignore[call-overload]
    assert done.returncode == 0, done.stdout + done.stderr
    return str(done.stdout)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with the kind added, and configured."""
    for tool in ("cmake", "nm", "ninja"):
        if shutil.which(tool) is None:
            pytest.skip(f"there is no {tool}")
    copy = tmp_path_factory.mktemp("tree")
    for file in ("CMakeLists.txt", "pyproject.toml"):
        shutil.copy(ROOT / file, copy)
    for folder in (
        "core",
        "adjoint",
        "cmake",
        "python/bindings",
        "tests/cpp",
        "tests/instructions",
        "experiments/bench",
    ):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__", "*.npz"))

    shutil.copy(TOY / "tet_volume.h", copy / "core/constraints")
    registry, cases = copy / "core/constraints/registry.h", copy / "tests/cpp/support/cases.h"
    text = registry.read_text()
    tether = '#include "core/constraints/tether.h"\n'
    text = text.replace(tether, '#include "core/constraints/tet_volume.h"\n' + tether)
    registry.write_text(text.replace(">;", ",  //\n    TetVolume>;", 1))
    before = "// The kinds that a test of every kind goes through."
    cases.write_text(cases.read_text().replace(before, (TOY / "row_of_cases.h").read_text() + "\n" + before))

    options = ["-DSHEETBEND_TESTS=ON", "-DSHEETBEND_KERNELS=portable", f"-DPython_EXECUTABLE={sys.executable}"]
    options.append("-DCMAKE_CXX_COMPILER_LAUNCHER=env")  # where a launcher may be a cache, every unit stays alone
    done = subprocess.run(
        ["cmake", "-G", "Ninja", "-S", str(copy), "-B", str(copy / "build"), *options], capture_output=True, text=True
    )
    if "GTest" in done.stderr:
        pytest.skip("there is no GoogleTest")
    assert done.returncode == 0, done.stderr
    return copy


def compiled(tree: Path, name: str, *more: str) -> Path:
    """The object of the source that ends with `name`, compiled as the build would, but as fast as the compiler can."""
    commands = json.loads((tree / "build/compile_commands.json").read_text())
    (entry,) = [c for c in commands if c["file"].endswith(name)]
    command = shlex.split(entry["command"])
    at = command.index("-o") + 1
    command[at] = str(tree / (name.replace("/", "_") + ".o"))
    run([*command, *more, "-O0"], cwd=entry["directory"])
    return Path(command[at])


def test_its_kernels_are_found_by_the_tables(tree: Path) -> None:
    for part in ("packs", "blocks"):
        unit = compiled(tree, f"kinds/adjoint/{part}/TetVolume.cpp")
        table = compiled(tree, f"adjoint/{part}/kernel_table.cpp")
        kind = "Kernels<sheetbend_portable::TetVolume>::all"
        assert [line for line in run(["nm", "-C", str(table)]).splitlines() if kind in line and " U " in line]
        assert [line for line in run(["nm", "-C", str(unit)]).splitlines() if kind in line and " U " not in line]


def test_it_passes_the_ladder(tree: Path) -> None:
    found = compiled(tree, "tests/cpp/test_constraints.cpp", "-DSHEETBEND_TEST_KIND=TetVolume")
    program = tree / "ladder"
    run(["c++", str(found), "-o", str(program), "-lgtest_main", "-lgtest", "-lpthread"])
    said = run([str(program), "--gtest_filter=Constraint.*"])
    assert "/tet_volume" in said and "[  PASSED  ] 10 tests" in said


@pytest.fixture
def known(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's kinds come from the copy's registry."""
    pybind11 = pytest.importorskip("pybind11")
    module = tree / f"kinds_alone{sysconfig.get_config_var('EXT_SUFFIX')}"
    include = [f"-I{tree}", f"-I{pybind11.get_include()}", f"-I{sysconfig.get_path('include')}"]
    sources = [str(tree / "python/bindings/core_kinds.cpp"), str(TOY / "module.cpp")]
    run(["c++", "-std=c++20", "-O0", "-shared", "-fPIC", *include, *sources, "-o", str(module)])
    spec = importlib.util.spec_from_file_location("kinds_alone", module)
    assert spec is not None and spec.loader is not None
    alone = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(alone)
    monkeypatch.setitem(sb.KINDS, "tet_volume", alone.constraint_kinds()["tet_volume"])
    monkeypatch.setattr(rest_values._core, "rest_values", alone.rest_values)


def test_python_knows_its_units_and_measures_its_rest_value(known: None) -> None:
    scene = sb.Scene()
    scene.add_particles([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]], 1.0)
    name = scene.add_constraints("tet_volume", [[0, 1, 2, 3]], compliance=1e-3, damping=2.0)
    assert np.array_equal(scene.group(name)[0].rest, [[1.0]])
    assert scene.quantities["tet_volume_compliance"].unit == "m^5/N"
    assert scene.quantities["tet_volume_damping"].unit == "N s/m^5"
    assert "## `tet_volume`\n\nC [m^3] is the signed volume of a tetrahedron" in page()
