"""Includes of the C++ sources only point left (scene -> solver -> tape -> adjoint -> loss -> optimizer), and in no
circle."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from os.path import normpath, relpath
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
    "core/packs": {"core/scalar", "core/constraints", "core/contact", "core/scene", "core/element", "core/threads"},
    "core/blocks": {"core/scalar", "core/constraints", "core/element", "core/packs"},
    "core/points": {"core/scalar"},
    "core/linear": {"core/scalar", "core/element", "core/packs", "core/blocks"},
    "core/solver": {
        "core/scalar",
        "core/constraints",
        "core/contact",
        "core/scene",
        "core/element",
        "core/packs",
        "core/blocks",
        "core/linear",
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
    "adjoint/element": {"core/scalar", "core/constraints", "core/scene", "core/element"},
    "adjoint/packs": {"core/constraints", "core/scene", "core/packs", "core/threads", "adjoint/element"},
    "adjoint/blocks": {"core/constraints", "core/blocks", "adjoint/element"},
    "adjoint/contact": {"core/contact", "core/packs"},
    "adjoint/solver": {"core/solver", "adjoint/element", "adjoint/blocks", "adjoint/contact"},
    "adjoint/step": {"core/step", "adjoint/element", "adjoint/packs", "adjoint/solver"},
    "adjoint/tape": {"core/scalar", "core/solver", "core/rollout", "adjoint/step"},
    "adjoint/rollout": {"core/scalar", "core/solver", "core/rollout", "adjoint/step", "adjoint/tape"},
    "adjoint/equilibrium": {"core/scalar", "core/equilibrium", "adjoint/element", "adjoint/solver", "adjoint/step"},
    "adjoint/observe": {
        "core/scalar",
        "core/contact",
        "core/step",
        "core/rollout",
        "core/equilibrium",
        "adjoint/rollout",
        "adjoint/equilibrium",
    },
    "adjoint/fit": {
        "core/scalar",
        "core/threads",
        "core/rollout",
        "adjoint/rollout",
        "adjoint/equilibrium",
        "adjoint/observe",
    },
    "adjoint/library": {
        "core/constraints",
        "core/scene",
        "core/solver",
        "core/rollout",
        "adjoint/tape",
        "adjoint/rollout",
        "adjoint/equilibrium",
        "adjoint/observe",
        "adjoint/fit",
    },
    "adjoint/library/sheetbend": set(),  # public headers, which know nothing else of the library
}
Sources = Mapping[str, str]  # text by path
FOREIGN = {
    "pybind11": set(),
    "Python.h": set(),
    "torch": set(),
    "ceres": {"adjoint/fit/ceres_fit.cpp", "adjoint/library/sheetbend/residuals.h"},
}
"""Libraries that core and adjoint do not know, and the files that may."""


def sources() -> Sources:
    files = (p for folder in ("core", "adjoint") for p in (ROOT / folder).rglob("*") if p.suffix in (".h", ".cpp"))
    return {p.relative_to(ROOT).as_posix(): p.read_text() for p in files}


def folder_of(path: str) -> str:
    return path.rpartition("/")[0]


def included(path: str, text: str, files: Sources) -> list[str]:
    """What a file includes of ours: by its path from the root, or from the file's own folder."""
    found = re.findall(r'^\s*#\s*include\s+"([^"]+)"', text, re.M)
    beside = [normpath(f"{folder_of(path)}/{name}") for name in found]
    return [near if name not in files and near in files else name for name, near in zip(found, beside, strict=True)]


def against_layers(files: Sources) -> list[str]:
    """Includes that point right; every file of ours that is included must be there, and its folder in `ALLOWED`."""
    wrong = []
    for path, text in sorted(files.items()):
        here = folder_of(path)
        for name in included(path, text, files):
            if name not in files:
                wrong.append(f"{path} includes {name}, which is no file")
            elif folder_of(name) != here and folder_of(name) not in ALLOWED.get(here, set()):
                wrong.append(f"{path} includes {name}")
    return wrong


