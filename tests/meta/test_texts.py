"""What the repository's texts must not hold, and what they must."""

from __future__ import annotations

import ast
import inspect
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import sheetbend as sb
from sheetbend.quantities.kind_reference import page

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".md", ".py", ".h", ".cpp", ".toml", ".txt", ".json", ".sh", ".cmake", ""}


def tracked() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def test_no_path_of_a_machine_and_no_registry_host() -> None:
    pattern = re.compile(
        "|".join(
            [
                r"/wor" + "k/",
                r"/home/[a-z]",
                r"/roo" + "t/",
                r"pypi\.or" + "g",
                r"registry\.npm" + "js",
                r"deb\.deb" + "ian",
            ]
        )
    )
    found = [
        str(p.relative_to(ROOT)) for p in tracked() if p.suffix in TEXT and pattern.search(p.read_text(errors="ignore"))
    ]
    assert found == []


def test_the_page_of_constraints_says_what_their_headers_say() -> None:
    command = "run: python -m sheetbend.quantities.kind_reference docs/constraints.md"
    assert (ROOT / "docs" / "constraints.md").read_text() == page(), command


def test_experiments_have_one_configuration_each() -> None:
    folders = sorted(p for p in (ROOT / "experiments").iterdir() if p.is_dir() and list(p.glob("*.toml")))
    assert {f.name for f in folders} >= {"beam", "wires", "pendulum", "twin"}
    assert [f.name for f in folders if [t.name for t in f.glob("*.toml")] != [f"{f.name}.toml"]] == []


def test_copied_recordings_keep_their_license() -> None:
    measured = [
        p for p in (ROOT / "experiments").rglob("*.npz") if "SYNTHETIC" not in p.with_suffix(".json").read_text()
    ]
    folders = {p.parent for p in measured}
    assert [str(f.relative_to(ROOT)) for f in folders if not (f / "LICENSE.source").exists()] == []


TEXTS = [
    name
    for pattern in ("*.md", "docs/**/*.md", "experiments/*/README.md", "adjoint/*.md")
    for name in sorted(ROOT.glob(pattern))
]


def blocks(language: str) -> list[object]:
    return [
        pytest.param(block, id=f"{text.relative_to(ROOT)}-{i}")
        for text in TEXTS
        for i, block in enumerate(re.findall(rf"```{language}\n(.*?)```", text.read_text(), re.S))
    ]


EXTRAS = {
    r"^(?:from|import) sheetbend\.torch": "torch",
    r"^(?:from|import) sheetbend\.jax": "jax",
    r"^import sheetbend\.pesto": "pesto",
    r"^[^#\n]*(?:\bread_mesh\(|\bread_solid\(|^sheetbend .*\.(?:obj|ply|stl)\b)": "mesh",
    r"^sheetbend .*--mesh usd": "usd",
    r"^sheetbend .*--dask": "cluster",
}


@pytest.mark.parametrize("page", [t for t in TEXTS if t.parent.name in ("docs", "tutorials") or t.name == "README.md"])
def test_pages_name_the_extra_that_their_code_needs(page: Path) -> None:
    """The page on garments did not, and its first command failed in a fresh environment."""
    text = page.read_text()
    code = "\n".join(re.findall(r"```(?:python|py|sh)\n(.*?)```", text, re.S))
    needed = {extra for pattern, extra in EXTRAS.items() if re.search(pattern, code, re.M)}
    assert {e for e in needed if not re.search(rf"\[(?:\w+,)*{e}(?:,\w+)*\]|`{e}`", text)} == set()


@pytest.mark.slow
@pytest.mark.parametrize("block", blocks("python"))
def test_code_in_the_texts_runs(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "experiments").symlink_to(ROOT / "experiments")
    if "rope_2/" in block:  # stands for a reader's own data set
        small = ["--ropes", "2", "--train", "2", "--eval", "1", "--seconds", "0.5"]
        subprocess.run([sys.executable, "experiments/gripped_ropes/make_data.py", ".", *small], check=True)
    exec(compile(block, "README", "exec"), {"__name__": "readme"})


