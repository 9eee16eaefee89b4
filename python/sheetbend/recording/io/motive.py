"""Takes of OptiTrack's Motive, exported as CSV (format versions 1.2 and later).

The first line names the unit; then rows of types, names and what is given stand above the columns. Measured markers are
read, and of rigid bodies their positions, under their names: they drive grips. `read_body` gives the whole pose of
one. Errors and qualities are left out, and so are the places where a body's solution expects its markers, and what was
never seen. Unlabeled markers that are lost and come back under another number are joined (`fragments`). Motive's y
points up.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.units import METERS
from ..marker_data import MarkerData
from . import fragments
from .cells import Row, number, points_seen, refuse, split

_UNITS = {"Meters": "m", "Centimeters": "cm", "Millimeters": "mm"}
_READ = ("Marker", "Rigid Body")
_UNNAMED = re.compile(r"unlabell?ed[ _:]*\d*", re.IGNORECASE)
_DOWN = np.array([0.0, -9.81, 0.0])  # m/s^2


def read_body(path: Path, text: list[tuple[int, str]], body: str | None) -> tuple[Array, Array, Array]:
    """Poses of a rigid body: times (poses,) s, positions (poses, 3) m, quaternions (poses, 4) as (x, y, z, w), of the
    frames in which it was tracked.

    Args:
        body: its name; None where the take has one alone.

    Raises:
        RecordingError: the take has no such body, or its rotations are no quaternions.
    """
    about, (types, names, given, axes), _, frames = _parts(path, text)
    bodies = list(dict.fromkeys(names[k] for k in range(2, len(axes)) if types[k] == "Rigid Body"))
    if body not in bodies and not (body is None and len(bodies) == 1):
        fix = f"name one of: {', '.join(bodies) or 'none, export it with rigid bodies'}"
        raise RecordingError("body", "is not a rigid body of the take" if body else "is missing", body, fix)
    own = [k for k in range(2, len(axes)) if types[k] == "Rigid Body" and names[k] == (body or bodies[0])]
    column = {(given[k], axes[k]): k for k in own}
    wanted = [("Position", axis) for axis in "XYZ"] + [("Rotation", axis) for axis in "XYZW"]
    if not set(wanted) <= set(column):
        fix = "export it with positions, and with rotations as quaternions"
        raise RecordingError(str(path), "does not have the whole pose of the body", sorted(set(column)), fix)
    table = np.array(
        [[number(path, row, cells[k]) for k in [1, *(column[w] for w in wanted)]] for row, cells in frames]
    )
    table = table[np.isfinite(table).all(axis=1)]
    return table[:, 0], METERS[_UNITS[about["Length Units"]]] * table[:, 1:4], table[:, 4:]


def wrote(text: list[tuple[int, str]]) -> bool:
    """Whether these are lines of such a file."""
    return text[0][1].startswith("Format Version,")


def read(path: Path, text: list[tuple[int, str]]) -> MarkerData:
    """Read a take; its unit is passed on as metadata["units"].

    Raises:
        RecordingError: a header row is missing, no column is one of a marker, or a line is wrong (which is named).
    """
    about, (types, names, given, axes), line, frames = _parts(path, text)
    first = [
        k
        for k in range(2, len(axes) - 2)
        if types[k] in _READ and given[k] == "Position" and axes[k : k + 3] == ["X", "Y", "Z"]
    ]
    if not first:
        fix = "export it with markers or rigid bodies"
        refuse(path, line, "has no columns X, Y, Z of a marker or rigid body", sorted(set(types[2:])), fix)
    times = np.array([number(path, row, cells[1]) for row, cells in frames])
    x, markers = points_seen(path, frames, names, first)
    metadata: dict[str, Any] = {"units": _UNITS[about["Length Units"]], "take": about.get("Take Name", "")}
    unnamed = [_UNNAMED.fullmatch(name) is not None for name in markers]
    if np.isfinite(times).all() and (np.diff(times) > 0).all():
        x, markers, joined = fragments.joined(times, x, markers, unnamed)
        metadata |= {"joined": joined} if joined else {}
    return MarkerData(x, times, markers, gravity=_DOWN, metadata=metadata)


def _parts(path: Path, text: list[tuple[int, str]]) -> tuple[dict[str, str], tuple[list[str], ...], int, list[Row]]:
    """What the first line tells; the rows of types, names, what is given, and axes; the line of these; the frames."""
    told = split(path, 1, text[0][1], ",")
    about = dict(zip(told[::2], told[1::2], strict=False))
    if about.get("Length Units") not in _UNITS:
        refuse(path, 1, "names no length unit", about.get("Length Units"), f"export in {', '.join(_UNITS)}")
    rows = [(line, split(path, line, row, ",")) for line, row in text[1:] if row.strip()]
    start = next((k for k, (_, cells) in enumerate(rows) if cells[0] == "Frame"), None)
    if start is None or start < 3:
        fix = "export it with header information"
        raise RecordingError(str(path), "has no rows of types, names and axes above its numbers", start, fix)
    head = tuple(rows[k][1] for k in (0, 1, start - 1, start))
    width = len(head[-1])
    for above, cells in rows[:start]:
        if len(cells) != width:
            refuse(path, above, f"must have {width} cells, like the row of axes", len(cells))
    frames = rows[start + 1 :]
    if not frames:
        raise RecordingError(str(path), "has a header but no rows", "0 frames", "export its frames")
    for row, cells in frames:
        if len(cells) != width:
            refuse(path, row, f"must have {width} cells, like the header", len(cells))
    return about, head, rows[start][0], frames
