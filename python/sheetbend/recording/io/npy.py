"""Recordings as one NumPy array (frames, markers, 3), or (frames, 3, markers) where that is the only way to read it.
Another order of the axes is read where the motion shows it (`axes`).

The file holds no times: the JSON beside it must say `rate`, frames per second. NaN is a marker not seen, and so is
exactly (0, 0, 0) where a marker is otherwise far from there. Lengths are in the unit of the JSON, meters without one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import RecordingError
from ...files.door import check_room
from ..marker_data import MarkerData
from . import npz, sidecar
from .axes import Ordered, ordered
from .lost import without_zeros

ASSUMED = ("times",)
"""What the files do not say; see `sheetbend.recording.io`."""
USUAL = (0, 1, 2)  # the axes of frames, markers and coordinates
MANY, MORE = 100, 5  # markers, and markers per frame, from which on the axes are in another order


def read(path: Path) -> MarkerData:
    """Read an array.

    Raises:
        RecordingError: it is no plain array of numbers of this shape, or the JSON does not say the rate.
    """
    size = path.stat().st_size
    check_room(path, f"an array of {size} bytes", size)
    array = npz.single_array(path)
    found = ordered(array, USUAL) if array.ndim == 3 and array.dtype.kind in "fiu" else None
    if found is None and array.ndim == 3 and array.shape[1] == 3:
        found = Ordered(np.swapaxes(array, 1, 2))
    if found is None or array.dtype.kind not in "fiu":
        fix = "store one array of numbers (frames, markers, 3)"
        raise RecordingError(str(path), "must have the shape (frames, markers, 3)", array.shape, fix)
    array = found.positions
    if array.shape[1] >= MANY and array.shape[1] > MORE * len(array):
        fix = "if its axes are (markers, frames, 3), store `numpy.swapaxes(x, 0, 1)`"
        raise RecordingError(str(path), "has far more markers than frames", array.shape, fix)
    if found.times is None and "rate" not in sidecar.beside(path):
        fix = f'write {{"rate": 100, "units": "m"}} with the frames per second into {path.with_suffix(".json").name}'
        raise RecordingError(str(path.with_suffix(".json")), "does not say the rate", "no rate", fix)
    times = np.arange(len(array), dtype=float) if found.times is None else found.times
    metadata = {"mended": list(found.words)} if found.words else {}
    return MarkerData(without_zeros(array.astype(float)), times, metadata=metadata)
