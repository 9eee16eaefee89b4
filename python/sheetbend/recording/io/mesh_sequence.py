"""A folder of OBJ or PLY files, a frame each, as simulators and scanners write them: every vertex is a marker.

Files go by the numbers in their names. The JSON beside the folder (`frames.json` of `frames/`) says `rate`, frames per
second, which no such file knows. Vertices are v0, v1, ... in the order of the files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import MeshError, RecordingError
from ...files.door import check_room
from ..marker_data import MarkerData
from . import sidecar
from .natural import by_number

ASSUMED = ("times",)  # replaced by those of the rate, without which nothing is read
SUFFIXES = (".obj", ".ply")


def read(path: Path) -> MarkerData:
    """Read the frames of a folder.

    Raises:
        RecordingError: no such files or both kinds, a frame that cannot be read or has more or fewer vertices, or no
            rate.
        MissingExtraError: trimesh is not installed.
    """
    from ...mesh.files import vertices_of

    files = sorted((p for p in path.iterdir() if p.suffix.lower() in SUFFIXES), key=by_number)
    if len({file.suffix.lower() for file in files}) != 1:
        inside = sorted(p.name for p in path.iterdir())[:5]
        fix = (
            "give a recording's file, several of the same thing, or the folder of a sequence of meshes. If each file "
            "holds one marker, put them into one table: time,<marker>_x,<marker>_y,<marker>_z,..."
        )
        raise RecordingError(str(path), f"holds no sequence of {' or of '.join(SUFFIXES)}", inside, fix)
    if "rate" not in sidecar.beside(path):
        fix = f'write {{"rate": 25, "units": "m"}} with the frames per second into {path.with_suffix(".json").name}'
        raise RecordingError(str(path.with_suffix(".json")), "does not say the rate", "no rate", fix)
    frames: list[np.ndarray] = []
    in_files = sum(file.stat().st_size for file in files)
    for file in files:
        if frames:
            check_room(
                path, f"{len(files)} frames of {len(frames[0])} vertices", len(files) * frames[0].nbytes, in_files
            )
        try:
            frames.append(vertices_of(file))
        except MeshError as error:
            raise RecordingError(error.field, error.problem, error.got, error.fix) from error
        if frames[-1].shape != frames[0].shape:
            fix = "export all frames of one mesh with the same options, without remeshing"
            problem = f"has not as many vertices as {files[0].name}, {len(frames[0])}"
            raise RecordingError(str(file), problem, len(frames[-1]), fix)
    names = tuple(f"v{k}" for k in range(len(frames[0])))
    return MarkerData(np.array(frames), np.arange(len(frames), dtype=float), names)
