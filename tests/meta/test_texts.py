"""What the repository's texts must not hold, and what they must."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import sheetbend as sb

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".md", ".py", ".h", ".cpp", ".toml", ".txt", ".json", ".sh", ".cmake", ""}


def tracked() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def test_no_path_of_a_machine_and_no_registry_host() -> None:
    pattern = re.compile("|".join([r"/wor" + "k/", r"/home/[a-z]", r"/roo" + "t/", r"pypi\.or" + "g", r"registry\.npm" + "js", r"deb\.deb" + "ian"]))
    found = [str(p.relative_to(ROOT)) for p in tracked() if p.suffix in TEXT and pattern.search(p.read_text(errors="ignore"))]
    assert found == []


def test_every_constraint_is_documented() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text() + (ROOT / "README.md").read_text()
    assert [kind for kind in sb.KINDS if f"`{kind}`" not in text] == []


def test_experiments_have_one_configuration_each() -> None:
    folders = sorted(p for p in (ROOT / "experiments").iterdir() if p.is_dir() and list(p.glob("*.toml")))
    assert {f.name for f in folders} >= {"beam", "wires", "pendulum", "twin"}
    assert [f.name for f in folders if [t.name for t in f.glob("*.toml")] != [f"{f.name}.toml"]] == []


def test_copied_recordings_keep_their_licence() -> None:
    folders = {p.parent for p in (ROOT / "experiments").rglob("*.npz") if "twin" not in p.parts}
    assert [str(f.relative_to(ROOT)) for f in folders if not (f / "LICENSE.source").exists()] == []


PYTHON_BLOCKS = [
    pytest.param(block, id=f"{name}-{i}")
    for name in ("README.md", "CONTRIBUTING.md")
    for i, block in enumerate(re.findall(r"```python\n(.*?)```", (ROOT / name).read_text() if (ROOT / name).exists() else "", re.S))
]


@pytest.mark.parametrize("block", PYTHON_BLOCKS)
def test_code_in_the_texts_runs(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "experiments").symlink_to(ROOT / "experiments")
    exec(compile(block, "README", "exec"), {"__name__": "readme"})
