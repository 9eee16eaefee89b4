"""Imports of the Python package point one way: between its packages by layers, and between modules without circles."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2] / "python/sheetbend"
# Lowest first; a package imports from layers below its own. "" is the package's __init__.py.
LAYERS = (
    ("errors", "moved", "version", "_core", "_ceres"),
    ("arrays", "files", "optional"),
    ("mesh", "quantities", "result"),
    ("recording", "scene", "statistics"),
    ("look", "motion", "objects"),
    ("experiment",),
    ("jax", "problem", "report", "torch"),
    ("minimum",),
    ("doubts", "textile"),
    ("fitting", "pictures"),
    ("gripped", "page", "pesto", "plot"),
    ("", "config"),
    ("cli",),
)
Sources = Mapping[str, str]  # text by path below the package


def sources() -> Sources:
    return {str(p.relative_to(ROOT)): p.read_text() for s in ("*.py", "*.pyi") for p in ROOT.rglob(s)}


def module(path: str) -> str:
    name = path.rpartition(".")[0].replace("/", ".")
    return "" if name == "__init__" else name.removesuffix(".__init__")


def unit(name: str) -> str:
    """The package that a module belongs to; __main__.py starts the command line, and counts as a part of it."""
    first = name.partition(".")[0]
    return "cli" if first == "__main__" else first


@cache
def statements(text: str) -> list[ast.Import | ast.ImportFrom]:
    return [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]


def imported(path: str, text: str, modules: set[str]) -> Iterator[str]:
    """Modules of the package that a file imports anywhere: at its top, in functions, for annotations."""
    here = module(path).split(".") if module(path) else []
    for node in statements(text):
        if isinstance(node, ast.Import):
            yield from (a.name.partition(".")[2] for a in node.names if unit(a.name) == "sheetbend")
        if isinstance(node, ast.ImportFrom):
            if node.level:
                up = node.level - path.endswith("__init__.py")
                base = [*here[: len(here) - up], *filter(None, [node.module])]
            elif unit(node.module or "") == "sheetbend":
                base = (node.module or "").split(".")[1:]
            else:
                continue
            source = ".".join(base)
            for a in node.names:
                name = f"{source}.{a.name}".lstrip(".")
                yield name if name in modules else source


def arrows(files: Sources) -> dict[str, set[str]]:
    modules = {module(path) for path in files}
    return {module(path): set(imported(path, text, modules)) - {module(path)} for path, text in files.items()}


def against_layers(files: Sources) -> list[str]:
    layer = {name: k for k, names in enumerate(LAYERS) for name in names}
    return [
        f"{a or 'sheetbend'} imports {b or 'sheetbend'}"
        for a, others in sorted(arrows(files).items())
        for b in sorted(others)
        if unit(a) != unit(b) and layer[unit(a)] <= layer[unit(b)]
    ]


def circles(files: Sources) -> list[str]:
    """Modules that import themselves through others."""
    left = arrows(files)
    while done := {a for a, others in left.items() if not others & left.keys()}:
        left = {a: others for a, others in left.items() if a not in done}
    while first := {a for a in left if not any(a in others for others in left.values())}:
        left = {a: others for a, others in left.items() if a not in first}
    return sorted(left)


def test_every_unit_has_a_layer() -> None:
    units = {unit(module(path)) for path in sources()}
    named = [name for names in LAYERS for name in names]
    assert units - set(named) == set() and len(named) == len(set(named))
    assert len(LAYERS) <= 13
    assert len({u for u in units if (ROOT / u / "__init__.py").exists()}) <= 26


def test_imports_point_down() -> None:
    assert against_layers(sources()) == []


def test_no_circle_between_modules() -> None:
    assert circles(sources()) == []


def test_a_planted_import_upward_is_seen() -> None:
    """At the top, in a function, and for annotations alone."""
    for plant in (
        "from ..fitting import fit\n",
        "def late():\n    from ..fitting.fit import fit\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..fitting.fit import Fit\n",
        "import sheetbend.fitting.fit\n",
    ):
        found = against_layers({**sources(), "scene/planted.py": plant})
        assert [f.split(" ")[0] for f in found] == ["scene.planted"]


def test_a_planted_circle_is_seen() -> None:
    planted = {"scene/one.py": "from .two import b\n", "scene/two.py": "def f():\n    from .one import a\n"}
    assert circles({**sources(), **planted}) == ["scene.one", "scene.two"]
