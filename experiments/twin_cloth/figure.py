"""Draws pieces.png, the pieces of the fabric and their markers: python experiments/twin_cloth/figure.py"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import sheetbend as sb
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from sheetbend.config import build, parse
from sheetbend.config.values import with_values

FILE = Path(__file__).parent / "twin_cloth.toml"
LABELS = {
    "cloth": ("along the warp", "#5b8fb9"),
    "weft_cut": ("along the weft", "#c98f5a"),
    "bias_cut": ("on the bias", "#7aa874"),
    "flap": ("flap over a rod", "#a77ab5"),
    "square": ("", "#b5707a"),
}
LIGHT = np.array([0.3, -0.5, 0.8])


def draw(panel, e, positions, frame, title):
    """One state of an experiment's cloths, and what a frame of its recording shows."""
    for name, cloth in e.scene.cloths.items():
        label, color = LABELS[name]
        x = positions[cloth.particles]
        corners = x[cloth.mesh.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        shade = 0.55 + 0.45 * np.abs(normal @ LIGHT) / np.linalg.norm(normal, axis=1)
        faces = np.clip(shade[:, None] * np.array(to_rgb(color)), 0.0, 1.0)
        panel.add_collection3d(Poly3DCollection(corners, facecolors=faces, edgecolors=(1, 1, 1, 0.4), linewidths=0.3))
        panel.text(x[:, 0].max() + 0.03, x[:, 1].mean(), x[x[:, 0].argmax(), 2], label, fontsize=9, zorder=3)
    seen = e.recording.positions[frame, list(e.compared)]
    panel.scatter(*seen.T, s=5, c="black", depthshade=False, zorder=2)
    low, high = positions.min(axis=0), positions.max(axis=0)
    panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    panel.set_title(title, fontsize=10)
    panel.set_box_aspect(high - low, zoom=1.08)
    panel.computed_zorder = False
    panel.view_init(28, -60)
    panel.set_axis_off()


def main():
    config = parse(FILE)
    swinging, draped = build(with_values(config, config.published), FILE.parent).experiments
    rest = sb.equilibrium(swinging.scene).positions
    motion = sb.simulate(swinging.scene, swinging.recording.times, swinging.solver, start=rest)
    frame = 78
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5), width_ratios=[2, 1], subplot_kw={"projection": "3d"})
    draw(left, swinging, motion.positions[frame], frame, f"swinging, after {swinging.recording.times[frame]:.1f} s")
    draw(right, draped, sb.equilibrium(draped.scene).positions, 0, "draped, square over a rod")
    figure.savefig(FILE.parent / "pieces.png", dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
