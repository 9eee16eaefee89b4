"""Recordings in the layout of the DEFORM rope data: a pickle per recording, positions alone.

    a list of frames, each an array (3, markers) or three lists of numbers; or one array (frames, 3, markers)

Markers stand in order along the rope. NaN means not seen. The files say neither times nor which markers are driven: 100
frames per second and two markers in each grip (0, 1, -2, -1) are assumed, as in that data; `rate` and `clamped` in the
JSON beside the file replace them. Lengths are in the unit of that JSON, meters without one; the axes are those of the
source, so say `gravity` there when z does not point up.

Layout: Chen et al. 2024, Differentiable Discrete Elastic Rods for Real-Time Modeling of Deformable Linear Objects. The
pickles are read by `plain_pickle`, which runs nothing that they name.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import RecordingError
from ...files.door import check_room
from ...files.whole import written
from ..marker_data import MarkerData
from . import plain_pickle

ASSUMED = ("times", "clamped")
"""What the files do not say; see `sheetbend.recording.io`."""
RATE = 100.0
"""Frames per second, Hz."""
MANY, MORE = 100, 5
"""Markers, and markers per frame, from which a file's axes must be in another order."""
GRIPPED = 2
"""Markers in each grip."""


def read(path: Path) -> MarkerData:
    """Read a pickle.

    Raises:
        RecordingError: it is no pickle, is damaged, names anything but NumPy arrays, or the shape is another.
    """
    content = plain_pickle.arrays(path)
    if not isinstance(content, list):
        if content.ndim != 3:
            fix = "store one array (frames, 3, markers), or a list of arrays (3, markers)"
            raise RecordingError(str(path), "must have the shape (frames, 3, markers)", content.shape, fix)
        content = list(content)
    positions = _stacked(path, content)
    frames, markers, _ = positions.shape
    clamped = tuple(i for i in range(markers) if i < GRIPPED or i >= markers - GRIPPED)
    return MarkerData(positions, np.arange(frames) / RATE, clamped=clamped)


def write(recording: MarkerData, path: Path) -> None:
    """Write a list of float64 arrays (3, markers), one per frame; markers not seen are NaN."""
    frames = [np.ascontiguousarray(frame.T) for frame in recording.positions]
    with written(path) as beside, beside.open("wb") as file:
        pickle.dump(frames, file, protocol=4)


def _stacked(path: Path, frames: list[NDArray[Any]]) -> NDArray[Any]:
    """(frames, markers, 3) from frames (3, markers)."""
    if not frames:
        raise RecordingError(str(path), "holds no frame", 0, "record at least one frame")
    for i, frame in enumerate(frames):
        if frame.ndim != 2 or frame.shape[0] != 3:
            raise RecordingError(
                f"{path}: frame {i}", "must have the shape (3, markers)", frame.shape, _fix(len(frames), frame.shape)
            )
        if frame.shape != frames[0].shape:
            fix = f"give every frame the markers of the first, {frames[0].shape[1]}, with NaN where one was not seen"
            raise RecordingError(f"{path}: frame {i}", "has another number of markers", frame.shape[1], fix)
    if frames[0].shape[1] >= MANY and frames[0].shape[1] > MORE * len(frames):
        found = (len(frames), *frames[0].shape)
        problem = "has the shape (frames, 3, markers) with far more markers than frames: the axes are in another order"
        fix = "if its axes are (markers, 3, frames), store `numpy.transpose(x, (2, 1, 0))`"
        raise RecordingError(str(path), problem, found, fix)
    room = 8 * len(frames) * frames[0].size
    check_room(path, f"{len(frames)} frames of {frames[0].shape[1]} markers", room)
    return np.stack(frames).transpose(0, 2, 1)


def _fix(count: int, shape: tuple[int, ...]) -> str:
    """What brings `count` entries of such a shape into the order (frames, 3, markers)."""
    if len(shape) == 2 and shape[1] == 3:
        return "its axes are (frames, markers, 3): store `numpy.transpose(x, (0, 2, 1))`"
    if len(shape) == 2 and count == 3:
        order = (1, 0, 2) if shape[0] > shape[1] else (2, 0, 1)
        axes = "(3, frames, markers)" if shape[0] > shape[1] else "(3, markers, frames)"
        return f"its axes seem to be {axes}: store `numpy.transpose(x, {order})`"
    return "store each frame as an array (3, markers) with the rows x, y, z"
