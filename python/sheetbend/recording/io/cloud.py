"""Clouds as NumPy archives, never pickled.

    points  (all, 3)   length unit of the JSON beside it, else m; the points of one frame after those of the other
    counts  (frames,)  how many of them each frame has; their sum is `all`
    times   (frames,)  s, strictly increasing

Further arrays are allowed and not read. Sizes are checked before anything is unpacked, as in `npz`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...files.door import check_file, check_room, reading
from ...files.whole import written
from ..marker_data import MarkerData
from ..recording_checks import check_points, padded
from . import npz, sidecar

REQUIRED = ("points", "counts", "times")
FIX = "store points (all, 3), counts (frames,) and times (frames,) under these names"


def load(path: Path, units: str | None = None) -> MarkerData:
    """Read the cloud at path and the JSON beside it: the points of each frame, and behind them NaN.

    Raises:
        RecordingError: the file is missing, damaged or too large, lacks an array, or the arrays do not fit each other.
    """
    with reading(path):
        _check_suffix(path)
        check_file(path)
        return sidecar.apply(read(path), path, units)


def read(path: Path) -> MarkerData:
    """Read an archive; to be called inside `door.reading`."""
    arrays = npz.plain_arrays(path, REQUIRED, (), FIX)
    points, counts = arrays["points"], arrays["counts"]
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "iuf":
        raise RecordingError(f"{path}: points", "must be numbers of the shape (all, 3)", points.shape, FIX)
    if counts.ndim != 1 or counts.dtype.kind not in "iu" or (counts < 0).any():
        raise RecordingError(f"{path}: counts", "must be one whole number per frame", counts.tolist()[:4], FIX)
    if int(counts.sum()) != len(points):
        fix = "give one count per frame, whose sum is the number of points"
        raise RecordingError(f"{path}: counts", f"do not add up to the {len(points)} points", int(counts.sum()), fix)
    check_points(f"{path}: points", points)
    size = 24 * len(counts) * int(counts.max(initial=0))
    check_room(path, f"frames of {int(counts.max(initial=0))} points, which take {size} bytes", size)
    frames = np.split(points.astype(float), np.cumsum(counts)[:-1]) if len(counts) else []
    return MarkerData(positions=padded(frames), times=arrays["times"])


def save(cloud: MarkerData, path: Path) -> None:
    """Write the cloud, compressed, and the JSON beside it.

    Raises:
        RecordingError: the suffix is another, or the folder does not exist.
    """
    _check_suffix(path)
    if not path.parent.is_dir():
        raise RecordingError("path", "lies in a folder that does not exist", str(path), "make the folder first")
    sidecar.write_without_names(cloud, path)
    with written(path) as beside, beside.open("wb") as file:
        counts = cloud.mask.sum(axis=1)
        np.savez_compressed(file, points=cloud.positions[cloud.mask], counts=counts, times=cloud.times)


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() != ".npz":
        raise RecordingError("path", "has a suffix that no reader of clouds knows", str(path), "use an .npz file")
