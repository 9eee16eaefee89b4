"""Recordings as NumPy archives, the format to keep: exact, compact, and never pickled.

    positions  (frames, markers, 3)  length unit of the JSON beside it, else m; NaN = not seen
    times      (frames,)             s, strictly increasing
    clamped    (driven,)             optional: indices of the markers whose motion is given

Further arrays are allowed and not read.
"""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..recording import Recording

_REQUIRED = ("positions", "times")
# What NumPy and zipfile raise on damaged archives, and NumPy on arrays that only pickle could read.
_DAMAGE = (OSError, EOFError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile, zlib.error)


def read(path: Path) -> Recording:
    """Read an archive.

    Raises:
        RecordingError: it is no NPZ archive, is damaged, lacks a key, or an array is not plain numbers.
    """
    arrays = _arrays(path)
    return Recording(
        positions=arrays["positions"],
        times=arrays["times"],
        clamped=np.atleast_1d(arrays.get("clamped", np.array([], dtype=np.int64))).tolist(),
    )


def write(recording: Recording, path: Path) -> None:
    """Write positions, times and clamped, compressed."""
    clamped = np.array(recording.clamped, dtype=np.int64)
    with path.open("wb") as file:  # an open file keeps NumPy from appending a second suffix
        np.savez_compressed(file, positions=recording.positions, times=recording.times, clamped=clamped)


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        archive = np.load(path, allow_pickle=False)
    except _DAMAGE as error:
        fix = "write it with numpy.savez or Recording.save"
        raise RecordingError(str(path), "is no NPZ archive, or a damaged one", str(error), fix) from error
    if not isinstance(archive, np.lib.npyio.NpzFile):
        fix = "write the arrays by name with numpy.savez(path, positions=..., times=...)"
        raise RecordingError(str(path), "is a single array (NPY), not an NPZ archive", archive.shape, fix)
    with archive:
        missing = [key for key in _REQUIRED if key not in archive.files]
        if missing:
            fix = "store positions (frames, markers, 3) and times (frames,) under these names"
            raise RecordingError(str(path), f"lacks {' and '.join(missing)}", sorted(archive.files), fix)
        wanted = [key for key in (*_REQUIRED, "clamped") if key in archive.files]
        return {key: _array(archive, key, path) for key in wanted}


def _array(archive: np.lib.npyio.NpzFile, key: str, path: Path) -> np.ndarray:
    try:
        return archive[key]
    except _DAMAGE as error:
        fix = "store plain numeric arrays, and copy or export the file again if it is damaged"
        raise RecordingError(f"{path}: {key}", "cannot be read", str(error), fix) from error
