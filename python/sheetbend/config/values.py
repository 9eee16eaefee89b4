"""Configurations with other starting values: how a fit is written back, and started from."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..files.whole import write_text
from ..optional import require
from .named_files import named_files
from .schema import Config, ParameterSection, RecordingSection


def with_values(config: Config, values: Mapping[str, float]) -> Config:
    """The configuration starting at the values (by expanded name, as in fit.json), without the `windows` that it
    gives, which are for a start far off; names that it does not fit are left out.

    Shared parameters start at `parameters.NAME.initial`, private ones and modes of stiffness fields at the recordings'
    `values`.
    """
    parameters = dict(config.parameters)
    recordings = [r.model_copy(update={"finer": {}}) if r.finer else r for r in config.recording]
    wind = config.scene.unknown_wind
    fields = {*config.smooth, *(force.name for force in config.scene.unknown_force), *([wind.name] if wind else [])}
    names = [r.name or Path(r.file).stem for r in recordings]
    for name, value in values.items():
        base, _, recording = name.removesuffix("]").partition("[")
        if base not in parameters and any(base.startswith(f"{field}_") for field in fields):  # a mode of a field
            recordings = [
                r.model_copy(update={"values": {**r.values, base: value}}) if recording in ("", own) else r
                for r, own in zip(recordings, names, strict=True)
            ]
            continue
        section = parameters.get(base)
        if section is None or section.tied_to is not None or not math.isfinite(value):
            continue
        value = _inside(section, value)
        if recording and recording in names:
            i = names.index(recording)
            recordings[i] = recordings[i].model_copy(update={"values": {**recordings[i].values, base: value}})
        elif not recording:
            parameters[base] = section.model_copy(update={"initial": value, "finer": None})
    fit = config.fit.model_copy(update={"windows": []}) if isinstance(config.fit.windows, list) else config.fit
    return config.model_copy(update={"parameters": parameters, "recording": recordings, "fit": fit})


def with_finer(config: Config, moved: Mapping[str, float]) -> Config:
    """The configuration with the values of its parameters on a mesh twice as fine: what a refit there moved them by,
    added to the values that they start at."""
    parameters = dict(config.parameters)
    for name, section in config.parameters.items():
        if name in moved and section.initial is not None and section.tied_to is None and math.isfinite(moved[name]):
            finer = _inside(section, section.initial + moved[name])
            parameters[name] = section.model_copy(update={"finer": finer})
    recordings = [_private_finer(config, r, moved) for r in config.recording]
    return config.model_copy(update={"parameters": parameters, "recording": recordings})


def _private_finer(config: Config, recording: RecordingSection, moved: Mapping[str, float]) -> RecordingSection:
    """A recording with the values of its private parameters there."""
    name = recording.name or Path(recording.file).stem
    finer = {
        base: _inside(config.parameters[base], value + moved[f"{base}[{name}]"])
        for base, value in recording.values.items()
        if base in config.parameters and math.isfinite(moved.get(f"{base}[{name}]", math.nan))
    }
    return recording.model_copy(update={"finer": finer}) if finer else recording


def write(config: Config, path: Path, folder: Path) -> None:
    """Write a configuration as TOML with the keys that were set.

    Args:
        folder: what files are relative to now; they are written relative to the new file.

    Raises:
        MissingExtraError: tomli-w is not installed.
    """
    content: dict[str, Any] = config.model_dump(exclude_unset=True, exclude_none=True)
    for table, key in list(named_files(content)):
        table[key] = Path(os.path.relpath(folder / table[key], path.parent)).as_posix()
    write_text(path, require("tomli_w", "cli").dumps(content))


def _inside(section: ParameterSection, value: float) -> float:
    """A value that sits on a bound comes back from its logarithm a rounding error outside."""
    lower = -math.inf if section.lower is None else section.lower
    upper = math.inf if section.upper is None else section.upper
    return float(min(max(value, lower), upper))
