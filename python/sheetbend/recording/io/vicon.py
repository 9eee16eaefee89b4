"""Trials of Vicon Nexus, exported as ASCII: the section `Trajectories`, which holds the markers.

Other sections (devices, segments, joints) are left out, and so are velocities, accelerations and markers that were
never seen. z points up."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...files.units import METERS
from ..marker_data import MarkerData
from .cells import number, points_seen, refuse, split

_SECTIONS = ("Devices", "Joints", "Model Outputs", "Segments", "Trajectories")
_AXES = ["X", "Y", "Z"]


def wrote(text: list[tuple[int, str]]) -> bool:
    """Whether these are lines of such a file."""
    first = next((line for _, line in text if line.strip()), "")
    return _title(first) in _SECTIONS


def read(path: Path, text: list[tuple[int, str]]) -> MarkerData:
    """Read a trial; its unit is passed on as metadata["units"]. The first frame is at 0 s.

    Raises:
        RecordingError: there is no such section, its head is cut off, its units differ, or a line is wrong.
    """
    start = next((k for k, (_, line) in enumerate(text) if _title(line) == "Trajectories"), None)
    if start is None:
        fix = "export the trajectories too"
        raise RecordingError(str(path), "has no section Trajectories", [_title(text[0][1])], fix)
    section = text[start + 1 :]
    end = next((k for k, (_, line) in enumerate(section) if not line.strip(",;\t \r")), len(section))
    delimiter = next((d for d in (",", "\t", ";") if len(section) > 2 and d in section[2][1]), ",")
    rows = [(line, split(path, line, row, delimiter)) for line, row in section[:end]]
    if len(rows) < 5:
        fix = "export it again, with its frames"
        raise RecordingError(str(path), "has no rate, names, axes, units and frames", f"{len(rows)} lines", fix)
    (at, rate), (_, names), (line, axes), (unit_line, units), *frames = rows
    hertz = number(path, at, rate[0])
    if not hertz > 0:
        refuse(path, at, "must be the frames per second", rate[0])
    width = len(axes)
    names, units = ([*cells, *[""] * (width - len(cells))] for cells in (names, units))
    first = [k for k in range(2, width - 2) if axes[k : k + 3] == _AXES and names[k]]
    if not first:
        refuse(path, line, "has no columns X, Y, Z of a marker", axes, "export the trajectories")
    told = {units[k + axis] for k in first for axis in range(3)}
    if len(told) > 1 or not told <= set(METERS):
        refuse(path, unit_line, "must name one length unit", sorted(told), f"export in {' or '.join(METERS)}")
    for row, cells in frames:
        if len(cells) < width:
            refuse(path, row, f"must have {width} cells, like the header", len(cells))
    count = np.array([number(path, row, cells[0]) for row, cells in frames])
    x, markers = points_seen(path, frames, names, first)
    return MarkerData(x, (count - count[0]) / hertz, markers, metadata={"units": told.pop()})


def _title(line: str) -> str:
    return line.strip(",;\t \r\ufeff")
