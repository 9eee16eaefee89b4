"""A recording of a configuration: its file read, and its keys given to who owns them."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import ConfigError, RecordingError
from ..experiment.experiment import Experiment
from ..recording.cloud import Cloud
from ..recording.recording import Recording
from ..recording.unit_doubt import extent, unit_doubt
from ..recording.windows import Window
from ..scene.scene import Scene
from .schema import RecordingSection

TAKEN = (
    {"file", "cloud", "mend", "name", "frames", "hidden", "fit", "held_out"}  # the recording
    | {"ropes", "leave_out", "tools", "values", "finer", "force", "max_gap", "driven_motion"}  # its scene
    | {"marker", "here", "grids", "offsets"}  # the places of its markers
)
"""Keys of [[recording]] that the configuration itself turns into something. Every other goes under its own name to the
reader or to `Experiment`, so that none is forgotten."""
OF_READER = set(inspect.signature(Recording.load).parameters) - {"path"}


def read(section: RecordingSection, folder: Path, path: str) -> Recording:
    """The recording that drives and holds the scene, its file read with the keys that the reader takes, and its frames
    chosen.

    Raises:
        ConfigError: the file does not exist, cannot be read, or does not hold the frames; or its unit is in doubt.
    """
    if section.cloud == section.file:
        return read_cloud(section, folder, path, section.name)
    return _read(section, folder, path, "file", section.name, section.cloud is None)


def read_cloud(section: RecordingSection, folder: Path, path: str, name: str | None) -> Cloud:
    """The cloud that the recording is compared with, under the name of the recording."""
    found = _read(section, folder, path, "cloud", name, True)
    assert isinstance(found, Cloud)
    return found


def _read(section: RecordingSection, folder: Path, path: str, key: str, name: str | None, compared: bool) -> Recording:
    """The file of a key, "file" or "cloud"; `frames` are those of what is compared."""
    file = folder / getattr(section, key)
    if not file.exists():
        fix = "give a file relative to the configuration's folder"
        raise ConfigError(f"{path}.{key}", "does not exist", str(file), fix)
    kind, where = (Cloud, f"{path}.cloud") if key == "cloud" else (Recording, path)
    try:
        recording = kind.load(file, **section.model_dump(include=OF_READER))
        if section.mend and key == "file":
            recording = recording.mended()
        if compared and section.frames is not None:
            recording = recording.frames(slice(*section.frames))
        if compared and section.hidden:
            recording = recording.hidden(section.hidden)
    except RecordingError as error:
        field = f"{path}.{key}" if error.field == str(file) else f"{where}.{error.field}"
        raise ConfigError(field, error.problem, error.got, error.fix) from error
    doubt = unit_doubt(recording) if section.units is None else None
    if doubt is not None:
        problem = f"are not said, and in the unit that was read the markers are {extent(recording):.4g} m apart"
        raise ConfigError(f"{path}.units", problem, None, f'give units = "{doubt}", or "m" if it is so')
    return replace(recording, name=name or recording.name)


def windows(section: RecordingSection) -> tuple[Window | None, Window | None]:
    """What is fitted and what is held out, s."""
    return _window(section.fit), _window(section.held_out)


def fields_of_experiment(section: RecordingSection) -> dict[str, Any]:
    """The fields of `Experiment` that the keys of a recording give as they stand, and its windows."""
    plain = section.model_dump(exclude=TAKEN | OF_READER)
    fit, held_out = windows(section)
    return {**plain, "fit": fit, "held_out": held_out}


def start_time(section: RecordingSection, recording: Recording) -> float:
    """Recording time at which the scene starts, s."""
    if section.start_time is not None:
        return section.start_time
    return section.fit[0] if section.fit is not None else float(recording.times[0])


def offset_names(
    path: str, section: RecordingSection, scene: Scene
) -> dict[str, tuple[str | None, str | None, str | None]]:
    """Per marker the quantities that are added to its offset, None for none.

    Raises:
        ConfigError: they are not three, or one is no quantity of the scene.
    """
    return {marker: _three(f"{path}.offsets.{marker}", names, scene) for marker, names in section.offsets.items()}


def check_names_used(path: str, section: RecordingSection, experiment: Experiment) -> None:
    """Names that a recording uses exist.

    Raises:
        ConfigError: a marker with offsets, or the quantity of the clock, does not.
    """
    for marker in section.offsets:
        if marker not in experiment.recording.markers:
            fix = f"name some of: {', '.join(experiment.recording.markers)}"
            raise ConfigError(f"{path}.offsets.{marker}", "is not a marker of the recording", marker, fix)
    if section.time_offset is not None and section.time_offset not in experiment.scene.quantities:
        fix = f'declare [scene.quantities.{section.time_offset}] with unit = "s"'
        raise ConfigError(f"{path}.time_offset", "names no quantity", section.time_offset, fix)


def _three(path: str, names: list[str], scene: Scene) -> tuple[str | None, str | None, str | None]:
    if len(names) != 3:
        raise ConfigError(path, "must be three names", names, 'give [tangent, normal, tangent x normal], "" for none')
    for name in names:
        if name and name not in scene.quantities:
            raise ConfigError(path, "names no quantity", name, f"declare [scene.quantities.{name}]")
    a, b, c = (name or None for name in names)
    return a, b, c


def _window(given: list[float] | None) -> Window | None:
    return None if given is None else (given[0], given[1])
