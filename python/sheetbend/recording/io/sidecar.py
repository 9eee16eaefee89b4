"""The JSON beside a recording: what its numbers mean and where they come from.

    units     text that starts with the length unit of the file, m, cm, mm, in or ft ("mm" or "m, s, N"); default m
    name      what reports call the recording; default: the file's stem
    markers   list of names, for files that have none
    clamped   list of names or indices of driven markers, for files that do not say
    gravity   [x, y, z] in m/s^2, in place of what the file's format says
    rate      frames per second, Hz, for files that hold no times (the first frame is at 0 s); elsewhere metadata

The JSON beside the folder of the file (`train.json` beside `train/`) may give units, clamped, gravity and rate of all
files in the folder. The JSON of a single file takes precedence.

All else is metadata, kept as it stands and in its own units: known values, license, attribution. Text under
`markers` or `clamped` is a remark, kept as `markers_note` and `clamped_note`; units that say more than the
length are kept as `units_note`. `arrays` describes the file, not the recording, and is not kept.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.door import note
from ...files.json_file import check_depth, json_content
from ...files.names import checked_name
from ...files.units import METERS
from ...files.whole import write_text
from ..marker_data import UNNAMED, MarkerData
from ..recording_checks import checked_markers, default_markers, marker_indices

_RESERVED = ("units", "name", "markers", "clamped", "gravity", "arrays")
_OF_A_FOLDER = ("units", "clamped", "gravity", "rate")
_SAME_FRAME = 1e-6  # frame intervals
_FASTEST = 1e15  # Hz: beyond it times of frames coincide


def apply(recording: MarkerData, path: Path, units: str | None, assumed: tuple[str, ...] = ()) -> MarkerData:
    """The recording as read from `path`, in meters, with what the JSON beside it adds.

    Args:
        recording: as the reader gave it, lengths in the unit of the file, which is metadata["units"] where the
            file says it.
        path: the file that was read.
        units: length unit of the file; None takes the JSON's.
        assumed: what the file does not say and the reader assumed ("times", "clamped"): the JSON replaces it.

    Raises:
        RecordingError: the JSON is malformed, disagrees with the file, or the unit is unknown.
    """
    said = beside(path)
    scale = _meters(_units(recording.metadata.get("units"), units, said))
    markers = _markers(recording, said)
    return MarkerData(
        positions=recording.positions * scale,
        times=_times(recording, said) if "times" in assumed else recording.times,
        markers=markers,
        clamped=_clamped(recording, said, markers, "clamped" in assumed),
        name=_name(path, said),
        gravity=said.get("gravity", recording.gravity),
        metadata={k: v for k, v in recording.metadata.items() if k != "units"} | _metadata(said, _reserved(assumed)),
    )


def write(recording: MarkerData, path: Path, assumed: tuple[str, ...] = ()) -> None:
    """Write the JSON beside `path`; `assumed` as in `apply`.

    Raises:
        RecordingError: the metadata use a reserved key or hold what JSON cannot, or the file holds no times and those
            of the recording do not run evenly from 0 s.
    """
    names = {"markers": recording.markers, "clamped": [recording.markers[i] for i in recording.clamped]}
    _write(recording, path, names, assumed)


def write_without_names(cloud: MarkerData, path: Path) -> None:
    """Write the JSON beside a cloud, whose points have no names."""
    _write(cloud, path, {}, ())


def _write(recording: MarkerData, path: Path, names: dict[str, Any], assumed: tuple[str, ...]) -> None:
    reserved = _reserved(assumed)
    taken = [key for key in reserved if key in recording.metadata]
    if taken:
        fix = f"rename it; {', '.join(reserved)} are written from the recording itself"
        raise RecordingError("metadata", "uses a reserved key", taken, fix)
    content = {
        **({} if recording.name == UNNAMED else {"name": recording.name}),
        "units": "m",
        **names,
        **({} if recording.gravity is None else {"gravity": recording.gravity.tolist()}),
        **({"rate": _rate(recording)} if "times" in assumed else {}),
        **recording.metadata,
    }
    try:
        text = json.dumps(content, indent=1, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError) as error:
        fix = "keep plain numbers, text, lists and dicts in metadata"
        raise RecordingError("metadata", "cannot be written as JSON", str(error), fix) from error
    check_depth(path.with_suffix(".json"), content, RecordingError)
    write_text(path.with_suffix(".json"), text + "\n")


def _reserved(assumed: tuple[str, ...]) -> tuple[str, ...]:
    return (*_RESERVED, "rate") if "times" in assumed else _RESERVED


def beside(path: Path) -> dict[str, Any]:
    """What the JSON beside a recording says, and the one beside its folder; nothing where there is none.

    Raises:
        RecordingError: one of them is malformed.
    """
    folder = path.absolute().parent
    of_all = _of_folder(folder) if folder.name else {}
    return {key: of_all[key] for key in _OF_A_FOLDER if key in of_all} | _said(path.with_suffix(".json"))


def _of_folder(folder: Path) -> dict[str, Any]:
    """What the JSON beside a folder says.

    Raises:
        RecordingError: it is malformed; the message names the folder, since the JSON may be meant for something else.
    """
    try:
        return _said(folder.with_name(f"{folder.name}.json"))
    except RecordingError as error:
        problem = f"is read as the JSON of the folder {folder.name} and {error.problem}"
        raise RecordingError(error.field, problem, error.got, error.fix) from error


def _said(path: Path) -> dict[str, Any]:
    note(path)
    if not path.is_file():
        return {}
    content = json_content(path, RecordingError)
    if not isinstance(content, dict):
        fix = 'write {"units": "m", ...}, or move it away'
        raise RecordingError(str(path), "must be a JSON object", type(content).__name__, fix)
    return content


def _name(path: Path, beside: dict[str, Any]) -> str:
    """The name in the JSON, otherwise the file's stem."""
    if "name" in beside:
        return checked_name(f"{path.with_suffix('.json')}: name", beside["name"])
    try:
        return checked_name(str(path), path.stem)
    except RecordingError as error:
        fix = f'{error.fix}: rename the file, or write {{"name": "..."}} into {path.with_suffix(".json").name}'
        raise RecordingError(str(path), f"has a name that {error.problem}", path.stem, fix) from None


