"""Recordings as text tables: exports of motion capture systems (`motive`, `motive_rows`, `vicon`, `qtm`), or one of two
layouts, told apart by the header.

Wide, one row per frame, three columns per marker:

    time,tip_x,tip_y,tip_z,base_x,base_y,base_z
    0.00,0.10,0.0,-0.02,0.0,0.0,0.0
    0.01,,,,0.0,0.0,0.0

Long, one row per marker and frame, in any order; a missing row means not seen:

    time,marker,x,y,z
    0.00,tip,0.10,0.0,-0.02
    0.00,base,0.0,0.0,0.0

Or a time and one column, what a laser or another sensor of one coordinate writes: `time,distance [mm]`. It is the z of
a marker that stays at x = y = 0, or the axis that the name tells.

The header is required and starts with `time` or `t` (s), `time_ms`, `time_us` or `time_ns`; the last three count from
the first row. A column `frame`, or one without a name, before it is not read; without a time, the frames count at the
`rate` of the JSON beside the file. `columns` says how markers and axes are written. Cells are separated by commas,
semicolons or tabs. The decimal mark is a point, or a comma where no cell has a point and commas do not separate cells.
An empty cell or `nan` is a marker not seen, and so is exactly 0, 0, 0 where a marker is otherwise far from there. Lines
that start with # are comments; lines without a filled cell, and a row that repeats the one before, are not read.
`heading` says what may stand about the header. Coordinates are in the length unit of the header, `tip_x [mm]`, or of
the JSON beside the file, meters without one.
"""

from __future__ import annotations

import csv
import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.door import check_room
from ...files.whole import written
from ..marker_data import MarkerData
from . import clock, columns, heading, motive, motive_rows, qtm, sidecar, vicon
from .cells import Row, lines, number, refuse, split
from .lost import without_zeros

_DELIMITERS = (",", ";", "\t")
_AXES = columns.AXES
_FRAME = re.compile(r"frames?|frame[_ ]?(?:#|no|nr|number|index|id)?|index|", re.IGNORECASE)
_EMPTY = ' \t\r;,"'  # of lines without a filled cell
MOST_CELLS = 1.5  # times those of the header: from there on, decimal commas are likely to have split cells
DECIMAL_COMMAS = (
    "if commas are the decimal mark and separate the cells too, export with semicolons or tabs between the cells, or "
    "with decimal points"
)
_DECIMAL = re.compile(r"[-+]?\d*,\d+(e[-+]?\d+)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+")


def read(path: Path) -> MarkerData:
    """Read any of the layouts.

    Raises:
        RecordingError: the file is no text, has no header or no rows, a line is wrong (which is named), or rows of many
            markers at many times would make a table larger than `door.check_room` allows.
    """
    text = lines(path)
    for system in (motive, motive_rows, vicon, qtm):
        if system.wrote(text):
            return system.read(path, text)
    (header_line, header), *rows = _rows(path, text)
    if not rows:
        raise RecordingError(str(path), "has a header but no rows", "0 frames", "add one row per frame")
    for line, cells in rows:
        if len(cells) != len(header):
            fix = DECIMAL_COMMAS if len(cells) > MOST_CELLS * len(header) else "correct that line"
            refuse(path, line, f"must have {len(header)} cells, like the header", len(cells), fix)
    told = clock.unit(header[0])
    times = _counted(path, rows) if told is None else clock.times(path, rows, told)
    named = columns.of_names(header)
    if named is not None:
        return _read_long(path, header, header_line, rows, times, named)
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
    """Header and rows as stripped cells, without comments, blank lines and the column before the time."""
    kept = [(number, line) for number, line in text if line.strip(_EMPTY) and not line.lstrip().startswith("#")]
    if not kept:
        fix = "start with a header, time,<marker>_x,..."
        raise RecordingError(str(path), "holds no header", "only blank lines and comments", fix)
    top = heading.first(kept, _begins)
    delimiter = _delimiter(path, *kept[top])
    over = [(number, split(path, number, line, delimiter)) for number, line in kept[max(0, top - 1) : top]]
    rows = [(number, split(path, number, line, delimiter)) for number, line in kept[top:]]
    rows = heading.whole(over[0] if over else None, rows)
    if len(rows[0][1]) > 1 and all(len(cells) == len(rows[0][1]) and not cells[-1] for _, cells in rows):
        rows = [(number, cells[:-1]) for number, cells in rows]  # lines end in a delimiter
    if len(rows[0][1]) > 1 and _before_time(rows[0][1]):
        rows = [(number, cells[1:]) for number, cells in rows]
    return rows if delimiter == "," and not _quoted_decimals(rows) else _with_points(rows)


def _quoted_decimals(rows: list[Row]) -> bool:
    """Whether quoted cells between commas hold decimal commas, and not thousands."""
    held = [cell for _, cells in rows[1:] for cell in cells if _DECIMAL.fullmatch(cell)]
    return any(_THOUSANDS.fullmatch(cell) is None for cell in held)


def _with_points(rows: list[Row]) -> list[Row]:
    """Rows whose numbers have a point as decimal mark, where all of them had a comma."""
    header, *below = rows
    if any("." in cell for _, cells in below for cell in cells):
        return rows
    return [
        header,
        *((line, [c.replace(",", ".") if _DECIMAL.fullmatch(c) else c for c in cells]) for line, cells in below),
    ]


