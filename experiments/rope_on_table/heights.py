"""A rope that falls on a table, from many heights: a loss, and its derivative with respect to the height.

    python experiments/rope_on_table/heights.py docs/contact_kinks.png

Each node lands by itself, so the loss has a kink wherever one lands a substep earlier, or begins or ends to slide. The
script prints, for windows of heights, the mean of the gradient beside the slope of the loss over the window, and draws
both, with both integrators.
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import sheetbend as sb

HEIGHTS = np.linspace(0.04, 0.0402, 41)  # m
WINDOW = 20  # heights
FRAMES = np.linspace(0.0, 0.4, 21)  # s
Array = np.ndarray


def falling(height: float) -> tuple[sb.Scene, Array]:
    """A rope that leans and flies along itself, with its lowest point at a height; and its particles."""
    scene = sb.rope(
        0.3, 12, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, height), direction=(1.0, 0.0, 0.4), pinned=()
    )
    rope = scene.ropes["rope"].particles
    scene._velocities.values[rope] = (0.3, 0.1, 0.0)
    scene.add_contact(rope, sb.Plane(name="table"), friction=0.3, radius=0.004)
    return scene, rope


def loss_and_slope(height: float, solver: sb.Solver) -> tuple[float, float]:
    """Mean squared distance of the rope's particles from the origin over the frames [m^2], and its derivative with
    respect to the height by the adjoint [m]."""
    scene, rope = falling(height)
    rollout = sb.rollout(scene, FRAMES, solver)
    x = rollout.positions[:, rope]
    bar = np.zeros_like(rollout.positions)
    bar[:, rope] = 2.0 * x / (x.shape[0] * x.shape[1])
    gradient = rollout.gradient(bar).inputs["position"].reshape(-1, 3)
    return float((x**2).sum(axis=2).mean()), float(gradient[rope, 2].sum())


def print_windows(name: str, losses: Array, slopes: Array) -> None:
    print(f"{name}: heights [mm]      slope of the loss   mean gradient   off")
    for first in range(0, len(HEIGHTS) - 1, WINDOW):
        last = first + WINDOW
        width = HEIGHTS[last] - HEIGHTS[first]
        between = (losses[last] - losses[first]) / width
        own = np.trapezoid(slopes[first : last + 1], HEIGHTS[first : last + 1]) / width
        ends = f"{1e3 * HEIGHTS[first]:.2f} to {1e3 * HEIGHTS[last]:.2f}"
        print(f"{name}: {ends}  {between:17.4f} {own:15.4f}   {100 * (own / between - 1):+.1f} %", flush=True)


def main(picture: str) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(8, 5), sharex=True, sharey="row", layout="constrained")
    for (top, bottom), name in zip(axes.T, ("bdf1", "bdf2"), strict=True):
        solver = sb.Solver(h=1e-3, method="implicit", integrator=name)
        losses, slopes = np.array([loss_and_slope(height, solver) for height in HEIGHTS]).T
        print_windows(name, losses, slopes)
        mm = 1e3 * HEIGHTS
        top.plot(mm, 1e6 * (losses - losses[0]), ".-", markersize=4, linewidth=0.8)
        top.set_title(name)
        bottom.plot((mm[1:] + mm[:-1]) / 2, np.diff(losses) / np.diff(HEIGHTS), linewidth=0.8, label="differences")
        bottom.plot(mm, slopes, "o", markersize=3, label="gradient")
        bottom.set_xlabel("height of the fall [mm]")
    axes[0, 0].set_ylabel("change of the loss [mm²]")
    axes[1, 0].set_ylabel("derivative [m]")
    axes[1, 0].legend(frameon=False)
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    main(sys.argv[1])
