"""The bias extension test of woven fabrics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..mesh import grid
from ..motion.equilibrium import Equilibrium
from ..objects.fabric import Fabric
from .arguments import check_specimen
from .flat import flat_rest, jaw, jaw_force, specimen, travel, turned
from .reading import GRAM_FORCE, Reading, combined


@dataclass(frozen=True)
class BiasExtension:
    """Result of `bias_extension`.

    Attributes:
        force: of the jaws.
        angle: shear angle of the yarns in the middle of the specimen, as a camera sees it.
        kinematic_angle: rad, what it would be with yarns that neither stretch nor slip.
        stiffness: G that the benchmark's normalization makes of the force, with shear force per length G * angle.
        rest: the specimen, pulled.
    """

    force: Reading
    angle: Reading
    kinematic_angle: float
    stiffness: Reading
    rest: Equilibrium


def bias_extension(
    fabric: Fabric, *, extension: float = 0.01, length: float = 0.2, width: float = 0.1, cells: int = 8
) -> BiasExtension:
    """The bias extension test of the woven fabrics benchmark (Cao et al. 2008, Composites A 39, 1037-1053).

    A strip cut at 45 degrees to its yarns is pulled; its middle shears like a trellis. The mesh's edges run along the
    yarns: otherwise triangles lock, since yarns that hardly stretch leave them nothing to shear by.

    On a specimen twice as long as wide, of yarns that hardly stretch, the middle turns by `kinematic_angle`. On a
    longer one the yarns share the extension unevenly: at a ratio of three the middle turns by a sixth less.

    Args:
        extension: of the jaws' distance, m.
        length: between the jaws, at least twice the width, m.
        width: m.
        cells: across the width.

    Raises:
        InputError: the specimen is too short, or pulled beyond what a trellis can do.
        NoEquilibriumError: the specimen comes to no rest.
    """
    check_specimen("bias_extension", fabric, {"length": length, "width": width, "extension": extension}, cells)
    if length < 2.0 * width:
        raise InputError("length", "must be at least twice the width", length, "take a longer specimen")
    free = length - width
    stretch = (free + extension) / (math.sqrt(2.0) * free)
    if stretch >= 1.0:
        limit = (math.sqrt(2.0) - 1.0) * free
        raise InputError("extension", f"must lie between 0 and {limit:.4g} m", extension, "pull less")
    trellis = math.pi / 2.0 - 2.0 * math.acos(stretch)
    scene, cloth = specimen(
        fabric, turned(grid(length, width, round(cells * length / width), cells, pattern="crossed"), 45.0)
    )
    x = cloth.mesh.vertices
    jaw(scene, cloth, cloth.mesh.sets["left"], "fixed_jaw")
    travel(scene, jaw(scene, cloth, cloth.mesh.sets["right"], "jaw"), "jaw_travel", 0)
    strain = extension / length
    start = x * [1.0 + strain, 1.0 - strain, 1.0] + [0.0, strain * width / 2.0, 0.0]
    rest = flat_rest(scene, cloth, start, jaw_travel=extension)

    own = ("jaw_travel",)
    force, by = jaw_force(rest, 0)
    by_force = combined((1.0, by), leave=own)
    middle = np.abs(x[cloth.mesh.triangles].mean(axis=1)[:, :2] - [length / 2.0, width / 2.0]).sum(axis=1) < width / 4.0
    angle, bar = _shear_angle(rest, np.flatnonzero(middle))
    half = trellis / 2.0
    normal = (free / width) * (math.cos(half) - math.sin(half))
    normal /= (2.0 * length - 3.0 * width) * trellis * math.cos(trellis) + width * half * math.cos(half)
    return BiasExtension(
        Reading(force, "N", by_force, "gf", 1.0 / GRAM_FORCE),
        Reading(angle, "rad", combined((1.0, rest.gradient(bar)), leave=own), "deg", 180.0 / math.pi),
        trellis,
        Reading(normal * force, "N/m", combined((normal, by_force)), "N/m", 1.0),
        rest,
    )


def _shear_angle(rest: Equilibrium, triangles: Array) -> tuple[float, Array]:
    """Mean shear angle of the yarns in some triangles, rad, positive where the pulled diagonal grows, and its
    derivative with respect to the positions."""
    cloth = rest.scene.cloths["cloth"]
    corners, nodes = cloth.mesh.corners[triangles], cloth.particles[cloth.mesh.triangles[triangles]]
    x = rest.positions[nodes]
    to_yarns = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    yarns = to_yarns @ (x[:, 1:] - x[:, :1])  # (triangles, 2, 3), a unit of warp and of weft
    size = np.linalg.norm(yarns, axis=2, keepdims=True)
    along = yarns / size
    cosine = (along[:, 0] * along[:, 1]).sum(axis=1)
    weight = cloth.mesh.areas[triangles] / cloth.mesh.areas[triangles].sum()
    slope = -weight / np.sqrt(1.0 - cosine**2)
    yarns_bar = slope[:, None, None] * (along[:, ::-1] - cosine[:, None, None] * along) / size
    sides_bar = np.swapaxes(to_yarns, 1, 2) @ yarns_bar
    bar = np.zeros_like(rest.positions)
    for k in (0, 1):
        np.add.at(bar, nodes[:, k + 1], sides_bar[:, k])
        np.add.at(bar, nodes[:, 0], -sides_bar[:, k])
    return float(-(weight * np.arcsin(cosine)).sum()), bar
