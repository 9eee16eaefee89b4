"""Draws still_24.png from out/knit_dic/still_24.npz, which study.py writes: python experiments/knit_dic/figure.py"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from dic import COLUMNS, INSIDE, ROWS, STILLS

EVERY = 3  # column that is drawn


def main():
    shapes = np.load("out/knit_dic/still_24.npz")
    points = STILLS[23].reshape(ROWS, COLUMNS, 3)
    inside = STILLS[23][INSIDE]
    figure, panels = plt.subplots(2, 2, figsize=(13, 6.6), layout="constrained", sharex=True, sharey=True)
    titles = {"fitted": "three ratios, fitted to stills 2 to 16", "harmonic": "harmonic between the driven rows"}
    for (lines, field), (key, title) in zip(panels.T, titles.items(), strict=True):
        full = points.copy()
        full[1:-1] = shapes[key].reshape(ROWS - 2, COLUMNS, 3)
        for grid, style in (
            (points, {"color": "#bbbbbb", "lw": 2.5}),
            (full, {"color": "#d95f02" if key == "fitted" else "#1f4e8c", "lw": 0.8}),
        ):
            for row in grid:
                lines.plot(row[:, 0], row[:, 1], **style)
            for column in range(0, COLUMNS, EVERY):
                lines.plot(grid[:, column, 0], grid[:, column, 1], **style)
        gap = np.linalg.norm(shapes[key] - inside, axis=1)
        shown = field.scatter(inside[:, 0], inside[:, 1], c=gap, s=14, cmap="viridis", vmin=0, vmax=100)
        lines.set_title(f"Still 24, {title}; gray: measured", fontsize=10)
        field.set_title(f"distance to the measured points: {gap.mean():.1f} px on average", fontsize=10)
        for panel in (lines, field):
            panel.set_aspect("equal")
        field.set_xlabel("px")
    figure.colorbar(shown, ax=panels[1], label="px")
    figure.savefig(Path(__file__).parent / "still_24.png", dpi=110)


if __name__ == "__main__":
    main()
