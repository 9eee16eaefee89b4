"""Meshes from OBJ, PLY and STL files, through trimesh."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import MeshError
from ..files.door import check_file, note, reading
from ..files.units import METERS
from ..optional import require
from .alike import turned_alike
from .triangle_mesh import TriangleMesh
from .unfold import unfold
from .validate import checked_triangles, refuse_broken, signed_areas

# How trimesh keeps the order of the file's vertices, and how it splits them where texture coordinates differ.
_FORMATS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    ".obj": ({"maintain_order": True, "skip_materials": True}, {"skip_materials": True}),
    ".ply": ({"fix_texture": False, "skip_materials": True}, {"fix_texture": True, "skip_materials": True}),
    ".stl": ({}, {}),
}
_SMALLEST, _LARGEST = 2e-3, 20.0  # m: sizes of fabrics, and of balls and sleeves made of them
_DISTORTED = 1.25  # of a side: more than fabrics stretch in a drape
_OTHER_SIZE = 2.0  # of lengths between texture and shape: more is no stretch but another unit


def read_mesh(
    path: str | Path,
    material: str | ArrayLike | None = None,
    unit: str = "m",
    texture_size: float | ArrayLike = 1.0,
    warp: ArrayLike = (1.0, 0.0, 0.0),
    merge: bool = False,
) -> TriangleMesh:
    """Read a mesh. Its vertices keep the order of the file; in STL, which repeats them, equal ones are merged.

    Triangles that name a vertex twice, in the file or after merging, are left out: they have no area.

    Args:
        path: an .obj, .ply or .stl file.
        material: "texture" takes the file's texture coordinates, "unfold" takes the shape in the file as flat fabric
            unrolled (`unfold`), an array gives the coordinates, (n, 2) or (m, 3, 2) m. None: "texture" where the file
            has it, else "unfold".
        unit: of the file's positions, "m", "cm", "mm", "in" or "ft".
        texture_size: m per unit of texture coordinates, one number or (u, v).
        warp: (3,) direction of warp for "unfold".
        merge: mend what exporters leave: make one vertex of those at equal positions, as they are split where normals
            differ, leave out triangles that repeat others and vertices without a triangle, and turn triangles that face
            against the others.

    Warns:
        UserWarning: for each of the mesh's `doubts`, for triangles left out, and for a size that suggests another unit.

    Raises:
        MeshError: the file is missing or not readable, its texture coordinates are not in meters, or its triangles are
            no surface.
        MissingExtraError: trimesh is not installed.
    """
    with reading(path, MeshError):
        return _mesh(Path(path), material, unit, texture_size, warp, merge)


def _mesh(
    path: Path,
    material: str | ArrayLike | None,
    unit: str,
    texture_size: float | ArrayLike,
    warp: ArrayLike,
    merge: bool,
) -> TriangleMesh:
    if unit not in METERS:
        raise MeshError("unit", "is unknown", unit, f"use one of {', '.join(METERS)}")
    vertices, triangles, texture = _read(path)
    if merge:
        vertices, triangles = _merged(vertices, triangles)
    vertices, said = vertices * METERS[unit], [_other_unit(vertices * METERS[unit], unit)]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    if not whole.all():
        triangles, texture = triangles[whole], None if texture is None else texture[whole]
        said.append(f"{(~whole).sum()} triangles that name a vertex twice are left out.")
    if merge and len(triangles):
        vertices, triangles, texture, mended = _mended(vertices, triangles, texture)
        said += mended
    for doubt in filter(None, said):
        warnings.warn(f"{path.name}: {doubt}", stacklevel=3)
    triangles = checked_triangles(triangles, len(vertices))
    if isinstance(material, str) and material not in ("texture", "unfold"):
        raise MeshError("material", "is unknown", material, "use 'texture', 'unfold' or an array")
    if material is None:
        material = "unfold" if texture is None else "texture"
    if not isinstance(material, str):
        coordinates = finite("material", material, None, MeshError)
    elif material == "texture":
        coordinates = _scaled_texture(path, vertices[triangles], texture, texture_size)
        distorted = _distortion(vertices[triangles], coordinates)
        if distorted:
            warnings.warn(f"{path.name}: {distorted}", stacklevel=3)
    else:
        refuse_broken(triangles, len(vertices))
        coordinates = unfold(vertices, triangles, warp)
    mesh = TriangleMesh(vertices, triangles, _per_vertex(coordinates, triangles, len(vertices)))
    for doubt in mesh.doubts:
        warnings.warn(f"{path.name}: {doubt}", stacklevel=3)
    return mesh


def _other_unit(vertices: Array, unit: str) -> str:
    """A sentence on a size that no fabric has; none on others."""
    size = float(np.ptp(vertices, axis=0).max())
    if _SMALLEST < size < _LARGEST:
        return ""
    return f"the mesh is {size:.3g} m large, read in {unit}. Give the unit of the file, 'mm' or 'cm' or 'm'."


def vertices_of(path: Path) -> Array:
    """(n, 3) vertices of a file, in its order and unit.

    Raises:
        MeshError: it cannot be read.
    """
    return np.array(_load(path, _FORMATS[path.suffix.lower()][0]).vertices, dtype=float)


def _read(path: Path) -> tuple[Array, NDArray[np.int64], Array | None]:
    """Vertices (n, 3), triangles (m, 3), and texture coordinates (m, 3, 2) where the file has them."""
    if path.suffix.lower() not in _FORMATS:
        raise MeshError("path", "has a suffix that no reader knows", str(path), f"use one of {', '.join(_FORMATS)}")
    check_file(path, MeshError)
    ordered, split = _FORMATS[path.suffix.lower()]
    whole = _load(path, ordered)
    vertices, triangles = np.array(whole.vertices, dtype=float), np.array(whole.faces, dtype=np.int64)
    if path.suffix.lower() == ".stl":
        return *_merged(vertices, triangles), None
    textured = _load(path, split)
    uv = getattr(textured.visual, "uv", None)
    return vertices, triangles, None if uv is None else np.array(uv, dtype=float)[textured.faces]


def _load(path: Path, options: dict[str, Any]) -> Any:
    trimesh = require("trimesh", "mesh")
    note(path)
    try:
        content = path.read_bytes()
        if path.suffix.lower() == ".obj":
            _check_corners(content)
        with warnings.catch_warnings(), _quiet():
            warnings.simplefilter("ignore", RuntimeWarning)  # of arithmetic on what a file leaves out
            file = BytesIO(content)  # so that the library opens no other file, which this one may name
            mesh = trimesh.load_mesh(file, file_type=path.suffix.lower()[1:], process=False, **options)
    except Exception as problem:  # whatever a damaged file makes the library raise
        raise MeshError(
            str(path), f"cannot be read ({problem})", type(problem).__name__, "export it again"
        ) from problem
    if len(mesh.faces) == 0:
        raise MeshError(str(path), "has no triangles", f"{len(mesh.vertices)} vertices", "export it with its faces")
    return mesh


def _check_corners(content: bytes) -> None:
    """Refuse faces of an OBJ whose corners are not among the vertices: the library makes tables up to their numbers."""
    size = len(content)
    for face in re.finditer(rb"(?m)^[ \t]*f[^\n]*?[0-9]{%d}[^\n]*" % len(str(size)), content):
        largest = max(re.findall(rb"[0-9]+", face[0]), key=len)
        if len(largest) > len(str(size)) or int(largest) > size:
            raise ValueError("a face names a vertex that is not there")


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence what the library logs of damaged files; their errors are raised by the readers."""
    log, silent = logging.getLogger("trimesh"), logging.NullHandler()
    before, log.propagate = log.propagate, False  # its parts log under names of their own
    log.addHandler(silent)
    try:
        yield
    finally:
        log.removeHandler(silent)
        log.propagate = before