def _units(in_file: str | None, given: str | None, beside: dict[str, Any]) -> Any:
    """The file's own unit, else the one that is given, else the JSON's."""
    said = given if given is not None else beside.get("units", in_file or "m")
    if in_file is not None and _meters(said) != METERS[in_file]:
        fix = "leave it out: the file says its unit"
        raise RecordingError("units", f"differ from the file's, {in_file}", said, fix)
    return said


def _meters(units: Any) -> float:
    length = units.split(",")[0].strip() if isinstance(units, str) else None
    if length not in METERS:
        known = ", ".join(METERS)
        fix = f"use one of {known}, in the JSON beside the file or as units="
        raise RecordingError("units", "names no known length unit", units, fix)
    return METERS[length]


def _times(recording: MarkerData, beside: dict[str, Any]) -> Array:
    if "rate" not in beside:
        return recording.times
    return np.arange(len(recording.times)) / rate(beside["rate"])


def rate(told: Any) -> float:
    """The frames per second that the JSON tells, Hz.

    Raises:
        RecordingError: it is no positive number.
    """
    if isinstance(told, bool) or not isinstance(told, int | float) or not 0 < told < _FASTEST:
        raise RecordingError("rate", "must be a positive number", told, "give the frames per second in Hz")
    return float(told)


def _rate(recording: MarkerData) -> float:
    """Frames per second, Hz; 1 for a single frame."""
    times, last = recording.times, float(recording.times[-1])
    rate = float(f"{(len(times) - 1) / last:.12g}") if len(times) > 1 and last > 0 else 1.0
    if not np.abs(times - np.arange(len(times)) / rate).max() <= _SAME_FRAME / rate:
        span = (float(times[0]), float(times[-1]))
        fix = "use shifted and resample first, or save as NPZ or CSV, which hold times"
        raise RecordingError("times", "must run evenly from 0 s in a file that holds none", span, fix)
    return rate


def _markers(recording: MarkerData, beside: dict[str, Any]) -> tuple[str, ...]:
    named = beside.get("markers", [])
    if isinstance(named, str) or not named:
        return recording.markers
    in_file = recording.markers
    names = checked_markers(named, len(in_file))
    if in_file not in (names, default_markers(len(in_file))):
        fix = f"use the file's names, {list(in_file)}, or leave them out"
        raise RecordingError("markers", "in the JSON differ from the file's", named, fix)
    return names


def _clamped(recording: MarkerData, beside: dict[str, Any], markers: tuple[str, ...], assumed: bool) -> tuple[int, ...]:
    said = beside.get("clamped")
    if said is None or isinstance(said, str) or (said == [] and not assumed):
        return recording.clamped
    named = marker_indices("clamped", said, markers)
    if not assumed and recording.clamped and set(named) != set(recording.clamped):
        fix = f"use the file's, {list(recording.clamped)}, or leave them out"
        raise RecordingError("clamped", "in the JSON differs from the file's", said, fix)
    return named if assumed else recording.clamped or named


def _metadata(beside: dict[str, Any], reserved: tuple[str, ...]) -> dict[str, Any]:
    kept = {key: value for key, value in beside.items() if key not in reserved}
    for key in ("markers", "clamped"):
        if isinstance(beside.get(key), str):
            kept[f"{key}_note"] = beside[key]
    units = beside.get("units", "m")
    if units not in METERS:
        kept["units_note"] = units
    return kept
