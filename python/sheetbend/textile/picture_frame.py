"""The picture frame test of woven fabrics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..mesh import grid
from ..motion.equilibrium import Equilibrium
from ..objects.cloth import Cloth
from ..objects.fabric import Fabric
from ..quantities.quantities import Term
from ..scene.scene import Scene
from .arguments import check_specimen
from .flat import flat_rest, jaw, specimen
from .reading import Reading, combined


@dataclass(frozen=True)
class PictureFrame:
    """Result of `picture_frame`.

    Attributes:
        force: along the diagonal, at the frame's corner.
        shear_force: per length of a side, force / (2 side cos(half of the angle between the sides)).
        stiffness: that over the shear angle.
        rest: the fabric in the frame.
    """

    force: Reading
    shear_force: Reading
    stiffness: Reading
    rest: Equilibrium


def picture_frame(fabric: Fabric, *, angle: float = 20.0, side: float = 0.2, cells: int = 6) -> PictureFrame:
    """The picture frame of the woven fabrics benchmark (Cao et al. 2008, Composites A 39, 1037-1053).

    A square frame of hinged bars, the yarns along them, is pulled at a corner: the bars' lengths stay, the angle
    between them falls from a right one by the shear angle. The fabric fills the frame and is held along all of it.

    Args:
        angle: shear angle, degrees.
        side: m.
        cells: along a side.

    Raises:
        SceneError: the angle or the side is not positive.
        NoEquilibriumError: the fabric comes to no rest.
    """
    check_specimen("picture_frame", fabric, {"angle": angle, "side": side}, cells)
    half = math.radians(angle) / 2.0
    scene, cloth = specimen(fabric, grid(side, side, cells, cells))
    a, b = cloth.mesh.vertices[:, :2].T
    border = np.unique(cloth.mesh.borders)
    _bars(scene, cloth, border)
    start = np.column_stack([a * math.cos(half) + b * math.sin(half), a * math.sin(half) + b * math.cos(half), 0.0 * a])
    rest = flat_rest(scene, cloth, start, frame_half_angle=half)
    by_half = np.column_stack([b * math.cos(half) - a * math.sin(half), a * math.cos(half) - b * math.sin(half), 0 * a])
    # the work of the bars on the fabric per shear angle is that of the diagonal's force
    bar = by_half[border] / 2.0
    moment = float((rest.forces["bars"] * bar).sum())
    gradient = combined((1.0, rest.gradient(None, {"bars": bar})), leave=("frame_half_angle",))
    lever = side * math.sin(math.pi / 4.0 - half)
    per_side = side**2 * math.cos(2.0 * half)

    def over(size: float, unit: str) -> Reading:
        return Reading(moment / size, unit, combined((1.0 / size, gradient)), unit, 1.0)

    return PictureFrame(over(lever, "N"), over(per_side, "N/m"), over(per_side * 2.0 * half, "N/m"), rest)


def _bars(scene: Scene, cloth: Cloth, border: Array) -> None:
    """Hold the border on bars along (cos h, sin h) and (sin h, cos h), h being `frame_half_angle`, rad."""
    anchors = jaw(scene, cloth, border, "bars")
    scene.add_quantity("frame_half_angle", 0.0, "rad", positive=False)
    for n, at in zip(anchors, cloth.mesh.vertices[border], strict=True):
        scene.shift_base(int(n), -at)
    a, b = cloth.mesh.vertices[border, :2].T
    for axis, along, across in ((0, a, b), (1, b, a)):
        for function, coefficient in (("cos", along), ("sin", across)):
            scene.add_terms([Term("position", 3 * anchors + axis, coefficient, (("frame_half_angle", function),))])
