"""Recordings as text tables: exports of motion capture systems (`motive`, `motive_rows`, `vicon`), or one of two
layouts, told apart by the header.

Wide, one row per frame, three columns per marker:

    time,tip_x,tip_y,tip_z,base_x,base_y,base_z
    0.00,0.10,0.0,-0.02,0.0,0.0,0.0
    0.01,,,,0.0,0.0,0.0

Long, one row per marker and frame, in any order; a missing row means not seen:

    time,marker,x,y,z
    0.00,tip,0.10,0.0,-0.02
    0.00,base,0.0,0.0,0.0

The header is required and starts with `time` or `t` (s), `time_ms`, `time_us` or `time_ns`; the last three count from
the first row. A column `frame` before it is not read. Between marker and axis stands an underscore, a point, a colon or
a blank. Cells are separated by commas, semicolons
or tabs, with a point as decimal mark. An empty cell or `nan` is a marker not seen. Lines that start with # are
comments.
Coordinates are in the length unit of the JSON beside the file, meters without one.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from ...arrays.timeseries import Array
from ...errors import RecordingError
from ...files.door import check_room
from ...files.whole import written
from ..marker_data import MarkerData
from . import clock, motive, motive_rows, vicon
from .cells import Row, lines, number, refuse, split

_DELIMITERS = (",", ";", "\t")
_AXES = ("x", "y", "z")
_COLUMNS = "name the columns of each marker <marker>_x, <marker>_y, <marker>_z"
_FRAME = re.compile(r"frames?|frame[_ ]?(?:#|no|nr|number|index|id)?", re.IGNORECASE)
_AXIS = re.compile(r"(.*)[_.: ]([xyz])", re.IGNORECASE | re.DOTALL)


def read(path: Path) -> MarkerData:
    """Read any of the layouts.

    Raises:
        RecordingError: the file is no text, has no header or no rows, a line is wrong (which is named), or rows of many
            markers at many times would make a table larger than `door.check_room` allows.
    """
    text = lines(path)
    for system in (motive, motive_rows, vicon):
        if system.wrote(text):
            return system.read(path, text)
    (header_line, header), *rows = _rows(path, text)
    if not rows:
        raise RecordingError(str(path), "has a header but no rows", "0 frames", "add one row per frame")
    for line, cells in rows:
        if len(cells) != len(header):
            refuse(path, line, f"must have {len(header)} cells, like the header", len(cells))
    times = clock.times(path, rows, clock.unit(header[0]) or "s")
    if sorted(header[1:]) == ["marker", *_AXES]:
        return _read_long(path, header, rows, times)
    return _read_wide(path, header, header_line, rows, times)


def write(recording: MarkerData, path: Path) -> None:
    """Write the wide layout; numbers keep all their digits, markers not seen leave empty cells."""
    header = ["time", *(f"{marker}_{axis}" for marker in recording.markers for axis in _AXES)]
    with written(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        for time, frame in zip(recording.times.tolist(), recording.positions, strict=True):
            table.writerow([repr(time), *("" if np.isnan(c) else repr(c) for c in frame.ravel().tolist())])


def _rows(path: Path, text: list[tuple[int, str]]) -> list[Row]:
    """Header and rows as stripped cells, without comments and blank lines."""
    kept = [(number, line) for number, line in text if line.strip() and not line.lstrip().startswith("#")]
    if not kept:
        fix = "start with a header, time,<marker>_x,..."
        raise RecordingError(str(path), "holds no header", "only blank lines and comments", fix)
    delimiter = _delimiter(path, *kept[0])
    rows = [(number, split(path, number, line, delimiter)) for number, line in kept]
    if _FRAME.fullmatch(rows[0][1][0]):
        return [(number, cells[1:]) for number, cells in rows]
    return rows


def _delimiter(path: Path, number: int, header: str) -> str:
    """The one with which the header begins with the name of a time, or with a frame and a time."""
    for delimiter in _DELIMITERS:
        cells = split(path, number, header, delimiter) if delimiter in header else [""]
        if clock.unit(cells[1 if _FRAME.fullmatch(cells[0]) else 0]) is not None:
            return delimiter
    fix = "start with time,<marker>_x,<marker>_y,<marker>_z,... or time,marker,x,y,z"
    raise RecordingError(f"{path}, line {number}", "must be a header whose first column is time", header, fix)


def _read_wide(path: Path, header: list[str], header_line: int, rows: list[Row], times: Array) -> MarkerData:
    markers = []
    for k, column in enumerate(header[1:]):
        match, axis = _AXIS.fullmatch(column), _AXES[k % 3]
        if k % 3 == 0:
            markers.append(match[1] if match else column)
        if match is None or match[1] != markers[-1] or match[2].lower() != axis:
            refuse(path, header_line, f"must have the column {f'{markers[-1]}_{axis}'!r} there", column, _COLUMNS)
    if len(header) != 1 + 3 * len(markers):
        refuse(path, header_line, "must have three columns x, y, z per marker", header[-1], _COLUMNS)
    _check_times(path, rows, times)
    table = np.array([[number(path, line, cell) for cell in cells[1:]] for line, cells in rows])
    return MarkerData(table.reshape(len(rows), -1, 3), times, tuple(markers))


def _read_long(path: Path, header: list[str], rows: list[Row], times: Array) -> MarkerData:
    column = {name: i for i, name in enumerate(header)}
    for (line, _), time in zip(rows, times, strict=True):
        if np.isnan(time):
            refuse(path, line, "must have a time", "an empty cell or nan")
    frames, frame_of = np.unique(times, return_inverse=True)
    markers = list(dict.fromkeys(cells[column["marker"]] for _, cells in rows))
    marker_of = {marker: i for i, marker in enumerate(markers)}

    room = 24 * len(frames) * len(markers)
    check_room(path, f"positions of {len(frames)} frames and {len(markers)} markers", room)
    positions = np.full((len(frames), len(markers), 3), np.nan)
    first_line: dict[tuple[int, str], int] = {}
    for (line, cells), frame in zip(rows, frame_of.tolist(), strict=True):
        marker = cells[column["marker"]]
        earlier = first_line.setdefault((frame, marker), line)
        if earlier != line:
            refuse(path, line, f"repeats marker {marker!r} at the time of line {earlier}", cells[0])
        positions[frame, marker_of[marker]] = [number(path, line, cells[column[axis]]) for axis in _AXES]
    return MarkerData(positions, frames, tuple(markers))


def _check_times(path: Path, rows: list[Row], times: Array) -> None:
    previous = -np.inf
    for (line, cells), time in zip(rows, times, strict=True):
        if not time > previous:
            refuse(path, line, "must have a time later than the row before", cells[0] or "an empty cell")
        previous = time