def _merged(vertices: Array, triangles: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """One vertex for equal positions, in the order of their first use."""
    _, first, index = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return vertices[np.sort(first)], rank[index.ravel()][triangles]


def _mended(
    vertices: Array, triangles: NDArray[np.int64], texture: Array | None
) -> tuple[Array, NDArray[np.int64], Array | None, list[str]]:
    """A mesh without repeated triangles and unused vertices, whose triangles face one way, and sentences on each."""
    said = []
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    if len(first) < len(triangles):
        said.append(f"{len(triangles) - len(first)} triangles that repeat others are left out.")
        first.sort()
        triangles, texture = triangles[first], None if texture is None else texture[first]
    turned = turned_alike(triangles)
    if len(turned):
        triangles = triangles.copy()
        triangles[turned] = triangles[turned][:, ::-1]
        if texture is not None:
            texture = texture.copy()
            texture[turned] = texture[turned][:, ::-1]
        said.append(f"{len(turned)} triangles that face against the others are reversed.")
    used, renumbered = np.unique(triangles, return_inverse=True)
    if len(used) < len(vertices):
        said.append(f"vertices without a triangle are left out: {len(vertices) - len(used)}.")
        vertices, triangles = vertices[used], renumbered.reshape(-1, 3)
    return vertices, triangles, texture, said


def _scaled_texture(path: Path, corners: Array, texture: Array | None, size: float | ArrayLike) -> Array:
    """Texture coordinates in meters; refused where they make another size of fabric than the shape in the file."""
    if texture is None:
        fix = "use material='unfold', or export the file with texture coordinates"
        raise MeshError(str(path), "has no texture coordinates", "none", fix)
    scale = finite("texture_size", size, None, MeshError)
    if scale.shape not in ((), (2,)) or not (scale > 0).all():
        raise MeshError("texture_size", "must be one or two positive lengths", scale.tolist(), "give m per unit")
    scaled: Array = texture * scale
    shape = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    flat = np.abs(signed_areas(scaled)).sum()
    ratio = np.sqrt(shape / flat) if flat > 0 else np.inf
    if not 1 / _OTHER_SIZE < ratio < _OTHER_SIZE:
        fix = f"give m per unit; {scale.max() * ratio:.6g} makes the areas equal, or use material='unfold'"
        problem = f"makes {flat:.3g} m^2 of fabric from a shape of {shape:.3g} m^2"
        raise MeshError("texture_size", problem, scale.tolist(), fix)
    return scaled


def _distortion(corners: Array, flat: Array) -> str:
    """A sentence on triangles whose sides are far from those in the material; none where there are none."""
    shape, sides = (np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2) for x in (corners, flat))
    ratio = shape / np.maximum(sides, np.finfo(float).tiny)
    off = np.exp(np.abs(np.log(np.maximum(ratio, np.finfo(float).tiny))))
    far = (off > _DISTORTED).any(axis=1)
    if not far.any():
        return ""
    return (
        f"{far.sum()} of {len(far)} triangles have sides up to {off.max():.2g} times longer or shorter than in the "
        "texture: as a flat pattern it would start them strained. Give material='unfold' where the shape is at rest."
    )


def _per_vertex(coordinates: Array, triangles: NDArray[np.int64], count: int) -> Array:
    """Coordinates per vertex where all corners of each vertex have the same; else as they are."""
    if coordinates.shape != (len(triangles), 3, 2):
        return coordinates
    found = np.zeros((count, 2))
    found[triangles] = coordinates
    return found if np.array_equal(found[triangles], coordinates) else coordinates
