"""The documentation site builds without a warning: no broken link, no name of the API that does not exist."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sheetbend as sb

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocstrings_handlers.python")
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


def test_every_public_name_has_its_place(site: Path) -> None:
    shown = set(
        re.findall(r'<h2 id="sheetbend\.(\w+)"', "".join(p.read_text() for p in site.rglob("api/*/index.html")))
    )
    assert sorted(set(sb.__all__) - {"KINDS", "laws", "mesh", "plot"} - shown) == []


def test_pages_ask_nothing_of_another_host(site: Path) -> None:
    asked = {
        (page.name, link)
        for page in site.rglob("*.html")
        for link in re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(https?://[^"]+)"', page.read_text())
    }
    assert asked == set()
