"""Files of recordings. A format is one module with `read(path) -> MarkerData` and, unless it is only read,
`write(recording, path)`.

A reader takes the numbers as they stand in the file; length units, names and whatever else the JSON beside
the file tells (`sidecar`) are applied here, the same for every format. A reader whose files name their length
unit gives it as metadata["units"]. To add a format, write its module and add its line to `FORMATS`. A format whose
files do not say times or driven markers names those in `ASSUMED`: ("times",), ("clamped",) or both; its reader
assumes them, and the JSON may replace them. A folder of meshes, a frame each, is read by `mesh_sequence`.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from ...errors import RecordingError
from ...files.door import check_file, reading
from ...files.whole import written
from ..marker_data import MarkerData
from ..recording_checks import check_seen
from . import c3d, csv, deform, mesh_sequence, npy, npz, sidecar, trc

FORMATS: dict[str, ModuleType] = {
    ".npz": npz,
    ".csv": csv,
    ".c3d": c3d,
    ".trc": trc,
    ".pkl": deform,
    ".pickle": deform,
    ".p": deform,
    ".npy": npy,
    ".tsv": csv,
    ".txt": csv,
}

ELSEWHERE = {
    ".mat": "in Python: np.savez('take.npz', positions=..., times=...) of what scipy.io.loadmat gives, or in MATLAB: "
    "writetable to a .csv with the columns time,tip_x,tip_y,tip_z,...",
    ".toml": "it is a configuration: give it to `sheetbend fit`, simulate or info",
    ".xlsx": "save the sheet as CSV",
    ".xls": "save the sheet as CSV",
    ".bag": "export the poses as CSV, as `rostopic echo -p` does",
    ".db3": "export the poses as CSV",
    ".mcap": "export the poses as CSV",
    ".bvh": "export the markers as C3D, TRC or CSV; a skeleton holds none",
    ".fbx": "export the markers as C3D, TRC or CSV; a skeleton holds none",
    ".gz": "unpack it first (gunzip)",
    ".bz2": "unpack it first (bunzip2)",
    ".xz": "unpack it first (unxz)",
    ".zip": "unpack it first (unzip)",
    ".h5": "in Python: np.savez('take.npz', positions=..., times=...) of what h5py.File gives",
    ".hdf5": "in Python: np.savez('take.npz', positions=..., times=...) of what h5py.File gives",
    ".pt": "in Python: np.savez('take.npz', positions=..., times=...) of what torch.load gives",
    ".pth": "in Python: np.savez('take.npz', positions=..., times=...) of what torch.load gives",
    ".joblib": "in Python: np.savez('take.npz', positions=..., times=...) of what joblib.load gives",
    ".parquet": "save the table as CSV",
    ".tak": "export the take as CSV in Motive",
}
"""What to do about files that laboratories have and that are not read, by suffix."""


OF_JSON = (
    "in Python: sb.Recording(positions, times, names).save('take.csv') of what json.load gives. If it is the JSON "
    "beside a recording, give the recording"
)


def read(path: Path, units: str | None = None) -> MarkerData:
    """Read the recording at path and the JSON beside it; see `Recording.load`."""
    with reading(path):
        return _read(path if path.name.strip(".") else path.resolve(), units)


def _read(path: Path, units: str | None) -> MarkerData:
    if path.is_dir() and path.suffix.lower() not in FORMATS:
        return sidecar.apply(mesh_sequence.read(path), path, units, mesh_sequence.ASSUMED)
    file_format = _format(path)
    check_file(path)
    if path.stat().st_size == 0:
        raise RecordingError(str(path), "is empty", "0 bytes", "export the recording again")
    return sidecar.apply(file_format.read(path), path, units, _assumed(file_format))


def told_unit(path: Path) -> str | None:
    """The length unit that the file at path, or the JSON beside it, tells; None where neither does.

    Raises:
        RecordingError: as `Recording.load` does.
    """
    with reading(path):
        told = sidecar.beside(path).get("units")
        if told is None and not path.is_dir():
            told = "m" if path.suffix.lower() == ".npz" else _format(path).read(path).metadata.get("units")
        return told


def write(recording: MarkerData, path: Path) -> None:
    """Write the recording and the JSON beside it; see `Recording.save`."""
    file_format = _format(path)
    if not hasattr(file_format, "write"):
        raise RecordingError("path", "ends in what is only read", str(path), "save it as .npz or .csv")
    if not path.parent.is_dir():
        fix = "make the folder first"
        raise RecordingError("path", "lies in a folder that does not exist", str(path), fix)
    check_seen(recording.positions, recording.markers)  # a piece may lack a marker; a file may not
    sidecar.write(recording, path, _assumed(file_format))
    with written(path) as beside:
        file_format.write(recording, beside)


def _format(path: Path) -> ModuleType:
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        known = " or ".join(FORMATS)
        others = ELSEWHERE | {".json": OF_JSON}  # in a folder, such files stand beside recordings
        fix = others.get(path.suffix.lower(), f"use a file that ends in {known}")
        raise RecordingError("path", "has a suffix that no reader knows", str(path), fix) from None


def _assumed(file_format: ModuleType) -> tuple[str, ...]:
    assumed: tuple[str, ...] = getattr(file_format, "ASSUMED", ())
    return assumed
