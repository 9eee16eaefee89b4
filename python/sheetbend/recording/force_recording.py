"""Recorded forces: what a robot's wrist or a load cell measured over time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import numbers
from ..arrays.types import Array
from ..errors import RecordingError
from ..files.door import check_room, reading
from ..files.whole import written
from .io import cells, clock, npz
from .recording_checks import checked_times

FORCES, TORQUES, TURNS = ("fx", "fy", "fz"), ("tx", "ty", "tz"), ("qx", "qy", "qz", "qw")
_FIX = "start with time,fx,fy,fz, then tx,ty,tz and qx,qy,qz,qw where they were recorded"


@dataclass(frozen=True, eq=False)
class ForceRecording:
    """Measured forces over time, in the sensor's own axes. NaN marks what was not measured.

    Attributes:
        times: (samples,) s, strictly increasing, on the clock of the markers but for a `ForceSensor.time_offset`.
        forces: (samples, 3) N.
        torques: (samples, 3) N m about the sensor's point; None where none were measured.
        quaternions: (samples, 4), (x, y, z, w), from the sensor's axes to the world's; None for a sensor that does not
            turn (`ForceSensor.quaternion`).
        name: what reports call it.

    Raises:
        RecordingError: shapes, infinite numbers, times that do not increase, quaternions without a length.
    """

    times: Array
    forces: Array
    torques: Array | None = None
    quaternions: Array | None = None
    name: str = "force"

    def __post_init__(self) -> None:
        times = checked_times(self.times, None)
        put = {"times": times, "forces": _samples("forces", self.forces, (len(times), 3))}
        if self.torques is not None:
            put["torques"] = _samples("torques", self.torques, (len(times), 3))
        if self.quaternions is not None:
            q = _samples("quaternions", self.quaternions, (len(times), 4))
            size = np.linalg.norm(q, axis=1)
            if not (size > 0).all():
                bad = int(np.argmin(size > 0))
                fix = "give (x, y, z, w) of every sample"
                raise RecordingError("quaternions", f"have no length in sample {bad}", q[bad].tolist(), fix)
            put["quaternions"] = q / size[:, None]
        for key, value in put.items():
            value.setflags(write=False)
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        return f"ForceRecording({self.name!r}, {len(self.times)} samples)"

    @classmethod
    def load(cls, path: str | Path) -> ForceRecording:
        """Read a CSV table or an NPZ archive.

        A table has a header: `time` (s), `fx`, `fy`, `fz` (N), and optionally `tx`, `ty`, `tz` (N m) and `qx`, `qy`,
        `qz`, `qw`. Times in `time_ms`, `time_us` or `time_ns` count from the first row. A load cell with one axis
        leaves out the others. An archive has the arrays `times`, `forces`, and optionally `torques` and `quaternions`.

        Raises:
            RecordingError: the file is missing, damaged, of another kind or no valid recording.
        """
        path = Path(path)
        with reading(path):
            if path.suffix.lower() == ".npz":
                found = npz.plain_arrays(path, ("times", "forces"), ("torques", "quaternions"))
                return cls(**found, name=path.stem)
            if path.suffix.lower() == ".csv":
                return _table(path)
            raise RecordingError(str(path), "is of an unknown kind", path.suffix, "give a .csv or an .npz file")

    def save(self, path: str | Path) -> None:
        """Write an NPZ archive that `load` reads, whole or not at all."""
        arrays = {"times": self.times, "forces": self.forces, "torques": self.torques, "quaternions": self.quaternions}
        with written(path) as beside, beside.open("wb") as file:
            np.savez_compressed(file, **{key: a for key, a in arrays.items() if a is not None})  # type: ignore[arg-type]


def _samples(field: str, values: ArrayLike, shape: tuple[int, int]) -> Array:
    array = numbers(field, values, RecordingError, copy=True)
    if array.shape != shape:
        raise RecordingError(field, "must have one row per sample", array.shape, f"give {shape}")
    if np.isinf(array).any():
        where = np.argwhere(np.isinf(array))[0].tolist()
        raise RecordingError(field, f"is infinite at index {where}", float(array[tuple(where)]), "give NaN where lost")
    return array


def _table(path: Path) -> ForceRecording:
    text = [(n, line) for n, line in cells.lines(path) if line.strip() and not line.lstrip().startswith("#")]
    if not text:
        raise RecordingError(str(path), "holds no header", "only blank lines and comments", _FIX)
    delimiter = next((d for d in (",", ";", "\t") if d in text[0][1]), ",")
    (first, header), *rows = [(n, cells.split(path, n, line, delimiter)) for n, line in text]
    known = (*FORCES, *TORQUES, *TURNS)
    unit = clock.unit(header[0])
    if unit is None:
        cells.refuse(path, first, "must be a header whose first column is time", header[0], _FIX)
    for k, column in enumerate(header[1:], start=1):
        if column not in known or column in header[1:k]:
            cells.refuse(path, first, "must name its columns " + ", ".join(known) + ", each once", column, _FIX)
    if not rows:
        raise RecordingError(str(path), "has a header but no rows", "0 samples", "add one row per sample")
    if not set(header) & {*FORCES, *TORQUES}:
        cells.refuse(path, first, "has no column of a force or a torque", header, _FIX)
    check_room(path, f"{len(rows)} samples", 8 * len(rows) * (1 + len(known)))
    for line, row in rows:
        if len(row) != len(header):
            cells.refuse(path, line, f"must have {len(header)} cells, like the header", len(row))
    at = {name: k for k, name in enumerate(header)}

    def columns(names: tuple[str, ...]) -> Array | None:
        if not set(names) & set(at):
            return None
        return np.array([[cells.number(path, n, row[at[c]]) if c in at else np.nan for c in names] for n, row in rows])

    forces = columns(FORCES)
    return ForceRecording(
        clock.times(path, rows, unit),
        np.full((len(rows), 3), np.nan) if forces is None else forces,
        columns(TORQUES),
        columns(TURNS),
        path.stem,
    )
