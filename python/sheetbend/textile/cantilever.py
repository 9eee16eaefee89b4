"""The cantilever test: a strip pushed over an edge bends under its own weight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..mesh import grid
from ..motion.equilibrium import Equilibrium, equilibrium
from ..objects.cloth import add_cloth
from ..objects.fabric import Fabric
from ..scene.scene import Scene
from .arguments import check_specimen
from .flat import turned, warp_angle
from .reading import Reading, combined
from .root import root

GRAVITY = 9.81
_CHORD_GAMMA = 8.004197  # weight * length^3 / rigidity at a chord of 41.5 degrees, of an inextensible strip
_HELD = 2  # cells on the platform
_MOST_ACROSS = 40  # cells: a strip that bends within millimeters has longer cells across than along


@dataclass(frozen=True)
class Cantilever:
    """Result of `cantilever`.

    Attributes:
        overhang: at which the tip reaches the inclined plane.
        bending_length: half of that.
        rigidity: weight per area times bending length cubed.
        rest: the strip at that overhang, the platform's edge at the origin.
    """

    overhang: Reading
    bending_length: Reading
    rigidity: Reading
    rest: Equilibrium


def cantilever(
    fabric: Fabric, along: str = "warp", *, width: float = 0.025, angle: float = 41.5, cells: int = 20
) -> Cantilever:
    """The cantilever test of ASTM D1388 (option A), BS 3356 and FAST-2, after Peirce (1930).

    A strip is pushed over a platform's edge until the line from the edge to its tip lies 41.5 degrees below the
    horizontal. The bending length c is half the overhang then, and the rigidity W c^3, W being the weight per area.
    The strip is held flat on the platform. Its rigidity comes out 0.05 % above the fabric's (Peirce's rule is exact for
    a chord of 41.5 degrees but for that), plus the mesh's part, which falls with the square of the cell.

    Args:
        along: the strip's direction, "warp" or "weft".
        width: m.
        angle: of the inclined plane, degrees.
        cells: along the overhang.

    Raises:
        SceneError: the width or the angle is not positive.
        NoEquilibriumError: the strip comes to no rest.
    """
    check_specimen("cantilever", fabric, {"width": width, "angle": angle}, cells)
    warp_angle(along)
    stiff = fabric.bending_weft if along == "weft" and fabric.bending_weft is not None else fabric.bending
    guess = (_CHORD_GAMMA * stiff / (fabric.density * GRAVITY)) ** (1.0 / 3.0)

    # a mesh of one number of cells, whatever the length: its inputs are compared below
    across = min(max(2, round(width * (cells + 0.5) / guess)), _MOST_ACROSS)

    def measure(length: float) -> tuple[float, float, tuple[Equilibrium, dict[str, float], float]]:
        rest = equilibrium(_scene(fabric, along, length, width, (cells, across)))
        chord, bar = _chord(rest)
        inputs_bar = rest.input_gradient(bar)
        # the inputs are simple functions of the length, so a difference of them will do
        h = 1e-5 * length
        longer, shorter = (_scene(fabric, along, length + d, width, (cells, across)).compiled.inputs() for d in (h, -h))
        by_length = float(inputs_bar @ (longer - shorter)) / (2.0 * h)
        return chord / math.radians(angle) - 1.0, by_length / math.radians(angle), (
            rest, rest.by_name(inputs_bar), by_length
        )  # fmt: skip

    length, (rest, chord_bar, by_length) = root(measure, guess)
    overhang = combined((-1.0 / by_length, chord_bar))
    c = length / 2.0
    rigidity = fabric.density * GRAVITY * c**3
    by_c = combined((1.5 * rigidity / c, overhang))
    by_c["cloth_density"] += rigidity / fabric.density
    return Cantilever(
        Reading(length, "m", overhang, "mm", 1e3),
        Reading(c, "m", combined((0.5, overhang)), "mm", 1e3),
        Reading(rigidity, "N m", by_c, "uN m", 1e6),
        rest,
    )


def _scene(fabric: Fabric, along: str, length: float, width: float, counts: tuple[int, int]) -> Scene:
    """The strip, flat, with so many cells along the overhang and across. A clamp acts in the middle of the cell between
    held and free vertices: the edge lies there."""
    cells, across = counts
    cell = length / (cells + 0.5)
    mesh = grid((cells + _HELD) * cell, width, cells + _HELD, across, pattern="one_way")
    held = mesh.within((-1.0, -1.0, -1.0), ((_HELD + 0.5) * cell, 2.0 * width, 1.0))
    scene = Scene("cantilever", gravity=(0.0, 0.0, -GRAVITY))
    at = mesh.vertices - [(_HELD - 0.5) * cell, width / 2.0, 0.0]
    cloth = add_cloth(scene, turned(mesh, warp_angle(along)), held=held, positions=at, **fabric.options())
    scene.pin(cloth.particles[held])
    return scene


def _chord(rest: Equilibrium) -> tuple[float, Array]:
    """Angle of the chord below the horizontal, rad, and its derivative with respect to the positions."""
    cloth = rest.scene.cloths["cloth"]
    tip = cloth.particles[cloth.mesh.sets["right"]]
    x, _, z = rest.positions[tip].mean(axis=0)
    bar = np.zeros_like(rest.positions)
    bar[tip] = np.array([z, 0.0, -x]) / (x * x + z * z) / len(tip)
    return math.atan2(-z, x), bar
