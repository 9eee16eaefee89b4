"""Meshes and their motion as files for other programs: OBJ sequences and PLY."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite, numbers
from ..arrays.types import Array
from ..errors import MeshError
from ..files.whole import write_text, written
from .triangle_mesh import TriangleMesh


def write_obj(path: str | Path, mesh: TriangleMesh, positions: ArrayLike | None = None) -> None:
    """Write one OBJ, its material coordinates as texture coordinates in m; `read_mesh` reads it back.

    Args:
        positions: (n, 3) m; the mesh's own vertices by default.

    Raises:
        MeshError: positions of another shape, or a folder that does not exist.
    """
    x = _positions(mesh, positions, ())
    _check_folder(Path(path).parent)
    write_text(path, _vertex_lines(x) + _texture_and_faces(mesh))


def write_obj_sequence(folder: str | Path, mesh: TriangleMesh, positions: ArrayLike) -> list[Path]:
    """Write frame_00000.obj, frame_00001.obj, ... into `folder`, which is made if it is missing.

    Args:
        positions: (frames, n, 3) m.

    Returns:
        The files, in order.

    Raises:
        MeshError: positions of another shape, or the folder holds more frames of an earlier, longer sequence.
    """
    x = _sequence(mesh, positions)
    files = _frame_files(Path(folder), len(x), ".obj")
    tail = _texture_and_faces(mesh)
    for path, frame in zip(files, x, strict=True):
        write_text(path, _vertex_lines(frame) + tail)
    return files


def write_ply(
    path: str | Path,
    mesh: TriangleMesh,
    positions: ArrayLike | None = None,
    vertex_fields: Mapping[str, ArrayLike] | None = None,
    face_fields: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write a binary little-endian PLY in double precision, with a scalar property per field.

    Material coordinates are the properties s and t where the mesh has them per vertex.

    Args:
        positions: (n, 3) m; the mesh's own vertices by default.
        vertex_fields: (n,) numbers by name.
        face_fields: (m,) numbers by name, such as a strain per triangle.

    Raises:
        MeshError: a field of another shape, a name that PLY cannot hold, or a folder that does not exist.
    """
    x = _positions(mesh, positions, ())
    per_vertex = {"x": x[:, 0], "y": x[:, 1], "z": x[:, 2]}
    if mesh.material.ndim == 2:
        per_vertex |= {"s": mesh.material[:, 0], "t": mesh.material[:, 1]}
    per_vertex |= _fields("vertex_fields", vertex_fields, len(x), tuple(per_vertex))
    per_face = _fields("face_fields", face_fields, len(mesh.triangles), ("vertex_indices", "count"))

    vertices = np.empty(len(x), dtype=[(name, "<f8") for name in per_vertex])
    for name, values in per_vertex.items():
        vertices[name] = values
    faces = np.empty(
        len(mesh.triangles), [("count", "u1"), ("vertex_indices", "<i4", 3), *((n, "<f8") for n in per_face)]
    )
    faces["count"], faces["vertex_indices"] = 3, mesh.triangles
    for name, values in per_face.items():
        faces[name] = values
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment lengths in m; s, t: material coordinates in m",
        f"element vertex {len(vertices)}",
        *(f"property double {name}" for name in per_vertex),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        *(f"property double {name}" for name in per_face),
        "end_header",
    ]
    _check_folder(Path(path).parent)
    with written(path) as beside:
        beside.write_bytes("\n".join([*header, ""]).encode("ascii") + vertices.tobytes() + faces.tobytes())


