"""The shear test of the KES system."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..arrays.checks import finite
from ..errors import InputError
from ..mesh import grid
from ..motion.equilibrium import Equilibrium
from ..objects.fabric import Fabric
from .arguments import check_specimen
from .flat import flat_rest, jaw, jaw_force, specimen, strip_strain, travel, turned, warp_angle
from .reading import GRAM_FORCE, Reading, combined
from .root import root

_GRAM_FORCE_PER_CM_DEGREE = 100.0 * GRAM_FORCE * 180.0 / math.pi  # N/m per rad


@dataclass(frozen=True)
class Shear:
    """Result of `shear`.

    Attributes:
        stiffness: G, the slope of shear force per width against the angle.
        forces: shear force per width at the angles between which the slope is taken.
        rest: the specimen at the last of them.
    """

    stiffness: Reading
    forces: tuple[Reading, Reading]
    rest: Equilibrium


def shear(
    fabric: Fabric,
    along: str = "warp",
    *,
    angles: tuple[float, float] = (0.5, 2.5),
    tension: float = 1e3 * GRAM_FORCE,
    width: float = 0.2,
    gauge: float = 0.05,
    cells: int = 6,
) -> Shear:
    """The shear test of KES-FB1 (Kawabata 1980): 20 cm wide, 5 cm between jaws, under 10 gf/cm of tension.

    One jaw moves along its own direction; across it the tension is kept. G is the slope of the force per width between
    0.5 and 2.5 degrees. The measured force contains tension * tan(angle). It lacks the force of the regions beside the
    free sides, which bear no load; their size grows as Y/G falls. The fabric is elastic, so there is no hysteresis
    2HG to read.

    Args:
        along: the yarns between the jaws, "warp" or "weft".
        angles: degrees.
        tension: across the jaws, N/m.
        width, gauge: of the specimen at rest, m.
        cells: along the gauge.

    Raises:
        SceneError: a size or the tension is not positive.
        NoEquilibriumError: the tension is not reached.
    """
    check_specimen("shear", fabric, {"tension": tension, "width": width, "gauge": gauge}, cells)
    if len(finite("angles", angles, (2,), InputError)) and angles[0] == angles[1]:
        raise InputError("angles", "must differ", angles, "give two angles in degrees")
    mesh = grid(width, gauge, max(2, round(cells * width / gauge)), cells)
    scene, cloth = specimen(fabric, turned(mesh, 90.0 - warp_angle(along)))
    x = mesh.vertices
    jaw(scene, cloth, mesh.sets["bottom"], "fixed_jaw")
    anchors = jaw(scene, cloth, mesh.sets["top"], "jaw")
    travel(scene, anchors, "jaw_shift", 0)
    travel(scene, anchors, "jaw_travel", 1)
    stretch = strip_strain(fabric, along, tension)
    forces, own = [], ("jaw_shift", "jaw_travel")
    for angle in angles:
        shift = math.tan(math.radians(angle))

        def measure(strain: float, shift: float = shift) -> tuple[float, float, tuple[Equilibrium, dict[str, float]]]:
            start = x * [1.0, 1.0 + strain, 1.0] + shift * x[:, [1]] * [1.0, 0.0, 0.0]
            rest = flat_rest(scene, cloth, start, jaw_shift=shift * gauge, jaw_travel=strain * gauge)
            force, by = jaw_force(rest, 1)
            return force / (tension * width) - 1.0, by["jaw_travel"] * gauge / (tension * width), (rest, by)

        stretch, (rest, across) = root(measure, stretch)
        force, by = jaw_force(rest, 0)
        kept = -by["jaw_travel"] / across["jaw_travel"]  # the jaw moves so that the tension stays
        gradient = combined((1.0 / width, by), (kept / width, across), leave=own)
        forces.append(Reading(force / width, "N/m", gradient, "gf/cm", 0.01 / GRAM_FORCE))
    low, high = forces
    by_angle = 1.0 / math.radians(angles[1] - angles[0])
    stiffness = Reading(
        (high.value - low.value) * by_angle,
        "N/m",
        combined((by_angle, high.gradient), (-by_angle, low.gradient)),
        "gf/(cm deg)",
        1.0 / _GRAM_FORCE_PER_CM_DEGREE,
    )
    return Shear(stiffness, (low, high), rest)
