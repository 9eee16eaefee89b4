"""Measurements of Qualisys Track Manager, exported as TSV: lines of keys such as FREQUENCY and MARKER_NAMES, and below
them a row per frame with three columns per marker, in mm.

A line of column names above the rows, and columns of the frame and its time, may be there or not. Lost markers have
empty cells, `NULL`, or exactly 0, 0, 0. The file does not say which way is down.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ..marker_data import MarkerData
from .cells import Row, number, points_seen, refuse

_FIRST = ("FILE_VERSION", "NO_OF_FRAMES")
_KEY = re.compile(r"(?!NULL$)[A-Z][A-Z0-9_]+")
_BEFORE = ("frame", "time")  # columns before those of the markers


def wrote(text: list[tuple[int, str]]) -> bool:
    """Whether these are lines of such a file."""
    return text[0][1].split("\t")[0].strip() in _FIRST


def read(path: Path, text: list[tuple[int, str]]) -> MarkerData:
    """Read a measurement; its unit is passed on as metadata["units"]. The first frame is at 0 s.

    Raises:
        RecordingError: it names no frequency or no markers, or a row is wrong (which is named).
    """
    rows: list[Row] = [(line, [cell.strip() for cell in row.split("\t")]) for line, row in text if row.strip()]
    above = next((k for k, (_, cells) in enumerate(rows) if not _KEY.fullmatch(cells[0])), len(rows))
    told = {cells[0]: (line, cells[1:]) for line, cells in rows[:above]}
    if "BODY_NAMES" in told and "MARKER_NAMES" not in told:
        fix = "export the 3D data of the markers"
        raise RecordingError(str(path), "holds poses of rigid bodies", told["BODY_NAMES"][1], fix)
    if "FREQUENCY" not in told or "MARKER_NAMES" not in told:
        fix = "export it again with its header"
        raise RecordingError(str(path), "lacks FREQUENCY or MARKER_NAMES", sorted(told), fix)
    line, values = told["FREQUENCY"]
    hertz = number(path, line, values[0] if values else "")
    if not hertz > 0:
        refuse(path, line, "must be the frames per second", values)
    names = [name for name in told["MARKER_NAMES"][1] if name]
    frames = rows[above:]
    if frames and not _is_number(frames[0][1][0]):
        frames = frames[1:]
    if not frames or not names:
        got = f"{len(frames)} frames of {len(names)} markers"
        raise RecordingError(str(path), "has a header but no rows of markers", got, "export its frames")
    wide = 3 * len(names)
    before = len(frames[0][1]) - wide
    while before > 0 and all(len(cells) == before + wide and not cells[-1] for _, cells in frames):
        frames = [(line, cells[:-1]) for line, cells in frames]  # lines end in a tab
        before -= 1
    padded: list[Row] = []
    for line, cells in frames:
        if not 0 <= before <= len(_BEFORE) or len(cells) > before + wide or len(cells) <= before:
            refuse(path, line, f"must have {wide} cells for {len(names)} markers, after a frame and a time", len(cells))
        seen = ["" if cell.upper() == "NULL" else cell for cell in cells]
        padded.append((line, [*seen, *[""] * (before + wide - len(seen))]))
    heads = [*[""] * before, *(cell for name in names for cell in (name, "", ""))]
    x, markers = points_seen(path, padded, heads, range(before, before + wide, 3))
    return MarkerData(x, np.arange(len(x)) / hertz, markers, metadata={"units": "mm"})


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return cell.upper() == "NULL"
    return True
