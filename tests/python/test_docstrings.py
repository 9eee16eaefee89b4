"""The examples in the docstrings of public names run, and print what they say."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

ROOT = Path(__file__).resolve().parents[2]
WITH_EXAMPLES = [name for name in sorted(sb.__all__) if ">>>" in (inspect.getdoc(getattr(sb, name)) or "")]


def test_the_functions_that_readers_begin_with_have_examples() -> None:
    assert {"cloth", "equilibrium", "fit", "rollout", "rope", "simulate", "Parameter", "Recording"} <= {*WITH_EXAMPLES}


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_in_docstrings_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("scipy")
    monkeypatch.chdir(ROOT)
    finder = doctest.DocTestFinder(recurse=False)
    (example,) = finder.find(getattr(sb, name), name, globs={"sb": sb, "np": np})
    assert example.examples and doctest.DocTestRunner().run(example).failed == 0
