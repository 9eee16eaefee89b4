"""C3D, the binary format of motion capture systems (www.c3d.org): its points, in integers or floats, from PCs, DECs and
MIPS machines.

Points that were not seen carry a negative residual, or lie at exactly 0, 0, 0. Analog channels are left out, and so are
points that are no places (angles, forces, moments and powers that a biomechanical model adds) and points never seen.
Times count from the first frame of the file. The file does not say which way is down.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.units import METERS
from ..marker_data import MarkerData
from .lost import without_zeros

_BLOCK = 512
_KEY = 0x50
_ORDERS = {84: "<", 85: "<", 86: ">"}
_DEC = 85
_MOST_BLOCKS = 255  # of parameters: a byte counts them
_LONG = 0xFFFF  # frames: the header counts no more
_NO_PLACES = ("ANGLES", "FORCES", "MOMENTS", "POWERS")


@dataclass(frozen=True)
class _Machine:
    """Numbers as the processor that wrote the file has them."""

    order: str
    dec: bool

    def words(self, data: bytes) -> NDArray[Any]:
        return np.frombuffer(data, dtype=f"{self.order}i2")

    def floats(self, data: bytes) -> Array:
        if self.dec:  # the halves of VAX's F-floating change places, and its exponent is two more
            swapped = np.frombuffer(data, dtype="<u2").reshape(-1, 2)[:, ::-1].tobytes()
            return np.frombuffer(swapped, dtype="<f4").astype(np.float64) / 4.0
        return np.frombuffer(data, dtype=f"{self.order}f4").astype(np.float64)


def read(path: Path) -> MarkerData:
    """Read the points of a file; their unit is passed on as metadata["units"].

    Raises:
        RecordingError: it is no C3D, is cut off, or says no known unit or rate.
    """
    data = path.read_bytes()
    if len(data) < _BLOCK or data[1] != _KEY:
        raise RecordingError(str(path), "is not a C3D file", f"{len(data)} bytes", "export it again as C3D")
    try:
        machine, said = _parameters(data)
        return _recording(path, data, machine, said)
    except (struct.error, IndexError, ValueError, KeyError, TypeError, OverflowError) as error:
        if isinstance(error, RecordingError):
            raise
        fix = "export it again as C3D"
        raise RecordingError(str(path), "is damaged or cut off", f"{type(error).__name__}: {error}", fix) from error


def _recording(path: Path, data: bytes, machine: _Machine, said: dict[tuple[str, str], Any]) -> MarkerData:
    head = machine.words(data[:20]).astype(np.uint16)
    count, analog, first, last, start = (int(head[k]) for k in (1, 2, 3, 4, 8))
    (scale,) = machine.floats(data[12:16])
    (rate,) = machine.floats(data[20:24])
    rate = said.get(("POINT", "RATE"), [rate])[0] or rate
    if not 0 < rate < np.inf:
        raise RecordingError(str(path), "says no frames per second", float(rate), "export it again with its rate")
    units = said.get(("POINT", "UNITS"), ["mm"])[0]
    if units not in METERS:
        fix = f"export it in {', '.join(METERS)}"
        raise RecordingError(str(path), "names no known length unit", units, fix)
    size = 4 if scale < 0 else 2
    frames = _frames(said, first, last)
    begin, width = (start - 1) * _BLOCK, (4 * count + analog) * size
    body = data[begin : begin + frames * width]
    if count == 0 or frames < 1 or len(body) < frames * width:
        got = f"{len(body)} bytes for {frames} frames of {count} points"
        raise RecordingError(str(path), "is damaged or cut off", got, "export it again as C3D")
    table = (machine.floats(body) if scale < 0 else machine.words(body).astype(np.float64)).reshape(frames, -1)
    points = table[:, : 4 * count].reshape(frames, count, 4)
    x = points[:, :, :3] * (1.0 if scale < 0 else scale)
    x[points[:, :, 3] < 0] = np.nan
    x = without_zeros(x)
    names = _labels(said, count)
    added = {label for kind in _NO_PLACES for label in said.get(("POINT", kind), [])}
    keep = [k for k in range(count) if names[k] not in added and not np.isnan(x[:, k, 0]).all()]
    if not keep:
        raise RecordingError(str(path), "holds no point that is ever seen", f"{count} points", "export the markers")
    markers = tuple(names[k] for k in keep)
    return MarkerData(x[:, keep], np.arange(frames) / rate, markers, metadata={"units": units})


def _frames(said: dict[tuple[str, str], Any], first: int, last: int) -> int:
    """How many frames there are: as the header tells, or the group TRIAL where the header's numbers end."""
    start, stop = (said.get(("TRIAL", f"ACTUAL_{which}_FIELD"), []) for which in ("START", "END"))
    if last == _LONG and len(start) == len(stop) == 2:
        first, last = ((int(low) & _LONG) + ((int(high) & _LONG) << 16) for low, high in (start, stop))
    return last - first + 1


def _labels(said: dict[tuple[str, str], Any], count: int) -> list[str]:
    """POINT:LABELS, LABELS2 and so on, of 255 points each; points without one are m0, m1, ..."""
    labels: list[str] = []
    for k in range(1, count // 255 + 2):
        labels += said.get(("POINT", "LABELS" if k == 1 else f"LABELS{k}"), [])
    return [labels[k] if k < len(labels) and labels[k] else f"m{k}" for k in range(count)]


def _parameters(data: bytes) -> tuple[_Machine, dict[tuple[str, str], Any]]:
    """Lists of text or numbers by group and name."""
    at = (data[0] - 1) * _BLOCK
    data = data[: at + _MOST_BLOCKS * _BLOCK]
    processor = data[at + 3]
    machine = _Machine(_ORDERS[processor], processor == _DEC)
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Any]] = []
    at += 4
    while True:
        length, group = struct.unpack_from("bb", data, at)
        if length == 0 or group == 0:
            break
        name = data[at + 2 : at + 2 + abs(length)].decode("latin-1").strip().upper()
        at += 2 + abs(length)
        (step,) = machine.words(data[at : at + 2])
        end = at + int(step)
        if step < 0:
            raise ValueError("a parameter points back to an earlier one")
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(data[: end if step else None], at + 2, machine)))
        if step == 0:
            break
        at = end
    return machine, {(groups[group], name): value for group, name, value in found if group in groups}


def _value(data: bytes, at: int, machine: _Machine) -> list[Any]:
    kind, dimensions = struct.unpack_from("bB", data, at)
    shape = list(data[at + 2 : at + 2 + dimensions])
    begin, count = at + 2 + dimensions, math.prod(shape)
    body = data[begin : begin + count * abs(kind)]
    if len(body) < count * abs(kind):
        raise ValueError("a parameter ends beyond the file")
    if kind == -1:
        width = shape[0] if shape else 1
        return [body[k : k + width].decode("latin-1").strip() for k in range(0, count, width or 1)]
    if kind == 4:
        return list(machine.floats(body).tolist())
    return list((machine.words(body) if kind == 2 else np.frombuffer(body, dtype="i1")).tolist())
