"""Draws dragged_rope.png in a folder where the tutorial dragged_rope.md was followed."""

import matplotlib.pyplot as plt
import sheetbend as sb

seen, fitted = sb.Recording.load("drag.csv"), sb.Recording.load("out/drag/predicted_drag.npz")
figure, panels = plt.subplots(2, 1, figsize=(7, 6), layout="constrained", height_ratios=[3, 1], sharex=True)
for frame in range(0, len(fitted.times), 8):
    for panel, axis in zip(panels, (1, 2), strict=True):
        panel.plot(100 * seen.positions[frame, :, 0], 100 * seen.positions[frame, :, axis], "k.", markersize=4)
        label = f"{fitted.times[frame]:.2f} s"
        panel.plot(
            100 * fitted.positions[frame, :, 0],
            100 * fitted.positions[frame, :, axis],
            color=f"C{frame // 8}",
            label=label,
        )
panels[0].legend(frameon=False, ncols=2, loc="lower right")
panels[0].set(ylabel="y [cm]", aspect="equal", title="from above")
panels[1].set(xlabel="x [cm]", ylabel="z [cm]", aspect="equal", title="from the side")
figure.savefig("dragged_rope.png", dpi=110)
