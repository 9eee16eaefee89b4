"""The laboratory's sheet of three fabrics, what each number depends on, and a picture of their drapes.

python experiments/textile_tests/laboratory.py [picture.png]
"""

from __future__ import annotations

import sys

import numpy as np
import sheetbend as sb
from sheetbend import textile
from sheetbend.pictures.drawing import ACCENT, GRAY, INK, WARM, new_figure
from sheetbend.pictures.plotting import save
from sheetbend.textile.shadow import shadow

# Wang, O'Brien, Ramamoorthi 2011, as shipped with ARCSim: stiffness at small strain, rigidity at low curvature along
# warp, weft and at 45 degrees
FABRICS = {
    "denim": (0.324, 218.0, 1037.0, 68.0, 64e-6, 97e-6, 73e-6),
    "trouser twill": (0.220, 2060.0, 2100.0, 70.0, 125e-6, 125e-6, 108e-6),
    "t-shirt knit": (0.187, 80.0, 220.0, 20.0, 23e-6, 14e-6, 25e-6),
}
COLORS = {"denim": ACCENT, "trouser twill": GRAY, "t-shirt knit": WARM}
RINGS = 14


def fabric(
    density: float, warp: float, weft: float, shear: float, along: float, across: float, bias: float
) -> sb.Fabric:
    """The rigidity at 45 degrees is (warp + weft)/4 + twist/2."""
    twist = 2.0 * bias - (along + across) / 2.0
    return sb.Fabric(
        density=density,
        warp=warp,
        weft=weft,
        shear=shear,
        bending=along,
        bending_weft=across,
        bending_twist=twist,
    )


def sheet(cloth: sb.Fabric) -> tuple[dict[str, textile.Reading], textile.Drape]:
    """Every number of the laboratory."""
    drape = textile.drape(cloth, rings=RINGS, folds=(3, 4, 5, 6, 7))
    readings = {}
    for along in ("warp", "weft"):
        strip = textile.cantilever(cloth, along)
        readings[f"bending length, {along}"] = strip.bending_length
        readings[f"rigidity, {along}"] = strip.rigidity
        fast = textile.uniaxial(cloth, along, load=2e3 * textile.GRAM_FORCE, width=0.05, gauge=0.1)
        readings[f"E20, {along}"] = fast.extension
    readings["KES shear G"] = textile.shear(cloth).stiffness
    frame = textile.picture_frame(cloth)
    readings["picture frame, force at 20 degrees"] = frame.force
    bias = textile.bias_extension(cloth)
    readings["bias extension, force at 10 mm"] = bias.force
    readings["bias extension, middle angle"] = bias.angle
    readings["drape coefficient"] = drape.coefficient
    return readings, drape


def depends(reading: textile.Reading, cloth: sb.Fabric) -> str:
    """The three quantities that move a number most: percent per percent."""
    shares = {
        name.removeprefix("cloth_"): slope * (getattr(cloth, name.removeprefix("cloth_")) or 0.0) / reading.value
        for name, slope in reading.gradient.items()
    }
    most = sorted(shares.items(), key=lambda item: -abs(item[1]))[:3]
    return ", ".join(f"{name} {share:+.2f}" for name, share in most if abs(share) >= 0.005)


def picture(drapes: dict[str, textile.Drape], path: str) -> None:
    """The draped cloths from the side, and their shadows."""
    figure = new_figure(10.0, 5.4, "")
    for place, (name, drape) in enumerate(drapes.items(), start=1):
        state = drape.states[0]
        mesh = state.rest.scene.cloths["cloth"].mesh
        x = 100.0 * state.rest.positions
        panel = figure.add_subplot(2, 3, place, projection="3d")
        panel.plot_trisurf(*x.T, triangles=mesh.triangles, color=COLORS[name], linewidth=0.0, antialiased=False)
        panel.set(xlim=(-15, 15), ylim=(-15, 15), zlim=(-7, 1))
        panel.set_box_aspect((30, 30, 8), zoom=1.35)
        panel.view_init(elev=24, azim=-60)
        panel.set_axis_off()
        panel.set_title(f"{name}: {state.coefficient}, {state.nodes} folds", fontsize=10, color=INK)

        panel = figure.add_subplot(2, 3, 3 + place)
        seen = shadow(state.rest.positions, mesh.edges, mesh.sets["rim"])
        angle = 2.0 * np.pi * (np.arange(len(seen.radius)) + 0.5) / len(seen.radius)
        around = np.linspace(0.0, 2.0 * np.pi, 200)
        panel.fill(*(100.0 * seen.radius * [np.cos(angle), np.sin(angle)]), color=COLORS[name], alpha=0.35, lw=0)
        for radius, style in ((15.0, ":"), (9.0, "-")):
            panel.plot(radius * np.cos(around), radius * np.sin(around), style, color=INK, lw=0.8)
        panel.set_aspect("equal")
        panel.set_axis_off()
        panel.set_title("shadow, plate (line) and flat cloth (dotted)", fontsize=8, color=INK)
    save(figure, path)


def main() -> None:
    drapes = {}
    for name, numbers in FABRICS.items():
        cloth = fabric(*numbers)
        readings, drapes[name] = sheet(cloth)
        print(f"\n{name}")
        for what, reading in readings.items():
            print(f"  {what:36s}{reading!s:>20s}   {depends(reading, cloth)}")
        for state in drapes[name].states:
            print(
                f"  drape state: {state.nodes} folds, {state.coefficient}, energy {state.energy * 1e3:.4f} mJ, "
                f"hidden {state.hidden:.1%}"
            )
        if drapes[name].lost:
            print(f"  no rest from starts with {drapes[name].lost} folds")
    if len(sys.argv) > 1:
        picture(drapes, sys.argv[1])


if __name__ == "__main__":
    main()
