"""Triangle meshes of cloth: vertices in space, coordinates on the flat fabric, and places of markers.

`grid`, `equilateral`, `disk` and `icosphere` make them, `read_mesh` reads them.
"""

from .export import write_obj, write_obj_sequence, write_ply, write_ply_sequence
from .files import read_mesh
from .grids import equilateral, grid
from .locality import renumbered
from .places import Places
from .shapes import disk, icosphere
from .triangle_mesh import TriangleMesh
from .unfold import unfold

__all__ = [
    "Places",
    "TriangleMesh",
    "disk",
    "equilateral",
    "grid",
    "icosphere",
    "read_mesh",
    "renumbered",
    "unfold",
    "write_obj",
    "write_obj_sequence",
    "write_ply",
    "write_ply_sequence",
]
