"""The tensile test of the KES and FAST systems."""

from __future__ import annotations

from dataclasses import dataclass

from ..mesh import grid
from ..motion.equilibrium import Equilibrium
from ..motion.values import elastic_energy, elastic_energy_gradient
from ..objects.fabric import Fabric
from .arguments import check_specimen
from .flat import flat_rest, jaw, jaw_force, specimen, strip_strain, travel, turned, warp_angle
from .reading import GRAM_FORCE, Reading, combined
from .root import root


@dataclass(frozen=True)
class Uniaxial:
    """Result of `uniaxial`.

    Attributes:
        extension: EMT, the strain at the load.
        energy: WT, work per area up to the load.
        linearity: LT, that over the energy of a straight line to the same point.
        rest: the specimen under the load.
    """

    extension: Reading
    energy: Reading
    linearity: Reading
    rest: Equilibrium


def uniaxial(
    fabric: Fabric,
    along: str = "warp",
    *,
    load: float = 5e4 * GRAM_FORCE,
    width: float = 0.2,
    gauge: float = 0.05,
    cells: int = 6,
) -> Uniaxial:
    """The tensile test of KES-FB1 (Kawabata 1980): 20 cm wide, 5 cm between jaws, pulled to 500 gf/cm.

    FAST-1 is load = 98.07 N/m (E100), width = 0.05 m and gauge = 0.1 m. The jaws let nothing narrow. The fabric is
    elastic, so there is no resilience RT to read.

    Args:
        along: direction of the pull, "warp" or "weft".
        load: N/m, per width at rest.
        width, gauge: of the specimen at rest, m.
        cells: along the gauge.

    Raises:
        SceneError: a size or the load is not positive.
        NoEquilibriumError: the load is not reached.
    """
    check_specimen("uniaxial", fabric, {"load": load, "width": width, "gauge": gauge}, cells)
    scene, cloth = specimen(
        fabric, turned(grid(gauge, width, cells, max(2, round(cells * width / gauge))), warp_angle(along))
    )
    x = cloth.mesh.vertices
    jaw(scene, cloth, cloth.mesh.sets["left"], "fixed_jaw")
    travel(scene, jaw(scene, cloth, cloth.mesh.sets["right"], "jaw"), "jaw_travel", 0)

    def measure(strain: float) -> tuple[float, float, tuple[Equilibrium, float, dict[str, float]]]:
        rest = flat_rest(scene, cloth, x * [1.0 + strain, 1.0, 1.0], jaw_travel=strain * gauge)
        force, by = jaw_force(rest, 0)
        return force / (load * width) - 1.0, by["jaw_travel"] * gauge / (load * width), (rest, force, by)

    strain, (rest, force, by) = root(measure, strip_strain(fabric, along, load))
    own = ("jaw_travel",)
    extension = combined((-1.0 / (by["jaw_travel"] * gauge), by), leave=own)
    area = gauge * width
    work = sum(float(e.sum()) for e in elastic_energy(scene, rest.positions, {"jaw_travel": strain * gauge}).values())
    energy = combined((1.0 / area, elastic_energy_gradient(rest)), leave=own)
    energy = combined((1.0, energy), (force / width, extension))
    line = load * strain / 2.0
    linearity = combined((1.0 / line, energy), (-work / area / line / strain, extension))
    return Uniaxial(
        Reading(strain, "", extension, "%", 100.0),
        Reading(work / area, "J/m^2", energy, "gf cm/cm^2", 0.01 / GRAM_FORCE),
        Reading(work / area / line, "", linearity, "", 1.0),
        rest,
    )
