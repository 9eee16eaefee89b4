"""Recordings as text tables in one of two layouts, told apart by the header.

Wide, one row per frame, three columns per marker:

    time,tip_x,tip_y,tip_z,base_x,base_y,base_z
    0.00,0.10,0.0,-0.02,0.0,0.0,0.0
    0.01,,,,0.0,0.0,0.0

Long, one row per marker and frame, in any order; a missing row means not seen:

    time,marker,x,y,z
    0.00,tip,0.10,0.0,-0.02
    0.00,base,0.0,0.0,0.0

The header is required and starts with `time` (s). Cells are separated by commas, semicolons or tabs, with a
point as decimal mark. An empty cell or `nan` is a marker not seen. Lines that start with # are comments.
Coordinates are in the length unit of the JSON beside the file, meters without one.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..errors import RecordingError
from ..recording import Recording

_DELIMITERS = (",", ";", "\t")
_AXES = ("x", "y", "z")
_COLUMNS = "name the columns of each marker <marker>_x, <marker>_y, <marker>_z"

Row = tuple[int, list[str]]  # line number in the file, from 1, and the cells


def read(path: Path) -> Recording:
    """Read either layout.

    Raises:
        RecordingError: the file is no text, has no header or no rows, or a line is wrong (which is named).
    """
    (header_line, header), *rows = _rows(path)
    if not rows:
        raise RecordingError(str(path), "has a header but no rows", "0 frames", "add one row per frame")
    for line, cells in rows:
        if len(cells) != len(header):
            _refuse(path, line, f"must have {len(header)} cells, like the header", len(cells))
    if sorted(header[1:]) == ["marker", *_AXES]:
        return _read_long(path, header, rows)
    return _read_wide(path, header, header_line, rows)


def write(recording: Recording, path: Path) -> None:
    """Write the wide layout; numbers keep all their digits, markers not seen leave empty cells."""
    header = ["time", *(f"{marker}_{axis}" for marker in recording.markers for axis in _AXES)]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        for time, frame in zip(recording.times.tolist(), recording.positions, strict=True):
            table.writerow([repr(time), *("" if np.isnan(c) else repr(c) for c in frame.ravel().tolist())])


def _rows(path: Path) -> list[Row]:
    """Header and rows as stripped cells, without comments and blank lines."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(str(path), "is no UTF-8 text", str(error), "save it as a UTF-8 CSV") from error
    lines = [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        fix = "start with a header, time,<marker>_x,..."
        raise RecordingError(str(path), "holds no header", "only blank lines and comments", fix)
    delimiter = _delimiter(path, *lines[0])
    return [(number, _cells(path, number, line, delimiter)) for number, line in lines]


def _delimiter(path: Path, number: int, header: str) -> str:
    """The one after which the header's first cell reads `time`."""
    for delimiter in _DELIMITERS:
        if delimiter in header and _cells(path, number, header, delimiter)[0] == "time":
            return delimiter
    fix = "start with time,<marker>_x,<marker>_y,<marker>_z,... or time,marker,x,y,z"
    raise RecordingError(f"{path}, line {number}", "must be a header whose first column is time", header, fix)


def _cells(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    try:
        (cells,) = csv.reader([line], delimiter=delimiter, strict=True)
    except csv.Error as error:
        place = f"{path}, line {number}"
        raise RecordingError(place, f"is malformed, {error}", line, "mend its quotes") from error
    return [cell.strip() for cell in cells]


def _read_wide(path: Path, header: list[str], header_line: int, rows: list[Row]) -> Recording:
    markers = [column.rpartition("_")[0] for column in header[1::3]]
    expected = [f"{marker}_{axis}" for marker in markers for axis in _AXES]
    for column, wanted in zip(header[1:], expected, strict=False):
        if column != wanted:
            _refuse(path, header_line, f"must have the column {wanted!r} there", column, _COLUMNS)
    if len(header) != 1 + len(expected):
        _refuse(path, header_line, "must have three columns x, y, z per marker", header[-1], _COLUMNS)
    table = np.array([[_number(path, line, cell) for cell in cells] for line, cells in rows])
    _check_times(path, rows, table[:, 0])
    return Recording(table[:, 1:].reshape(len(rows), -1, 3), table[:, 0], tuple(markers))


def _read_long(path: Path, header: list[str], rows: list[Row]) -> Recording:
    column = {name: i for i, name in enumerate(header)}
    times = np.array([_number(path, line, cells[0]) for line, cells in rows])
    for (line, _), time in zip(rows, times, strict=True):
        if np.isnan(time):
            _refuse(path, line, "must have a time", "an empty cell or nan")
    frames, frame_of = np.unique(times, return_inverse=True)
    markers = list(dict.fromkeys(cells[column["marker"]] for _, cells in rows))
    marker_of = {marker: i for i, marker in enumerate(markers)}

    positions = np.full((len(frames), len(markers), 3), np.nan)
    first_line: dict[tuple[int, str], int] = {}
    for (line, cells), frame in zip(rows, frame_of.tolist(), strict=True):
        marker = cells[column["marker"]]
        earlier = first_line.setdefault((frame, marker), line)
        if earlier != line:
            _refuse(path, line, f"repeats marker {marker!r} at the time of line {earlier}", cells[0])
        positions[frame, marker_of[marker]] = [_number(path, line, cells[column[axis]]) for axis in _AXES]
    return Recording(positions, frames, tuple(markers))


def _number(path: Path, line: int, cell: str) -> float:
    if not cell:
        return np.nan
    try:
        number = float(cell.replace("_", "?"))  # Python would read 1_0 as ten
    except ValueError:
        fix = "write a point as decimal mark, and an empty cell or nan for a marker not seen"
        _refuse(path, line, "holds a cell that is no number", cell, fix)
    if np.isinf(number):
        _refuse(path, line, "holds an infinite number; leave the cell empty for a marker not seen", cell)
    return number


def _check_times(path: Path, rows: list[Row], times: np.ndarray) -> None:
    previous = -np.inf
    for (line, cells), time in zip(rows, times, strict=True):
        if not time > previous:
            _refuse(path, line, "must have a time later than the row before", cells[0] or "an empty cell")
        previous = time


def _refuse(path: Path, line: int, problem: str, got: object, fix: str = "correct that line") -> NoReturn:
    raise RecordingError(f"{path}, line {line}", problem, got, fix)
