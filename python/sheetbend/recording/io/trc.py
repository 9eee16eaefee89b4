"""TRC files (track row column) of motion capture systems and of OpenSim: tab-separated text, three columns per marker.

The first line starts with `PathFileType`. Below stand a line of keys and one of their values (`Units` names the length
unit), the names of the markers after `Frame#` and `Time`, a line of axes, and a row per frame. Empty cells and `nan`
are markers not seen. The file does not say which way is down.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...files.units import METERS
from ..marker_data import MarkerData
from .cells import Row, lines, number, points_seen, refuse

_LEAST = 5  # lines above the frames


def read(path: Path) -> MarkerData:
    """Read a file; its unit is passed on as metadata["units"].

    Raises:
        RecordingError: it is no such file, names no length unit, or a line is wrong (which is named).
    """
    rows: list[Row] = [
        (line, [cell.strip() for cell in text.rstrip("\r").split("\t")]) for line, text in lines(path) if text.strip()
    ]
    if len(rows) <= _LEAST or not rows[0][1][0].startswith("PathFileType"):
        fix = "export it again; above the frames stand PathFileType, keys, values, names and axes"
        raise RecordingError(str(path), "is not a TRC file with frames", f"{len(rows)} lines", fix)
    (_, keys), (at, values), (line, names), (_, axes), *frames = rows[1:]
    told = dict(zip(keys, values, strict=False))
    if told.get("Units") not in METERS:
        refuse(path, at, "names no length unit under Units", told.get("Units"), f"export in {' or '.join(METERS)}")
    if [name.lower() for name in names[:2]] != ["frame#", "time"]:
        refuse(path, line, "must begin with Frame# and Time", names[:2])
    first = [k for k in range(2, len(names)) if names[k]]
    if not first or first != list(range(2, 3 * len(first) + 2, 3)):
        refuse(path, line, "must name a marker in every third column", names[2:8], "export it again, separated by tabs")
    width = 2 + 3 * len(first)
    if [axis[:1] for axis in axes[2:width]] != list("XYZ") * len(first):
        refuse(path, line + 1, "must name the axes X1, Y1, Z1, X2, ...", axes[2:8])
    padded: list[Row] = []
    for row, cells in frames:
        if len(cells) < 2 or any(cells[width:]):
            refuse(path, row, f"must have at most {width} cells, like the axes", len(cells))
        padded.append((row, [*cells[:width], *[""] * (width - len(cells))]))  # empty cells at the end may be cut off
    times = np.array([number(path, row, cells[1]) for row, cells in padded])
    x, markers = points_seen(path, padded, names, first)
    return MarkerData(x, times, markers, metadata={"units": told["Units"]})
