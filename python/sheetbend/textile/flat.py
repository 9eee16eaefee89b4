"""Specimens that are pulled or sheared in their plane by jaws.

A specimen stays flat, as the laboratory wants it: it is given the bending of a thick plate, which has no part in a flat
state. So wrinkles do not show.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array
from ..errors import InputError
from ..mesh import TriangleMesh
from ..motion.equilibrium import Equilibrium, equilibrium
from ..objects.cloth import Cloth, add_cloth
from ..objects.fabric import Fabric
from ..objects.laws import Stiffening
from ..quantities.quantities import Term
from ..scene.scene import Scene

_HALVINGS = 40


def turned(mesh: TriangleMesh, degrees: float) -> TriangleMesh:
    """The same piece in the x-y plane, cut with its warp at an angle to x."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return TriangleMesh(mesh.vertices, mesh.triangles, mesh.vertices[:, :2] @ [[c, -s], [s, c]], mesh.sets)


def warp_angle(along: str) -> float:
    """Degrees from the specimen's axis to the warp."""
    if along not in ("warp", "weft"):
        raise InputError("along", "is unknown", along, "give 'warp' or 'weft'")
    return 0.0 if along == "warp" else 90.0


def specimen(fabric: Fabric, mesh: TriangleMesh) -> tuple[Scene, Cloth]:
    """A weightless scene with the cloth, kept flat."""
    scene = Scene("specimen", gravity=(0.0, 0.0, 0.0))
    stiffest = fabric.warp if fabric.weft is None else max(fabric.warp, fabric.weft)
    plate = {"bending": stiffest * float(np.ptp(mesh.vertices, axis=0).max()) ** 2, "bending_model": "dihedral"}
    options = fabric.options() | {"bending_weft": None, "bending_twist": None} | plate
    return scene, add_cloth(scene, mesh, **options)


def jaw(scene: Scene, cloth: Cloth, vertices: Array, name: str) -> Array:
    """Clamp vertices rigidly to anchors, which are returned; the forces of the group `name` are those on the cloth."""
    anchors = scene.add_hidden(cloth.mesh.vertices[vertices], 1.0, pinned=True)
    pairs = np.column_stack([cloth.particles[vertices], anchors])
    scene.add_constraints("attachment", pairs, name=name, rest=np.zeros((len(pairs), 3)))
    return anchors


def travel(scene: Scene, anchors: Array, name: str, axis: int) -> None:
    """Let anchors move along an axis by the quantity `name`, m."""
    scene.add_quantity(name, 0.0, "m", positive=False)
    scene.add_terms([Term("position", 3 * anchors + axis, 1.0, ((name, "identity"),))])


def strip_strain(fabric: Fabric, along: str, load: float) -> float:
    """About the strain of a free strip under a load, N/m: where a test that asks for a load may start."""
    stiffness = fabric.warp if along == "warp" or fabric.weft is None else fabric.weft
    low, high = 0.0, load / stiffness
    if not isinstance(fabric.law, Stiffening):
        return 0.5 * high
    b = fabric.law.warp if along == "warp" else fabric.law.weft
    for _ in range(_HALVINGS):
        strain = (low + high) / 2.0
        green = strain + strain**2 / 2.0
        # in logarithms, since the exponential may overflow
        over = math.log(stiffness * green * (1.0 + strain) / load) + fabric.law.log_growth(b, green) > 0.0
        low, high = (low, strain) if over else (strain, high)
    return (low + high) / 2.0


def flat_rest(scene: Scene, cloth: Cloth, start: ArrayLike, **settings: float) -> Equilibrium:
    """The rest in the plane; start (vertices, 3) m, `settings` are the jaws' travels."""
    x = scene.nodes
    x[cloth.particles] = start
    return equilibrium(scene, x, settings)


def jaw_force(rest: Equilibrium, axis: int) -> tuple[float, dict[str, float]]:
    """Force of the "jaw" on the cloth along an axis, N, and its derivative with respect to every quantity."""
    forces = rest.forces["jaw"]
    bar = np.zeros_like(forces)
    bar[:, axis] = 1.0
    return float(forces[:, axis].sum()), rest.gradient(None, {"jaw": bar})
