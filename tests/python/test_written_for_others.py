"""What the command line leaves for other programs: JSON schemas, a table of parameters, notices instead of warnings."""

from __future__ import annotations

import csv
import io
import json
import logging
import re
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli import app as cli
from sheetbend.cli.notices import noticed
from sheetbend.config.json_schemas import SCHEMAS
from sheetbend.report.parameter_table import parameter_table
from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = [c.callback.__name__ for c in cli.app.registered_commands if not c.hidden]


@pytest.fixture(scope="module")
def result() -> sb.FitResult:
    times, scene = np.arange(20) / 100, sb.rope(0.4, 8, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
    seen = scene.ropes["rope"].particles[3::2]
    solver = sb.Solver(h=1 / 200)
    x = sb.simulate(scene, times, solver).positions[:, seen]
    model = sb.rope(0.4, 8, density=0.05, EI=2e-3, clamp_start=(1, 0, 0))
    markers = [sb.on_particle(int(p)) for p in seen]
    e = sb.Experiment(scene=model, recording=sb.Recording(x, times), markers=markers, solver=solver)
    return sb.fit(e, parameters=["rope_EI"], refine=False, profiles=False, beginnings=False).result


class TestSchemas:
    @pytest.mark.parametrize("kind", ["scene", "ropes", "fabric", "fit"])
    def test_is_one_and_is_printed(self, kind: str) -> None:
        done = CliRunner().invoke(cli.app, ["schema", kind])
        assert done.exit_code == 0, done.output
        told = json.loads(done.stdout)
        assert told == SCHEMAS[kind]()
        pytest.importorskip("jsonschema").Draft202012Validator.check_schema(told)

    @pytest.mark.parametrize("path", sorted(ROOT.glob("experiments/*/*.toml")), ids=lambda path: path.stem)
    def test_shipped_configurations_are_valid(self, path: Path) -> None:
        validate = pytest.importorskip("jsonschema").Draft202012Validator
        content = tomllib.loads(path.read_text())
        kind = "ropes" if "gripped_rope" in content else "scene"
        assert [e.message for e in validate(SCHEMAS[kind]()).iter_errors(content)] == []
        wrong = content | {"experiment_2": {}}
        assert len(list(validate(SCHEMAS[kind]()).iter_errors(wrong))) == 1

    def test_fit_json_is_valid(self, result: sb.FitResult) -> None:
        validator = pytest.importorskip("jsonschema").Draft202012Validator(SCHEMAS["fit"]())
        told = json.loads(json.dumps(result.to_dict()))
        assert [e.message for e in validator.iter_errors(told)] == []
        assert set(told) <= set(SCHEMAS["fit"]()["properties"])
        for name, part in (("cost", "large"), ("parameters", {"EI": {"value": 1}}), ("format", "other")):
            assert list(validator.iter_errors(told | {name: part})), name

    def test_is_written(self, tmp_path: Path) -> None:
        done = CliRunner().invoke(cli.app, ["schema", "--output", str(tmp_path / "s.json")])
        assert done.exit_code == 0 and json.loads((tmp_path / "s.json").read_text())["title"]


def test_parameters_are_a_table(result: sb.FitResult) -> None:
    (e,) = result.estimates
    e = replace(e, in_all=2.5)
    open_ended = replace(e, name="=cmd", upper=None, in_all=None, words='of, "many" words')
    table = parameter_table(replace(result, estimates=(e, open_ended)))
    first, second = csv.DictReader(io.StringIO(table))
    assert float(first["value"]) == e.value and float(first["lower"]) == e.lower and first["unit"] == e.unit
    assert float(first["in_all"]) == 2.5 and second["in_all"] == "" and first["verdict"] == e.verdict
    assert second["parameter"] == "'=cmd" and second["upper"] == "" and second["words"] == open_ended.words


class TestNotices:
    def test_warnings_and_records_are_told_once_without_a_place(self) -> None:
        told: list[str] = []
        with noticed(told.append):
            for _ in range(2):
                warnings.warn("one is doubtful", UserWarning, stacklevel=1)
                logging.getLogger("sheetbend.motion.rollout").warning("%s: two", "scene")
            warnings.warn("old name", DeprecationWarning, stacklevel=1)
            logging.getLogger("sheetbend").info("not worth it")
        assert told == ["one is doubtful", "scene: two"]
        assert logging.getLogger("sheetbend").handlers == []

    def test_a_command_prints_no_raw_warning(self, tmp_path: Path) -> None:
        """A cloth on crossed diagonals bends less than it should, of which the library warns."""
        (tmp_path / "cloth.toml").write_text(
            """
[experiment]
name = "cloth"
[[scene.cloth]]
density = 0.1
warp = 50.0
shear = 10.0
bending = 1e-5
[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.2
nx = 4
ny = 4
pattern = "crossed"
"""
        )
        with warnings.catch_warnings(record=True) as raw:
            warnings.simplefilter("always")
            done = CliRunner().invoke(cli.app, ["info", str(tmp_path / "cloth.toml")])
        assert done.exit_code == 0, done.output
        assert done.stderr.count("warning cloth: ") == 1 and "resist with as little as" in " ".join(done.stderr.split())
        assert "UserWarning" not in done.output and [w for w in raw if issubclass(w.category, UserWarning)] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_every_help_has_an_example(command: str) -> None:
    done = CliRunner().invoke(cli.app, [command, "--help"], env={"COLUMNS": "200", "TERM": "dumb"})
    assert done.exit_code == 0
    assert re.search(rf"Example: sheetbend {command} ", done.output), done.output


def test_shells_complete_commands() -> None:
    done = CliRunner().invoke(cli.app, ["--help"], env={"COLUMNS": "200"})
    assert "--install-completion" in done.output
