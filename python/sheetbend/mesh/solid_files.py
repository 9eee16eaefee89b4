"""Meshes of solids from files, through meshio: Gmsh (.msh), VTK (.vtk, .vtu), Abaqus (.inp) and MEDIT (.mesh)."""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..arrays.checks import finite
from ..errors import MeshError
from ..files.door import check_file, note, reading
from ..files.units import METERS
from ..optional import require
from .gmsh_counts import check_counts
from .solid_mesh import SolidMesh

FORMATS = {".msh": "gmsh", ".vtk": "vtk", ".vtu": "vtu", ".inp": "abaqus", ".mesh": "medit"}
"""By suffix, what meshio calls the format."""
KINDS = {"hexahedron": 8, "tetra": 4}
_SHOWN = re.compile(rb"\bnp\.float(?:32|64)\(([-+.\w]+)\)")


def read_solid(path: str | Path, unit: str = "m") -> SolidMesh:
    """Read a mesh of hexahedra of eight nodes or of linear tetrahedra.

    Vertices keep the order of the file; those that no element uses are left out, and so are the file's points, lines
    and faces. Named sets of points, and groups of elements with a name, become `sets` of vertices.

    Args:
        path: a file of Gmsh (.msh), VTK (.vtk, .vtu), Abaqus (.inp) or MEDIT (.mesh).
        unit: of the file's positions, "m", "cm", "mm", "in" or "ft".

    Warns:
        UserWarning: elements of other kinds, which are left out.

    Raises:
        MeshError: the file is missing or not readable, it has both kinds or none, or its elements are no solid.
        MissingExtraError: meshio is not installed.
    """
    if not isinstance(unit, str) or unit not in METERS:
        raise MeshError("unit", "is unknown", unit, f"use one of {', '.join(METERS)}")
    with reading(path, MeshError):
        return _mesh(Path(path), METERS[unit])


def _mesh(path: Path, meters: float) -> SolidMesh:
    if path.suffix.lower() not in FORMATS:
        raise MeshError("path", "has a suffix that no reader knows", str(path), f"use one of {', '.join(FORMATS)}")
    check_file(path, MeshError)
    if path.suffix.lower() == ".msh":
        check_counts(path)
    content = _load(path)
    blocks: dict[str, list[Any]] = {}
    for block in content.cells:
        blocks.setdefault(block.type, []).append(block.data)
    found = [kind for kind in KINDS if kind in blocks]
    if len(found) != 1:
        fix = "export hexahedra of eight nodes alone, or linear tetrahedra alone"
        raise MeshError(str(path), "has not exactly one kind of solid element", sorted(blocks), fix)
    others = sorted(set(blocks) - {*found, "vertex", "line", "triangle", "quad"})
    if others:
        warnings.warn(f"{path.name}: elements of other kinds are left out: {', '.join(others)}.", stacklevel=4)
    elements = np.concatenate(blocks[found[0]]).astype(np.int64)
    points = meters * finite(f"{path.name}: points", content.points, None, MeshError)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{path.name}: points", "have the wrong shape", points.shape, "export a mesh in space")
    bad = elements[(elements < 0) | (elements >= len(points))]
    if bad.size:
        raise MeshError(f"{path.name}: elements", "name points that do not exist", int(bad[0]), "export it again")
    used, own = np.unique(elements, return_inverse=True)
    place = np.full(len(points), -1)
    place[used] = np.arange(len(used))
    sets = {name: place[ids] for name, ids in _named(content).items()}
    kept = {str(name): ids[ids >= 0] for name, ids in sets.items() if (ids >= 0).any()}
    return SolidMesh(points[used], own.reshape(elements.shape), kept)


def _named(content: Any) -> dict[str, Any]:
    """Points by name: of sets of points, and of groups of elements as Gmsh has them."""
    found = {name: np.unique(np.asarray(ids, dtype=int)) for name, ids in (content.point_sets or {}).items()}
    tags = content.cell_data.get("gmsh:physical", [])
    for name, (tag, _) in content.field_data.items():
        own = [block.data[np.asarray(t) == tag].ravel() for block, t in zip(content.cells, tags, strict=False)]
        if own:
            found[name] = np.unique(np.concatenate(own)).astype(int)
    return found


@contextlib.contextmanager
def _in_numbers(path: Path) -> Iterator[Path]:
    """The file, or a copy of it where values of a text file of Gmsh are written as NumPy shows them, "np.float64(1.0)"
    for 1.0, which meshio writes (with NumPy 2) and does not read."""
    content = path.read_bytes() if path.suffix.lower() == ".msh" else b""
    numbers = _SHOWN.sub(rb"\1", content)
    if numbers == content:
        yield path
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_bytes(numbers)
        yield copy


def _load(path: Path) -> Any:
    meshio = require("meshio", "mesh")
    note(path)
    quiet = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
            warnings.simplefilter("ignore")
            with _in_numbers(path) as file:
                return meshio.read(file, file_format=FORMATS[path.suffix.lower()])
    except (Exception, SystemExit) as problem:  # whatever a damaged file makes the library raise
        raise MeshError(
            str(path), f"cannot be read ({problem})", type(problem).__name__, "export it again"
        ) from problem
