"""The tutorial of a rope that is dragged over a table runs as it stands."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import matplotlib
import pytest
import sheetbend as sb
from commands import run

PAGE = Path(__file__).resolve().parents[2] / "docs/tutorials/dragged_rope.md"


@pytest.mark.slow
def test_the_tutorial_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its scripts, its configuration, its command and its table."""
    text = PAGE.read_text()
    (make,) = re.findall(r"```python\n(.*?)```", text, re.S)
    (configuration,) = re.findall(r"```toml\n(.*?)```", text, re.S)
    drafting, command = re.findall(r"```sh\nsheetbend (.*?)\n```", text)
    monkeypatch.chdir(tmp_path)
    exec(compile(make, "tutorial", "exec"), {})
    Path("drag.toml").write_text(configuration)
    result = run(*command.split())
    assert result.exit_code == 0, result.output
    found = sb.FitResult.load("out/drag/fit.json")
    for name, true in {"table_friction": 0.3, "rope_EI": 3e-4, "rope_drag_linear": 0.03}.items():
        assert found[name].lower < true < found[name].upper, name
    (rows,) = re.findall(r"```text\n(.*?)```", text, re.S)
    for row in rows.splitlines()[1:]:
        name, value, half = row.split()[:3]
        assert found[name].value == pytest.approx(float(value), abs=0.3 * float(half)), name
        assert found[name].half_width == pytest.approx(float(half), rel=0.2), name
    assert found["table_friction"].moved == pytest.approx(0.3 - 0.28, abs=0.01)
    assert found.recordings[0].held_out < 2.0e-3
    matplotlib.use("Agg")
    runpy.run_path(str(PAGE.with_suffix(".py")))
    assert Path("dragged_rope.png").stat().st_size > 10_000
    for words in (drafting, "fit draft.toml --output draft"):
        assert run(*words.split()).exit_code == 0
    drafted = sb.FitResult.load("draft/fit.json")
    for name, words, unit in (("table_friction", "friction of ", 1.0), ("rope_EI", r"EI of \(", 1e-4)):
        value, half = (unit * float(number) for number in re.findall(words + r"([\d.]+) ± ([\d.]+)", text)[0])
        assert drafted[name].value == pytest.approx(value, abs=0.3 * half), name
        assert drafted[name].half_width == pytest.approx(half, rel=0.2), name
