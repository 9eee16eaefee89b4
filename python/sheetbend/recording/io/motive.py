"""Takes of OptiTrack's Motive, exported as CSV (format versions 1.2 and later).

The first line names the unit; then rows of types, names and what is given stand above the columns. Measured markers are
read, and of rigid bodies their positions, under their names: they drive grips. Rotations, errors and qualities are left
out, and so are the places where a body's solution expects its markers. So is what was never seen. Motive's y points up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ..marker_data import MarkerData
from .cells import number, points_seen, refuse, split

_UNITS = {"Meters": "m", "Centimeters": "cm", "Millimeters": "mm"}
_READ = ("Marker", "Rigid Body")
_DOWN = np.array([0.0, -9.81, 0.0])  # m/s^2


def wrote(text: list[tuple[int, str]]) -> bool:
    """Whether these are lines of such a file."""
    return text[0][1].startswith("Format Version,")


def read(path: Path, text: list[tuple[int, str]]) -> MarkerData:
    """Read a take; its unit is passed on as metadata["units"].

    Raises:
        RecordingError: a header row is missing, no column is one of a marker, or a line is wrong (which is named).
    """
    told = split(path, 1, text[0][1], ",")
    about = dict(zip(told[::2], told[1::2], strict=False))
    if about.get("Length Units") not in _UNITS:
        refuse(path, 1, "names no length unit", about.get("Length Units"), f"export in {', '.join(_UNITS)}")
    rows = [(line, split(path, line, row, ",")) for line, row in text[1:] if row.strip()]
    start = next((k for k, (_, cells) in enumerate(rows) if cells[0] == "Frame"), None)
    if start is None or start < 3:
        fix = "export it with header information"
        raise RecordingError(str(path), "has no rows of types, names and axes above its numbers", start, fix)
    (_, types), (_, names), (_, given), (line, axes) = rows[0], rows[1], rows[start - 1], rows[start]
    width = len(axes)
    for above, cells in rows[:start]:
        if len(cells) != width:
            refuse(path, above, f"must have {width} cells, like the row of axes", len(cells))
    first = [
        k
        for k in range(2, width - 2)
        if types[k] in _READ and given[k] == "Position" and axes[k : k + 3] == ["X", "Y", "Z"]
    ]
    if not first:
        fix = "export it with markers or rigid bodies"
        refuse(path, line, "has no columns X, Y, Z of a marker or rigid body", sorted(set(types[2:])), fix)
    frames = rows[start + 1 :]
    if not frames:
        raise RecordingError(str(path), "has a header but no rows", "0 frames", "export its frames")
    for row, cells in frames:
        if len(cells) != width:
            refuse(path, row, f"must have {width} cells, like the header", len(cells))
    times = np.array([number(path, row, cells[1]) for row, cells in frames])
    x, markers = points_seen(path, frames, names, first)
    metadata = {"units": _UNITS[about["Length Units"]], "take": about.get("Take Name", "")}
    return MarkerData(x, times, markers, gravity=_DOWN, metadata=metadata)
