"""`import sheetbend` is light, and so is everything that it offers; each public name is found when it is asked for."""

from __future__ import annotations

import ast
import py_compile
import subprocess
import sys
from pathlib import Path

import pytest
import sheetbend as sb

TIMED = """
import sys, time
import numpy
start = time.process_time()
import sheetbend
print(time.process_time() - start, "sheetbend.fitting.fit" in sys.modules, "sheetbend._core" in sys.modules)
"""


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_takes_at_most_a_tenth_of_a_second_over_numpy() -> None:
    """Measured: 0.009 s of processor time; 0.6 s when each public name was imported at once."""
    seconds, *loaded = run(TIMED).split()
    assert float(seconds) < 0.1 and loaded == ["False", "False"]


def test_every_public_name_is_found() -> None:
    assert set(sb._MODULES) == set(sb.__all__) <= set(dir(sb)) and len(dir(sb)) == len(set(dir(sb)))
    found: dict[str, object] = {}
    exec("from sheetbend import *", found)
    assert all(found[name] is getattr(sb, name) is not None for name in sb.__all__)
    with pytest.raises(AttributeError, match="no attribute 'ropes'"):
        sb.ropes  # noqa: B018


def test_type_checkers_see_the_same_names_from_the_same_modules() -> None:
    tree = ast.parse(Path(sb.__file__).read_text(encoding="utf-8"))
    seen = next(node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    imports = [node for node in seen.body if isinstance(node, ast.ImportFrom)]
    assert {a.asname: node.module or "" for node in imports for a in node.names if a.name == a.asname} == sb._MODULES


def test_a_package_without_its_sources_works(tmp_path: Path) -> None:
    """As programs that are frozen into one file have it."""
    here = Path(sb.__file__).parent
    for name in ("__init__.py", "moved.py", "version.py", "errors.py"):
        py_compile.compile(str(here / name), str(tmp_path / "sheetbend" / f"{name}c"), doraise=True)
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import sheetbend as sb; "
    assert "__init__.pyc <class 'sheetbend.errors.SceneError'>" in run(code + "print(sb.__file__, sb.SceneError)")


@pytest.mark.parametrize("notebook", ["IPython", "marimo", ""])
def test_notebooks_show_recordings(notebook: str) -> None:
    script = f"import sys, types; sys.modules[{notebook!r}] = types.ModuleType('n'); import sheetbend as sb; "
    assert run(script + "print(hasattr(sb.Recording, '_repr_html_'))") == str(notebook != "")


def test_nothing_public_loads_torch_or_scipy() -> None:
    loaded = run(
        "import sys; from sheetbend import *; "
        "heavy = ('torch', 'jax', 'scipy', 'matplotlib', 'rich', 'typer', 'pydantic', 'trimesh', 'threadpoolctl'); "
        "print([m for m in heavy if m in sys.modules])"
    )
    assert loaded == "[]"


def test_nothing_public_loads_more_than_itself_and_the_standard_library_beside_numpy() -> None:
    added = run(
        "import sys, numpy; before = set(sys.modules); from sheetbend import *; "
        "print(sorted({m.split('.')[0] for m in set(sys.modules) - before} - sys.stdlib_module_names))"
    )
    assert added in ("['sheetbend']", "['numpy', 'sheetbend']")


def test_ceres_is_not_loaded_before_a_fit_asks_for_it() -> None:
    assert run("import sys; from sheetbend import *; print('sheetbend._ceres' in sys.modules)") == "False"