@pytest.mark.parametrize("block", blocks("py"))
def test_code_that_needs_data_of_the_reader_uses_names_that_exist(block: str) -> None:
    """Blocks that are marked `py` cannot run here: they stand on a reader's own recording, or on an extra."""
    used = [node for node in ast.walk(ast.parse(block)) if isinstance(node, ast.Attribute)]
    assert [
        n.attr for n in used if isinstance(n.value, ast.Name) and n.value.id == "sb" and not hasattr(sb, n.attr)
    ] == []
    calls = [node for node in ast.walk(ast.parse(block)) if isinstance(node, ast.Call)]
    for call in calls:
        if (
            isinstance(call.func, ast.Attribute)
            and isinstance(call.func.value, ast.Name)
            and call.func.value.id == "sb"
        ):
            takes = inspect.signature(getattr(sb, call.func.attr)).parameters
            every = any(p.kind is p.VAR_KEYWORD for p in takes.values())
            assert every or [k.arg for k in call.keywords if k.arg is not None and k.arg not in takes] == []


def commands() -> list[object]:
    """Every line of a block of shell commands that calls the command line."""
    return [
        pytest.param(line, id=f"{text.relative_to(ROOT)}: {' '.join(line.split()[:4])}")
        for text in TEXTS
        for block in re.findall(r"```sh\n(.*?)```", text.read_text(), re.S)
        for line in block.replace("\\\n", " ").splitlines()
        if line.startswith("sheetbend ")
    ]


@pytest.mark.parametrize("line", commands())
def test_commands_in_the_texts_are_understood(line: str) -> None:
    """Their options and arguments exist; what they do is for the tests of each command."""
    typer = pytest.importorskip("typer")
    command = typer.main.get_command(pytest.importorskip("sheetbend.cli.app").app)
    _, name, *arguments = shlex.split(line, comments=True)
    command.commands[name].make_context(name, arguments)  # refuses what it does not know


@pytest.mark.parametrize("block", blocks("toml"))
def test_configurations_in_the_texts_load(block: str, tmp_path: Path) -> None:
    config = pytest.importorskip("sheetbend.config")
    (tmp_path / "text.toml").write_text(block)
    if "[experiment]" not in block:
        tomllib.loads(block)
        return
    if 'file = "drag.csv"' in block:  # whose recording test_tutorial_contact.py makes
        config.parse_any(tmp_path / "text.toml")
        return
    if "[[gripped_rope]]" in block:
        assert config.parse_any(tmp_path / "text.toml").gripped_rope
        return
    motion = sb.simulate(sb.rope(1.0, 10, density=0.05, EI=1e-3), [k / 20 for k in range(21)])
    for file in ("swing.npz", "drag.npz"):
        sb.Recording(positions=motion.positions, times=motion.times).save(tmp_path / file)
    sb.Recording(motion.positions[:, :1], motion.times, markers=("pointer",)).save(tmp_path / "door.npz")
    study = config.load(tmp_path / "text.toml")
    assert study.experiments and study.parameters


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: str(text.relative_to(ROOT)))
def test_links_lead_somewhere(text: Path) -> None:
    links = [
        link.partition("#")[0]
        for link in re.findall(r"\]\(([^)\s]+)\)", text.read_text())
        if not re.match(r"https?://|#", link)
    ]
    assert [link for link in links if not (text.parent / link).exists()] == []


def test_the_glossary_tells_how_every_function_is_named() -> None:
    """The table of patterns names each function of sheetbend, and nothing that is not there."""
    _, table = (ROOT / "docs/glossary.md").read_text().split("## How names are made")
    told = {name for name in re.findall(r"`([a-z_]+)`", table) if not name.endswith("_")}
    functions = {name for name in sb.__all__ if name[0].islower()} - {"laws", "mesh", "plot"}
    assert functions - told == set()
    assert {name for name in told - functions if not hasattr(sb.Scene, name)} == set()