def _before_time(header: list[str]) -> bool:
    return _FRAME.fullmatch(header[0]) is not None and clock.unit(header[1]) is not None


def _begins(line: str) -> bool:
    """Whether a line begins with the name of a time, or with that of a frame before one."""
    for delimiter in _DELIMITERS:
        cells = [cell.strip().strip('"') for cell in line.split(delimiter)]
        if len(cells) > 1 and (clock.unit(cells[0]) is not None or _before_time(cells)):
            return True
    return False


def _delimiter(path: Path, number: int, header: str) -> str:
    """The one with which the header begins with the name of a time, or with a frame, whose `rate` the JSON tells."""
    counts = False
    for delimiter in _DELIMITERS:
        cells = split(path, number, header, delimiter) if delimiter in header else [""]
        if clock.unit(cells[0]) is not None or (len(cells) > 1 and _before_time(cells)):
            return delimiter
        counts |= len(cells) > 1 and _FRAME.fullmatch(cells[0]) is not None
        if counts and "rate" in sidecar.beside(path):
            return delimiter
    fix = "start with time,<marker>_x,<marker>_y,<marker>_z,... or time,marker,x,y,z, and one row per frame below"
    if counts:
        beside = path.with_suffix(".json").name
        fix = f'give a column of times, or write {{"rate": 100}} with the frames per second into {beside}'
    raise RecordingError(f"{path}, line {number}", "must be a header whose first column is time", header, fix)


def _counted(path: Path, rows: list[Row]) -> Array:
    """(rows,) s, of frames that count at the rate that the JSON tells."""
    count = np.array([number(path, line, cells[0]) for line, cells in rows])
    return (count - count[0]) / sidecar.rate(sidecar.beside(path)["rate"])


def _read_wide(path: Path, header: list[str], header_line: int, rows: list[Row], times: Array) -> MarkerData:
    again = [False, *(a[1] == b[1] for a, b in pairwise(rows))]  # a row that is there twice tells nothing
    rows, times = [row for row, twice in zip(rows, again, strict=True) if not twice], times[~np.array(again)]
    own = [k for k, name in enumerate(header) if k and not columns.beside(name)]
    own, unread = columns.coordinates(header, own)
    names = [header[k] for k in own]
    if len(names) == 1:
        marker, axis, unit = columns.alone(path, header_line, names[0])
        markers = [marker]
    else:
        markers, unit = columns.markers(path, header_line, names)
    _check_times(path, rows, times)
    table = np.array([[number(path, line, cells[k]) for k in own] for line, cells in rows])
    if len(names) == 1:
        table = np.where(np.arange(3) == axis, table, 0.0 * table)  # nan stays nan
    elif len(names) == 2 * len(markers):
        table = np.insert(table, range(2, len(names) + 1, 2), 0.0 * table[:, 1::2], axis=1)
    metadata: dict[str, object] = {} if unit is None else {"units": unit}
    metadata |= {"columns_not_read": unread} if unread else {}
    return MarkerData(without_zeros(table.reshape(len(rows), -1, 3)), times, tuple(markers), metadata=metadata)


def _read_long(
    path: Path, header: list[str], header_line: int, rows: list[Row], times: Array, named: int
) -> MarkerData:
    places = [k for k in range(1, len(header)) if k != named]
    if all(header[k] in _AXES for k in places):
        places.sort(key=lambda k: header[k])
    _, unit = columns.markers(path, header_line, [header[k] for k in places])
    for (line, _), time in zip(rows, times, strict=True):
        if np.isnan(time):
            refuse(path, line, "must have a time", "an empty cell or nan")
    frames, frame_of = np.unique(times, return_inverse=True)
    markers = list(dict.fromkeys(cells[named] for _, cells in rows))
    marker_of = {marker: i for i, marker in enumerate(markers)}

    room = 24 * len(frames) * len(markers)
    check_room(path, f"positions of {len(frames)} frames and {len(markers)} markers", room)
    positions = np.full((len(frames), len(markers), 3), np.nan)
    first_line: dict[tuple[int, str], int] = {}
    for (line, cells), frame in zip(rows, frame_of.tolist(), strict=True):
        marker = cells[named]
        earlier = first_line.setdefault((frame, marker), line)
        if earlier != line:
            refuse(path, line, f"repeats marker {marker!r} at the time of line {earlier}", cells[0])
        positions[frame, marker_of[marker]] = [number(path, line, cells[k]) for k in places]
    metadata = {} if unit is None else {"units": unit}
    return MarkerData(without_zeros(positions), frames, tuple(markers), metadata=metadata)


def _check_times(path: Path, rows: list[Row], times: Array) -> None:
    previous = -np.inf
    for (line, cells), time in zip(rows, times, strict=True):
        if time == previous and len(cells) == 4:
            fix = "name the marker of each row in a column marker; points without names are an sb.Cloud.of(...)"
            refuse(path, line, "must have a time later than the row before", cells[0], fix)
        if time == previous:
            fix = "leave out one of the two rows, or correct its time"
            refuse(path, line, "has the time of the row before, and other places", cells[0], fix)
        if not time > previous:
            refuse(path, line, "must have a time later than the row before", cells[0] or "an empty cell")
        previous = time
