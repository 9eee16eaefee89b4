"""Keys of [[recording]] reach who owns them: the configuration, the reader, or the experiment; none is dropped."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load, parse
from sheetbend.config.recordings import OF_READER, TAKEN
from sheetbend.config.schema import RecordingSection

KEYS = set(RecordingSection.model_fields)
OF_READER_SAID: dict[str, Any] = {"units": "cm"}
OF_EXPERIMENT_SAID: dict[str, Any] = {
    "start_time": 0.05,
    "static": True,
    "start": "equilibrium",
    "predict": "mean",
    "sigma": 2e-3,
    "driven_sigma": 1e-4,
    "axes": "xz",
    "radius": 0.5,
    "loss": "huber",
    "loss_scale": 3.0,
    "shooting": 0.1,
    "time_offset": "late",
}
TOML = """
[experiment]
name = "swing"
[scene]
pin = ["top"]
[[scene.particles]]
name = "top"
positions = [[0.0, 0.0, 1.0]]
[[scene.particles]]
name = "bob"
positions = [[0.0, 0.0, 0.0]]
mass = 1.0
[[scene.constraints]]
kind = "distance"
particles = [["bob", "top"]]
[scene.quantities.late]
unit = "s"
value = 0.0
[[recording]]
file = "swing.csv"
[[recording.marker]]
marker = "m0"
particle = "bob"
"""


def said(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value).lower()


def written(folder: Path, line: str) -> Path:
    times = np.linspace(0.0, 0.2, 5)
    rows = [f"{t},0,0,{z}" for t, z in zip(times, -np.square(times), strict=True)]
    (folder / "swing.csv").write_text("\n".join(["time,m0_x,m0_y,m0_z", *rows]) + "\n")
    path = folder / "swing.toml"
    path.write_text(TOML.replace('file = "swing.csv"\n', f'file = "swing.csv"\n{line}\n'))
    return path


def test_every_option_of_a_reader_can_be_said() -> None:
    options = set(inspect.signature(sb.Recording.load).parameters) - {"path"}
    assert options == OF_READER == set(OF_READER_SAID)
    assert options <= KEYS


def test_every_key_has_one_owner() -> None:
    assert TAKEN <= KEYS and not TAKEN & OF_READER
    forwarded = KEYS - TAKEN - OF_READER
    assert forwarded == set(OF_EXPERIMENT_SAID)
    assert forwarded <= {field.name for field in dataclasses.fields(sb.Experiment)}


@pytest.mark.parametrize("name", OF_READER_SAID)
def test_a_key_of_the_reader_arrives(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, Any] = {}
    really = sb.Recording.load

    def spied(path: Path, **options: Any) -> sb.Recording:
        told.update(options)
        return really(path, **options)

    monkeypatch.setattr(sb.Recording, "load", spied)
    load(written(tmp_path, f"{name} = {said(OF_READER_SAID[name])}"))
    assert told[name] == OF_READER_SAID[name]


@pytest.mark.parametrize("name", OF_EXPERIMENT_SAID)
def test_a_key_of_the_experiment_arrives(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, Any] = {}

    def spied(**fields: Any) -> None:
        told.update(fields)
        raise sb.InputError("field", "was seen", None, "go on")

    # sheetbend.config.build is a function, too
    monkeypatch.setattr(importlib.import_module("sheetbend.config.build"), "Experiment", spied)
    path = written(tmp_path, f"{name} = {said(OF_EXPERIMENT_SAID[name])}")
    with pytest.raises(sb.ConfigError, match="was seen"):
        load(path)
    assert told[name] == OF_EXPERIMENT_SAID[name]


def test_hidden_parts_are_not_seen(tmp_path: Path) -> None:
    (e,) = load(written(tmp_path, "hidden = [[0.04, 0.09], [0.15, 0.25]]")).experiments
    assert e.fitted().mask[:, 0].tolist() == [True, False, True, False, False]
    with pytest.raises(sb.ConfigError, match=r"recording\[0\].hidden\[1\]: holds no frame"):
        load(written(tmp_path, "hidden = [[0.04, 0.09], [0.3, 0.4]]"))
    with pytest.raises(sb.ConfigError, match=r"recording\[0\].hidden: leaves nothing seen"):
        load(written(tmp_path, "hidden = [[0.0, 0.3]]"))


def test_an_unknown_key_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(sb.ConfigError) as told:
        parse(written(tmp_path, "sigmma = 1e-3"))
    assert told.value.field == "recording[0].sigmma" and "did you mean 'sigma'" in told.value.fix
