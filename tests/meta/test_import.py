"""`import sheetbend` is light."""

from __future__ import annotations

import subprocess
import sys


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_loads_neither_torch_nor_scipy() -> None:
    loaded = run(
        "import sys, sheetbend; "
        "heavy = ('torch', 'jax', 'scipy', 'matplotlib', 'rich', 'typer', 'pydantic', 'trimesh', 'threadpoolctl'); "
        "print([m for m in heavy if m in sys.modules])"
    )
    assert loaded == "[]"


def test_loads_only_itself_and_the_standard_library_beside_numpy() -> None:
    """Which takes 0.05 to 0.1 s of processor time; not asserted, since it depends on the machine."""
    added = run(
        "import sys, numpy; before = set(sys.modules); import sheetbend; "
        "print(sorted({m.split('.')[0] for m in set(sys.modules) - before} - sys.stdlib_module_names))"
    )
    assert added in ("['sheetbend']", "['numpy', 'sheetbend']")


def test_ceres_is_not_loaded_before_a_fit_asks_for_it() -> None:
    assert run("import sys, sheetbend; print('sheetbend._ceres' in sys.modules)") == "False"
