"""`import sheetbend` is light."""

from __future__ import annotations

import subprocess
import sys


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_loads_neither_torch_nor_scipy() -> None:
    loaded = run(
        "import sys, sheetbend; heavy = ('torch', 'scipy', 'matplotlib', 'rich', 'typer', 'pydantic', 'trimesh'); "
        "print([m for m in heavy if m in sys.modules])"
    )
    assert loaded == "[]"


def test_costs_little_more_than_numpy() -> None:
    """At most 0.1 s of processor time; the smallest of several runs, since other work may share the machine."""
    code = "import time, numpy; t = time.process_time(); import sheetbend; print(time.process_time() - t)"
    assert min(float(run(code)) for _ in range(5)) <= 0.1


def test_ceres_is_not_loaded_before_a_fit_asks_for_it() -> None:
    assert run("import sys, sheetbend; print('sheetbend._ceres' in sys.modules)") == "False"
