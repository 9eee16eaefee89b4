"""Triangle meshes of cloth: vertices in space, coordinates on the flat fabric, and places of markers; meshes of solids.

`grid`, `equilateral`, `disk` and `icosphere` make sheets, `read_mesh` reads them; `bricks` and `tetrahedra` make
solids.
"""

from .export import write_obj, write_obj_sequence, write_ply, write_ply_sequence
from .files import read_mesh
from .grids import equilateral, grid
from .locality import renumbered
from .places import Places
from .shapes import disk, icosphere
from .solid_around import bricks_around
from .solid_files import read_solid
from .solid_mesh import SolidMesh, SolidPlaces, bricks, tetrahedra
from .triangle_mesh import TriangleMesh
from .unfold import unfold

__all__ = [
    "Places",
    "SolidMesh",
    "SolidPlaces",
    "TriangleMesh",
    "bricks",
    "bricks_around",
    "disk",
    "equilateral",
    "grid",
    "icosphere",
    "read_mesh",
    "read_solid",
    "renumbered",
    "tetrahedra",
    "unfold",
    "write_obj",
    "write_obj_sequence",
    "write_ply",
    "write_ply_sequence",
]
