"""What commands print of names and texts from files: as they stand, and nothing that steers the terminal."""

from __future__ import annotations

import io
import json
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from rich.table import Table
from rich.text import Text
from sheetbend.cli import simulate
from sheetbend.cli.screen import Screen, heading
from test_written_files import ROPE, config, run

__all__ = ["config"]  # the fixture


@pytest.mark.parametrize("folder", ["out[/y]", "[bold]out", "[link=x]", "a:smile:b"])
def test_brackets_in_folders_stay(config: Path, folder: str) -> None:
    config.write_text(ROPE.replace("[parameters.rope_EI]", '[parameters.rope_EI]\n[output]\nfigures = "none"'))
    result = run("fit", config, "--output", folder)
    assert result.exit_code == 0, result.output
    assert f"written to {folder}" in result.output and (config.parent / folder / "fit.json").is_file()
    assert run("simulate", config, "--output", folder).exit_code == 0


def test_brackets_in_texts_stay(config: Path) -> None:
    config.write_text(ROPE.replace('name = "swing"', 'name = "swing"\nabout = "[/red] of [bold]rope"'))
    for command in ("info", "simulate", "fit"):
        result = run(command, config)
        assert result.exit_code == 0 and "[/red] of [bold]rope" in result.output


def test_brackets_in_markers_stay(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0], ["[/y]"]).save(path)
    result = run("info", path)
    assert result.exit_code == 0 and "[/y]" in result.output and "\\" not in result.output


@pytest.mark.parametrize("text", ["\x1b[2J", "\x9b31m", "\x07", "\u202eevil", "a\rb"])
def test_a_configuration_holds_no_control_characters(config: Path, text: str) -> None:
    for where in ("about", "name"):
        config.write_text(f"[experiment]\n{where} = {json.dumps(text)}\n" + ROPE)
        result = run("simulate", config)
        assert result.exit_code == 2 and text not in result.output
    config.write_text(f"{json.dumps(text)} = 1\n{ROPE}")
    result = run("simulate", config, "--json")
    assert result.exit_code == 2 and text not in result.output
    assert "control character" in json.loads(result.stdout)["error"]["problem"]


def test_metadata_do_not_steer_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0], metadata={"attribution": "by \x1b[31mme\x07\u202e"}).save(path)
    result = run("info", path)
    assert result.exit_code == 0 and r"by \x1b[31mme\x07\u202e" in result.output


def test_a_screen_spells_out_what_steers_and_keeps_its_own_colors() -> None:
    out = io.StringIO()
    screen = Screen()
    screen.file = out
    table = Table("a\x1bb")
    table.add_row("[red]\x9b")
    screen.print(table, "[bold]x\x1b]0;title\x07", Text("c\x1b"))
    heading(screen, "[/n]", "about\x00")
    assert "\x1b" not in out.getvalue() and r"a\x1bb" in out.getvalue() and r"[red]\x9b" in out.getvalue()
    assert r"[bold]x\x1b]0;title" in out.getvalue() and "[/n]  about\\x00" in out.getvalue()
    colored = io.StringIO()
    screen = Screen()
    screen._color_system, screen.file = 1, colored  # type: ignore[assignment]
    heading(screen, "name\x1b[31m", "")
    assert "name\\x1b[31m" in colored.getvalue()


def test_a_defect_keeps_the_json_line(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError("of ours")

    monkeypatch.setattr(simulate, "motion_of", broken)
    result = run("simulate", config, "--json")
    assert result.exit_code == 1 and "of ours" in json.loads(result.stdout)["error"]["message"]
    assert "Traceback" in result.stderr


@pytest.mark.parametrize(
    ("reader", "arguments", "code", "said"),
    [
        ("head -c 0", [], 0, ""),
        ("head -c 0", ["--json"], 0, ""),
        ("cat > /dev/full", [], 0, ""),
        (None, [], 0, "stdout cannot be written"),
        (None, ["--json"], 2, "stdout cannot be written"),
    ],
)
def test_a_stdout_that_nobody_reads_or_that_is_full(
    config: Path, reader: str | None, arguments: list[str], code: int, said: str
) -> None:
    """The command goes on and writes its results: a fit may have taken hours."""
    config.write_text(ROPE + '[output]\nfigures = "none"\n')
    command = shlex.join([sys.executable, "-m", "sheetbend", "fit", str(config), "-o", "out", *arguments])
    where = "> /dev/full" if reader is None else f"| {reader}"
    done = subprocess.run(
        ["bash", "-c", f"{command} {where}; exit ${{PIPESTATUS[0]}}"], cwd=config.parent, capture_output=True, text=True
    )
    assert done.returncode == code, done.stderr
    assert (config.parent / "out" / "fit.json").is_file() and not (config.parent / "out" / "journal.sqlite").exists()
    assert said in done.stderr and "Traceback" not in done.stderr and "Exception ignored" not in done.stderr
