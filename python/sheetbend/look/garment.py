"""A configuration for a garment from a mesh file: a cloth that hangs by its upper rim."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MeshError
from ..files.units import METERS
from ..mesh import read_mesh
from ..mesh.topology import components, edges
from .cloth_sheet import AIR
from .draft import Draft, written
from .take import Measured
from .text import table

FILES = (".obj", ".ply", ".stl")
RIM = 0.03  # of the height: vertices that are so near the top are held
SUBSTEP = 0.004  # s
COTTON = {"density": 0.15, "warp": 500.0, "shear": 50.0, "bending": 1e-5}
DAMPING = {"membrane_damping": 5e-3, "bend_damping": 2e-2}  # s
AIR_ALONG = 0.02  # kg/m^3
UNITS = ("m", "cm", "mm")  # of the file, in the order in which they are tried
LARGE = 4.0  # m: no garment is


def draft_of_mesh(
    path: Path, file: str, name: str, measured: Measured, units: str | None, upward: str | None = None
) -> Draft:
    """A configuration for the mesh of a garment.

    Args:
        path: an OBJ, PLY or STL file.
        file: what the configuration calls it.
        units: length unit of the file; None takes the largest in which it is no larger than a garment.
        upward: the axis that points up, "x", "-y", ...; None takes y in OBJ files, else z.

    Raises:
        MeshError: the file cannot be read, its triangles are no surface, or it is too large in any unit.
    """
    up = upward or ("y" if path.suffix.lower() == ".obj" else "z")
    axis, sign = "xyz".index(up[-1]), -1.0 if up.startswith("-") else 1.0
    way = (sign * np.eye(3)[axis]).tolist()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # they come again when the draft is built
        mesh = read_mesh(path, "unfold", units or "m", warp=way, merge=True)
    largest = float(np.ptp(mesh.vertices, axis=0).max())
    unit = units or next((u for u in UNITS if largest * METERS[u] < LARGE), None)
    if unit is None:
        raise MeshError("unit", "is in doubt: no garment is so large", largest, "give the unit of the file")
    scale = METERS[unit] if units is None else 1.0
    vertices, area = scale * mesh.vertices, scale**2 * float(mesh.areas.sum())
    size, low, top = np.ptp(vertices, axis=0), vertices.min(axis=0), (sign * vertices[:, axis]).max()
    rim = top - RIM * size[axis]
    held = sign * vertices[:, axis] >= rim
    piece = components(len(vertices), edges(mesh.triangles))
    falling = len(np.setdiff1d(piece, piece[held]))
    is_up = np.arange(3) == axis
    corner = "lower" if sign > 0 else "upper"  # of a box that is open above
    box = np.where(is_up, sign * rim, low - size.max() if sign > 0 else low + 2 * size.max())
    seen = [
        f"{file}: {len(vertices)} vertices, {len(mesh.triangles)} triangles, "
        f"{' x '.join(f'{v:.3g}' for v in size)} m, {area:.3g} m^2 of fabric",
        f"lengths are taken as {unit}",
        f"{held.sum()} vertices lie within {RIM:.0%} of its height of the top: they are held",
    ]
    unknown = ["what holds the garment: its upper rim is taken, where it is. Change the box of the set, or add a grip"]
    if falling:
        unknown.append(
            f"what joins its {len(np.unique(piece))} pieces: {falling} of them hang on nothing that is held, and fall. "
            "Sew them in the program that made the mesh, so that they share vertices, or hold each with a set"
        )
    if not upward:
        unknown.append(f"which axis points up: {up} is taken, as in most files of this kind; --up z says another")
    unknown += [
        "the fabric: the numbers of a light woven cotton are assumed. `sheetbend fabric` finds those of a fabric from "
        "tests, and `fabric_file` takes them",
        "the warp: it is taken to run upward. Give texture coordinates in meters, or change `warp`",
        "the body in it: nothing touches the fabric, and it does not touch itself. docs/contact.md and "
        "docs/self_contact.md have both",
    ]
    given = {} if measured.density is None else {"density": measured.density}
    cloth: dict[str, Any] = {"name": "cloth"} | COTTON | DAMPING | given
    cloth |= {"air_normal": AIR, "air_tangential": AIR_ALONG, "pinned": ["held"]}
    shape = {"kind": "file", "file": file, "unit": unit, "material": "unfold", "warp": way, "merge": True}
    lines = table("[scene]", {"gravity": np.where(is_up, -9.81 * sign, 0.0).tolist()})
    lines += table("[solver]", {"method": "newton", "h": SUBSTEP}, {"h": "s"})
    notes = {"density": "kg/m^2", "warp": "N/m", "shear": "N/m", "bending": "N m"}
    lines += table("[[scene.cloth]]", cloth, notes)
    lines += table("[scene.cloth.mesh]", shape, {"merge": "vertices that exporters split at seams"})
    lines += table(
        "[[scene.cloth.set]]", {"name": "held", corner: box.tolist()}, {corner: "m, corner of a box that is open above"}
    )
    return written("a garment", name, [file], seen, unknown, lines, "mesh")
