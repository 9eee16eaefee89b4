"""The list of slow tests (tests/conftest.py) names tests that exist."""

from __future__ import annotations

import ast
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]


def names(body: list[ast.stmt]) -> set[str]:
    found = set()
    for node in body:
        if isinstance(node, ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.ClassDef):
            found |= {f"{node.name}::{name}" for name in names(node.body)}
    return found


def test_every_slow_test_exists() -> None:
    listed = (TESTS / "slow_tests.txt").read_text().split()
    assert listed == sorted(set(listed))
    files = {name.partition("::")[0] for name in listed}
    known = {f"{f}::{n}" for f in files for n in names(ast.parse((TESTS.parent / f).read_text()).body)}
    assert set(listed) - known == set(), "\nFix: take them out of tests/slow_tests.txt, or rename them there"
