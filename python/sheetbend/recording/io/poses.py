"""Poses of a tool over time, from a CSV or an NPZ file.

CSV, a row per pose: `time,x,y,z,qx,qy,qz,qw` in any order of columns, in s, m and (x, y, z, w); further columns are not
read. `time_ms`, `time_us` and `time_ns` are taken as such, on the file's own clock: they do not count from its first
row. The rigid bodies of a CSV of OptiTrack's Motive are poses too.
NPZ: `times` (poses,), `positions` (poses, 3), `quaternions` (poses, 4).
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.door import check_room, reading
from . import motive
from .cells import lines
from .npz import plain_arrays

SECONDS = {"time": 1.0, "t": 1.0, "time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6, "time_ns": 1e-9}
COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")
ARRAYS = ("times", "positions", "quaternions")


def read_poses(path: Path, body: str | None = None) -> tuple[Array, Array, Array]:
    """Times (poses,) s, positions (poses, 3) m and quaternions (poses, 4) of a file.

    Args:
        body: name of the rigid body, of a take of Motive; not needed where it has one alone.

    Raises:
        RecordingError: the file is missing, of an unknown kind, damaged, or lacks a column, an array or the body.
    """
    if not path.is_file():
        raise RecordingError(str(path), "does not exist", path.name, "give a CSV or NPZ file of poses")
    with reading(path):
        return _read(path, body)


def _read(path: Path, body: str | None) -> tuple[Array, Array, Array]:
    if path.suffix.lower() == ".csv" and motive.wrote(text := lines(path)):
        return motive.read_body(path, text, body)
    if body is not None:
        fix = "leave it out: a file of poses has one body alone"
        raise RecordingError("body", f"is given, and {path.name} is not a take of Motive", body, fix)
    if path.suffix.lower() == ".npz":
        fix = "store times (poses,), positions (poses, 3) and quaternions (poses, 4) under these names"
        arrays = plain_arrays(path, ARRAYS, fix=fix)
        return arrays["times"], arrays["positions"], arrays["quaternions"]
    if path.suffix.lower() != ".csv":
        raise RecordingError(str(path), "is of an unknown kind", path.suffix, "give a .csv or .npz file of poses")
    return _table(path)


def _table(path: Path) -> tuple[Array, Array, Array]:
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(str(path), "cannot be read", str(error), "give UTF-8 text with commas") from error
    header = [cell.strip() for cell in rows[0]] if rows else []
    clock = [name for name in SECONDS if name in header]
    missing = [name for name in COLUMNS if name not in header] + ([] if clock else ["time"])
    if missing:
        fix = f"name the columns time,{','.join(COLUMNS)}"
        raise RecordingError(str(path), f"lacks the columns {', '.join(missing)}", header[:12], fix)
    order = [header.index(name) for name in (clock[0], *COLUMNS)]
    check_room(path, f"{len(rows)} poses", 8 * len(order) * len(rows))
    found = np.empty((len(rows) - 1, len(order)))
    kept = 0
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            found[kept] = [float(row[k]) for k in order]
        except (ValueError, IndexError):
            raise RecordingError(str(path), f"has no numbers in line {line}", row[:8], "give one per column") from None
        kept += 1
    return SECONDS[clock[0]] * found[:kept, 0], found[:kept, 1:4], found[:kept, 4:]