def write_ply_sequence(
    folder: str | Path,
    mesh: TriangleMesh,
    positions: ArrayLike,
    vertex_fields: Mapping[str, ArrayLike] | None = None,
    face_fields: Mapping[str, ArrayLike] | None = None,
) -> list[Path]:
    """Write frame_00000.ply, frame_00001.ply, ... into `folder`, which is made if it is missing, each as `write_ply`.

    Args:
        positions: (frames, n, 3) m.
        vertex_fields: (frames, n) numbers by name.
        face_fields: (frames, m) numbers by name.

    Returns:
        The files, in order.

    Raises:
        MeshError: as `write_ply`, or the folder holds more frames of an earlier, longer sequence.
    """
    x = _sequence(mesh, positions)
    fields: list[dict[str, Array]] = []
    for kind, given, count in (
        ("vertex_fields", vertex_fields, len(mesh.vertices)),
        ("face_fields", face_fields, len(mesh.triangles)),
    ):
        named = {} if given is None else given
        check_kind(kind, named, Mapping, "give arrays by name, or leave it out", MeshError)
        fields.append({name: numbers(f"{kind}[{name!r}]", values, MeshError) for name, values in named.items()})
        for name, values in fields[-1].items():
            if values.shape != (len(x), count):
                shape = (len(x), count)
                raise MeshError(f"{kind}[{name!r}]", "has the wrong shape", values.shape, f"give {shape}")
    files = _frame_files(Path(folder), len(x), ".ply")
    for frame, path in enumerate(files):
        of_vertices, of_faces = ({name: values[frame] for name, values in own.items()} for own in fields)
        write_ply(path, mesh, x[frame], of_vertices, of_faces)
    return files


def frame_files(folder: Path, count: int, suffix: str) -> list[Path]:
    """The paths of a sequence in a folder, in order."""
    return [folder / f"frame_{frame:05d}{suffix}" for frame in range(count)]


def _frame_files(folder: Path, count: int, suffix: str) -> list[Path]:
    """The paths of a sequence in a folder, which is made if it is missing."""
    files = frame_files(folder, count, suffix)
    others = sorted(set(folder.glob(f"frame_*{suffix}")) - set(files))
    if others:
        raise MeshError("folder", "holds frames of another sequence", str(others[0]), "empty it or take another one")
    _check_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    return files


def _positions(mesh: TriangleMesh, positions: ArrayLike | None, frames: tuple[int, ...]) -> Array:
    check_kind("mesh", mesh, TriangleMesh, "give such as sb.mesh.grid(width, height, nx, ny)", MeshError)
    return finite(
        "positions", mesh.vertices if positions is None else positions, (*frames, *mesh.vertices.shape), MeshError
    )


def _sequence(mesh: TriangleMesh, positions: ArrayLike) -> Array:
    frames = finite("positions", positions, None, MeshError)
    return _positions(mesh, frames, frames.shape[:1])


def _fields(name: str, fields: Mapping[str, ArrayLike] | None, count: int, taken: tuple[str, ...]) -> dict[str, Array]:
    found = {}
    for field, values in (fields or {}).items():
        if not (field.isascii() and field.isidentifier()) or field in taken:
            raise MeshError(
                name, "has a name that cannot stand in the file", field, "use letters, digits and _, once each"
            )
        array = np.asarray(values, dtype=float)
        if array.shape != (count,):
            raise MeshError(f"{name}[{field!r}]", "has the wrong shape", array.shape, f"give ({count},)")
        found[field] = array  # NaN is allowed: a field may be unknown in places
    return found


def _check_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise MeshError("path", "lies in a folder that does not exist", str(folder), "make the folder first")


def _vertex_lines(x: Array) -> str:
    return "".join(f"v {a:.10g} {b:.10g} {c:.10g}\n" for a, b, c in x.tolist())


def _texture_and_faces(mesh: TriangleMesh) -> str:
    corner = mesh.triangles if mesh.material.ndim == 2 else np.arange(mesh.triangles.size).reshape(-1, 3)
    texture = "".join(f"vt {u:.10g} {v:.10g}\n" for u, v in mesh.material.reshape(-1, 2).tolist())
    ends = np.stack([mesh.triangles, corner], axis=-1).reshape(-1, 6) + 1
    return texture + "".join("f {}/{} {}/{} {}/{}\n".format(*row) for row in ends.tolist())
