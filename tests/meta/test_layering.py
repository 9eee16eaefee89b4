"""Includes and imports only point left: scene -> solver -> tape -> adjoint -> loss -> optimizer."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# What a folder may include, itself apart.
ALLOWED = {
    "core/scalar": set(),
    "core/threads": set(),
    "core/constraints": {"core/scalar"},
    "core/contact": {"core/scalar"},
    "core/scene": {"core/scalar", "core/constraints", "core/contact"},
    "core/element": {"core/scalar", "core/constraints"},
    "core/packs": {"core/scalar", "core/constraints", "core/scene", "core/element", "core/threads"},
    "core/blocks": {"core/scalar", "core/constraints", "core/element", "core/packs"},
    "core/points": {"core/scalar"},
    "core/solver": {
        "core/scalar",
        "core/constraints",
        "core/contact",
        "core/scene",
        "core/element",
        "core/packs",
        "core/blocks",
        "core/points",
        "core/threads",
    },
    "core/step": {
        "core/scalar",
        "core/constraints",
        "core/contact",
        "core/scene",
        "core/packs",
        "core/points",
        "core/threads",
        "core/solver",
    },
    "core/rollout": {"core/scalar", "core/solver", "core/step"},
    "core/equilibrium": {
        "core/scalar",
        "core/constraints",
        "core/scene",
        "core/element",
        "core/solver",
        "core/step",
        "core/rollout",
    },
    "adjoint/element": {"core/scalar", "core/scene", "core/element"},
    "adjoint/packs": {"core/constraints", "core/scene", "core/packs", "core/threads", "adjoint/element"},
    "adjoint/blocks": {"core/constraints", "core/blocks", "adjoint/element"},
    "adjoint/contact": {"core/contact"},
    "adjoint/solver": {"core/solver", "adjoint/element", "adjoint/blocks", "adjoint/contact"},
    "adjoint/step": {"core/step", "adjoint/element", "adjoint/packs", "adjoint/solver"},
    "adjoint": {
        "core/scalar",
        "core/constraints",
        "core/scene",
        "core/element",
        "core/packs",
        "core/blocks",
        "core/solver",
        "core/equilibrium",
        "core/step",
        "core/rollout",
        "core/threads",
        "adjoint/element",
        "adjoint/packs",
        "adjoint/blocks",
        "adjoint/step",
    },
    "adjoint/fit": {"adjoint", "core/scalar", "core/threads", "core/solver"},
    "adjoint/library": {"adjoint", "core/constraints", "core/scene", "core/solver"},
    "adjoint/library/sheetbend": set(),  # public headers, which know nothing else of the library
}
SOURCES = sorted(p for folder in ("core", "adjoint") for p in (ROOT / folder).rglob("*") if p.suffix in (".h", ".cpp"))


def folder_of(path: str) -> str:
    return path.rpartition("/")[0]


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_includes_point_left(path: Path) -> None:
    here = folder_of(str(path.relative_to(ROOT)))
    assert here in ALLOWED, f"{here} is a new folder: say what it may include"
    for included in re.findall(r'#include "([^"]+)"', path.read_text()):
        there = folder_of(included)
        assert there == here or there in ALLOWED[here], f"{path.name} in {here} must not include {included}"


@pytest.mark.parametrize("library", ["pybind11", "ceres", "Python.h", "torch"])
def test_core_and_adjoint_know_no_python(library: str) -> None:
    allowed = {"ceres": {"ceres_fit.cpp"}}.get(library, set())
    users = [p.name for p in SOURCES if re.search(rf"#include <{library}", p.read_text()) and p.name not in allowed]
    assert users == []


def test_optional_packages_are_imported_lazily() -> None:
    """Only the packages that need them (torch, cli, config) import heavy dependencies at their top."""
    heavy = {"scipy", "torch", "matplotlib", "rich", "typer", "pydantic", "trimesh"}
    offenders = []
    for path in (ROOT / "python/sheetbend").rglob("*.py"):
        part = path.relative_to(ROOT / "python/sheetbend").parts[0]
        if part in ("torch", "cli", "config"):
            continue
        for node in ast.parse(path.read_text()).body:
            names = (
                [a.name for a in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else []
            )
            offenders += [(path.name, n) for n in names if n.partition(".")[0] in heavy]
    assert offenders == []
