"""Recordings as NumPy archives, the format to keep: exact, compact, and never pickled.

    positions  (frames, markers, 3)  length unit of the JSON beside it, else m; NaN = not seen
    times      (frames,)             s, strictly increasing
    clamped    (driven,)             optional: indices of the markers whose motion is given

Further arrays are allowed and not read. A few bytes of an archive can unpack to gigabytes: sizes are checked
before anything is unpacked (`door.check_room`), against what the archive says and against what its arrays say.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ...errors import RecordingError
from ...files.door import check_room
from ...files.whole import written
from ..marker_data import MarkerData

_REQUIRED = ("positions", "times")
# What zipfile and NumPy raise on damaged archives and headers; what else they may is told by `reading`.
_DAMAGE = (OSError, EOFError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile, zlib.error)
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # as NumPy does; others take memory as the file says
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def read(path: Path) -> MarkerData:
    """Read an archive.

    Raises:
        RecordingError: it is no NPZ archive, is damaged, lacks a key, holds more than `door.check_room` allows, or
            an array is not plain numbers.
    """
    fix = (
        "store positions (frames, markers, 3) and times (frames,) under these names; sb.Cloud.load reads a cloud, and "
        "sb.Recording.from_poses makes markers of a body's poses"
    )
    arrays = plain_arrays(path, _REQUIRED, ("clamped",), fix)
    return MarkerData(
        positions=arrays["positions"],
        times=arrays["times"],
        clamped=np.atleast_1d(arrays.get("clamped", np.array([], dtype=np.int64))).tolist(),
    )


def write(recording: MarkerData, path: Path) -> None:
    """Write positions, times and clamped, compressed."""
    clamped = np.array(recording.clamped, dtype=np.int64)
    with written(path) as beside, beside.open("wb") as file:  # an open file keeps NumPy from appending a second suffix
        np.savez_compressed(file, positions=recording.positions, times=recording.times, clamped=clamped)


def plain_arrays(
    path: Path, required: Sequence[str], optional: Sequence[str] = (), fix: str = "store it under this name"
) -> dict[str, np.ndarray]:
    """Arrays of an archive by name.

    Raises:
        RecordingError: as `read`; `fix` says what to do about one that is missing.
    """
    with path.open("rb") as file:
        if file.read(len(npy.MAGIC_PREFIX)) == npy.MAGIC_PREFIX:
            fix = "write the arrays by name with numpy.savez(path, " + ", ".join(f"{key}=..." for key in required) + ")"
            raise RecordingError(str(path), "is a single array (NPY), not an NPZ archive", path.name, fix)
    try:
        archive = zipfile.ZipFile(path)
    except _DAMAGE as error:
        write_it = "write it with numpy.savez or Recording.save"
        raise RecordingError(str(path), "is not an NPZ archive, or a damaged one", str(error), write_it) from error
    with archive:
        members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        missing = [key for key in required if key not in members]
        if missing:
            raise RecordingError(str(path), f"lacks {' and '.join(missing)}", sorted(members), fix)
        wanted = {key: members[key] for key in (*required, *optional) if key in members}
        unpacked = sum(info.file_size for info in wanted.values())
        check_room(path, f"arrays that unpack to {unpacked} bytes", unpacked)
        return {key: _array(archive, info, path, key) for key, info in wanted.items()}


def single_array(path: Path) -> np.ndarray:
    """The array of an NPY file.

    Raises:
        RecordingError: it is none, is damaged, or does not hold plain numbers.
    """
    try:
        return _unpacked(path.read_bytes())
    except _DAMAGE as error:
        fix = "write it with numpy.save, of plain numbers"
        raise RecordingError(str(path), "is not an NPY file, or a damaged one", str(error), fix) from error


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo, path: Path, key: str) -> np.ndarray:
    try:
        if info.compress_type not in _PACKED:
            raise ValueError(f"packed by method {info.compress_type}, not by deflate")
        with archive.open(info) as member:
            content = member.read(info.file_size + 1)  # checked; zipfile gives no more, and compares the checksum
        return _unpacked(content)
    except _DAMAGE as error:
        fix = "store plain numeric arrays, and copy or export the file again if it is damaged"
        raise RecordingError(f"{path}: {key}", "cannot be read", str(error), fix) from error


def _unpacked(content: bytes) -> np.ndarray:
    """The array of an NPY file, whose header may say no more than there is."""
    stream = BytesIO(content)
    version = npy.read_magic(stream)
    if version not in _HEADERS:
        raise ValueError(f"version {version} of NPY, which is not for plain arrays")
    shape, by_columns, dtype = _HEADERS[version](stream)
    if dtype.hasobject:
        raise ValueError("an array of Python objects")
    _check_shape(shape, dtype, len(content) - stream.tell())
    if 0 in shape or dtype.itemsize == 0:
        return np.zeros(shape, dtype)
    flat: np.ndarray = np.frombuffer(content, dtype, offset=stream.tell())
    return flat.reshape(shape, order="F" if by_columns else "C")


def _check_shape(shape: tuple[int, ...], dtype: np.dtype[Any], size: int) -> None:
    if any(n < 0 for n in shape) or math.prod(shape) * dtype.itemsize != size:
        raise ValueError(f"an array of shape {shape}, {dtype}, from {size} bytes")