def circles(files: Sources) -> list[str]:
    """Files that include themselves through others."""
    left = {path: set(included(path, text, files)) for path, text in files.items()}
    while done := {path for path, others in left.items() if not others & left.keys()}:
        left = {path: others for path, others in left.items() if path not in done}
    while first := left.keys() - {name for others in left.values() for name in others}:
        left = {path: others for path, others in left.items() if path not in first}
    return sorted(left)


def foreign(files: Sources) -> list[str]:
    """Includes of libraries that core and adjoint must not know."""
    return [
        f"{path} includes {library}"
        for path, text in sorted(files.items())
        for library, users in FOREIGN.items()
        if path not in users and re.search(rf"^\s*#\s*include\s+[<\"]{library}", text, re.M)
    ]


def test_every_folder_says_what_it_may_include() -> None:
    assert {folder_of(path) for path in sources()} == set(ALLOWED)


def test_the_order_of_folders_has_no_circle() -> None:
    """Headers of two folders could include each other in turn without any circle between files."""
    left = dict(ALLOWED)
    while done := {folder for folder, others in left.items() if not others & left.keys()}:
        left = {folder: others for folder, others in left.items() if folder not in done}
    assert left == {}


def test_includes_point_left() -> None:
    assert against_layers(sources()) == []


def test_no_circle_between_files() -> None:
    assert circles(sources()) == []


def test_core_and_adjoint_know_no_python() -> None:
    assert foreign(sources()) == []


def some_header(folder: str) -> str:
    return next(path for path in sorted(sources()) if folder_of(path) == folder and path.endswith(".h"))


@pytest.mark.parametrize(
    ("here", "there"),
    [
        ("core/scene/planted.h", "core/solver"),
        ("core/solver/planted.cpp", "adjoint/solver"),
        ("core/solver/planted.h", "core/equilibrium"),
        ("adjoint/observe/planted.h", "adjoint/fit"),
        ("core/new/planted.h", "core/scalar"),
    ],
)
def test_a_planted_include_to_the_right_is_seen(here: str, there: str) -> None:
    """By its path from the root or from the file's own folder."""
    header = some_header(there)
    for name in (header, relpath(header, folder_of(here))):
        planted = {here: f'#pragma once\n  #  include "{name}"  // why\n'}
        assert against_layers({**sources(), **planted}) == [f"{here} includes {header}"]


def test_a_planted_include_of_nothing_is_seen() -> None:
    here, there = "core/scalar/planted.h", "core/scalar/nothing.h"
    found = against_layers({**sources(), here: f'#include "{there}"\n'})
    assert found == [f"{here} includes {there}, which is no file"]


def test_a_planted_circle_is_seen() -> None:
    one, two = "core/solver/one.h", "core/solver/two.h"
    planted = {one: f'#include "{two}"\n', two: '#include "one.h"\n', "core/solver/user.h": f'#include "{one}"\n'}
    assert against_layers({**sources(), **planted}) == []
    assert circles({**sources(), **planted}) == [one, two]


@pytest.mark.parametrize("library", FOREIGN)
def test_a_planted_library_is_seen(library: str) -> None:
    planted = {"core/scene/planted.h": f"#include <{library}>\n"}
    assert foreign({**sources(), **planted}) == [f"core/scene/planted.h includes {library}"]


def test_optional_packages_are_imported_lazily() -> None:
    """Only the packages that need them (torch, jax, cli, config) import heavy dependencies at their top."""
    heavy = {"scipy", "torch", "jax", "matplotlib", "rich", "typer", "pydantic", "trimesh", "threadpoolctl"}
    offenders = []
    for path in (ROOT / "python/sheetbend").rglob("*.py"):
        part = path.relative_to(ROOT / "python/sheetbend").parts[0]
        if part in ("torch", "jax", "cli", "config"):
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
