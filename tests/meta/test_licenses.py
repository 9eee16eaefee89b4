"""A wheel carries the license of every library whose headers are compiled into it."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# By the first folder of an include: the texts, and what each must say.
TEXTS = {
    "Eigen": {"eigen-MPL-2.0.txt": "Mozilla Public License", "eigen-Intel.txt": "Intel Corporation"},
    "pybind11": {"pybind11-BSD-3-Clause.txt": "Redistribution and use in source and binary forms"},
    "ceres": {"ceres-BSD-3-Clause.txt": "Google Inc. All rights reserved"},
    "glog": {"glog-BSD-3-Clause.txt": "Google Inc."},
    "nlohmann": {"nlohmann-json-MIT.txt": "THE SOFTWARE IS PROVIDED"},
}


def libraries() -> set[str]:
    """First folders of what the compiled sources include from elsewhere."""
    sources = [
        p for f in ("core", "adjoint", "python/bindings") for p in (ROOT / f).rglob("*") if p.suffix in (".h", ".cpp")
    ]
    found = {name for p in sources for name in re.findall(r"#include <([\w.]+)/", p.read_text())}
    assert len(sources) > 50 and "Eigen" in found
    return found - {"sheetbend"}  # the library's own public headers


def test_every_library_has_its_texts() -> None:
    assert libraries() == set(TEXTS)
    for texts in TEXTS.values():
        for name, words in texts.items():
            assert words in (ROOT / "licenses" / name).read_text(), name


def test_the_wheel_takes_them() -> None:
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["license-files"]
    taken = {p.relative_to(ROOT).as_posix() for pattern in patterns for p in ROOT.glob(pattern)}
    wanted = {"LICENSE", *(f"licenses/{name}" for texts in TEXTS.values() for name in texts)}
    assert wanted <= taken


def test_the_installed_package_has_them() -> None:
    try:
        files = distribution("sheetbend").files or []
    except PackageNotFoundError:
        pytest.skip("sheetbend is on the path, but not installed")
    held = {f.as_posix() for f in files if ".dist-info/" in f.as_posix()}
    for texts in TEXTS.values():
        for name in texts:
            assert any(f.endswith(f"licenses/licenses/{name}") for f in held), name
