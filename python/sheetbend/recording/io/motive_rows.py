"""Takes of OptiTrack's Tracking Tools and of the first Motive, exported as CSV (format version 1.1).

Every row begins with its kind. A row `frame` holds the frame's number, the time in s, how many rigid bodies are tracked
and eleven cells for each (id, x, y, z, a quaternion, three angles), then how many markers and five cells for each (x,
y, z, id, name). Lengths are in m and y points up; a left-handed take is mirrored in z. Rows `rigidbody` before the
frames name the bodies, whose positions are read as markers. Markers are told apart by their ids.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...files.door import check_room
from ..marker_data import MarkerData
from .cells import number, refuse, split

_FIRST = ("comment", "righthanded", "lefthanded", "info")
_OF_BODY, _OF_MARKER = 11, 5  # cells
_DOWN = np.array([0.0, -9.81, 0.0])  # m/s^2


def wrote(text: list[tuple[int, str]]) -> bool:
    """Whether these are lines of such a file."""
    kinds = [line.partition(",")[0].strip().lower() for _, line in text]
    return next((kind for kind in kinds if kind), "") in _FIRST and "frame" in kinds


def read(path: Path, text: list[tuple[int, str]]) -> MarkerData:
    """Read a take.

    Raises:
        RecordingError: a frame is cut off, holds what is no number, or repeats a marker; times do not increase.
    """
    bodies: dict[int, str] = {}
    frames: list[tuple[float, dict[str, list[float]]]] = []
    mirrored = False
    for line, row in text:
        if not row.strip():
            continue
        cells = split(path, line, row, ",")
        kind = cells[0].lower()
        mirrored |= kind == "lefthanded"
        if kind == "rigidbody" and not frames and len(cells) > 2:
            bodies[_count(path, line, cells[2])] = cells[1]
        if kind == "frame":
            frames.append(_frame(path, line, cells, bodies))
            if len(frames) > 1 and not frames[-1][0] > frames[-2][0]:
                refuse(path, line, "must have a time later than the frame before", cells[2])
    names = tuple(dict.fromkeys(name for _, seen in frames for name in seen))
    if not names:
        raise RecordingError(str(path), "holds no marker and no rigid body", "0", "export it with markers")
    check_room(path, f"positions of {len(frames)} frames and {len(names)} markers", 24 * len(frames) * len(names))
    x = np.full((len(frames), len(names), 3), np.nan)
    for k, (_, seen) in enumerate(frames):
        for m, name in enumerate(names):
            x[k, m] = seen.get(name, math.nan)
    x[:, :, 2] *= -1.0 if mirrored else 1.0
    return MarkerData(x, np.array([t for t, _ in frames]), names, gravity=_DOWN, metadata={"units": "m"})


def _frame(path: Path, line: int, cells: list[str], bodies: dict[int, str]) -> tuple[float, dict[str, list[float]]]:
    """Time, and the places of what is seen by name."""
    seen: dict[str, list[float]] = {}
    if len(cells) < 4:
        refuse(path, line, "is cut off", f"{len(cells)} cells")
    time, at = number(path, line, cells[2]), 3
    for width, first, of in ((_OF_BODY, 1, 0), (_OF_MARKER, 0, 3)):
        count = _count(path, line, cells[at]) if at < len(cells) else -1
        at += 1
        if count < 0 or at + width * count > len(cells):
            refuse(path, line, "is cut off", f"{len(cells)} cells")
        for k in range(at, at + width * count, width):
            place, key = cells[k + first : k + first + 3], _count(path, line, cells[k + of])
            if any("#" in cell for cell in place):  # not a number
                continue
            told = bodies.get(key, f"body {key}") if width == _OF_BODY else cells[k + 4]
            name = told or f"marker {key}"
            if name in seen:
                refuse(path, line, "repeats a marker", name, "name the markers apart")
            seen[name] = [number(path, line, cell) for cell in place]
        at += width * count
    return time, seen


def _count(path: Path, line: int, cell: str) -> int:
    found = number(path, line, cell)
    if not (found >= 0 and found == int(found)):
        refuse(path, line, "must hold a whole number there", cell)
    return int(found)
