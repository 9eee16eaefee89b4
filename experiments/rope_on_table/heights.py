"""A rope that falls on a table, from many heights: a loss, and its derivative with respect to the height.

    python experiments/rope_on_table/heights.py docs/contact_kinks.png

Each node lands by itself, so the loss has a kink wherever one lands a substep earlier, or begins or ends to slide. The
script prints, for windows of heights, the mean of the gradient beside the slope of the loss over the window, and draws
both, with both integrators and, with the second one, also of a damped rope.
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
LEANING = np.array([1.0, 0.0, 0.4]) / np.hypot(1.0, 0.4)
THROWN = (0.3, 0.1, 0.0)  # m/s
DAMPED = 0.02  # s
Array = np.ndarray


def falling(height: float, damping: float = 0.0) -> tuple[sb.Scene, Array]:
    """A rope that leans and flies along itself, with its lowest point at a height; and its particles. The time constant
    of damping [s] is that of stretching and of bending."""
    scene = sb.Scene("rope on a table")
    line = np.array([0.0, 0.0, height]) + np.outer(np.linspace(0.0, 0.3, 13), LEANING)
    damped = {"stretch_damping": damping, "bend_damping": damping} if damping else {}
    rope = sb.add_rope(
        scene,
        "rope",
        length=0.3,
        segments=12,
        points=line,
        velocity=np.tile(THROWN, (13, 1)),
        density=0.05,
        EA=200.0,
        EI=1e-4,
        **damped,
    )
    scene.add_contact(rope, sb.Plane(name="table"), friction=0.3, radius=0.004)
    return scene, rope.particles


def loss_and_slope(height: float, solver: sb.Solver, damping: float = 0.0) -> tuple[float, float]:
    """Mean squared distance of the rope's particles from the origin over the frames [m^2], and its derivative with
    respect to the height by the adjoint [m]."""
    scene, rope = falling(height, damping)
    rollout = sb.rollout(scene, FRAMES, solver)
    x = rollout.positions[:, rope]
    bar = np.zeros_like(rollout.positions)
    bar[:, rope] = 2.0 * x / (x.shape[0] * x.shape[1])
    gradient = rollout.gradient(bar).inputs["position"].reshape(-1, 3)
    return float((x**2).sum(axis=2).mean()), float(gradient[rope, 2].sum())


def windows(losses: Array, slopes: Array) -> list[tuple[float, float]]:
    """The slope of the loss over each window of heights, and the mean of the gradient."""
    found = []
    for first in range(0, len(HEIGHTS) - 1, WINDOW):
        last = first + WINDOW
        width = HEIGHTS[last] - HEIGHTS[first]
        mean = np.trapezoid(slopes[first : last + 1], HEIGHTS[first : last + 1]) / width
        found.append(((losses[last] - losses[first]) / width, mean))
    return found


def print_windows(name: str, losses: Array, slopes: Array) -> None:
    print(f"{name}: heights [mm]      slope of the loss   mean gradient   off")
    for first, (between, own) in zip(HEIGHTS[::WINDOW], windows(losses, slopes), strict=False):
        ends = f"{1e3 * first:.2f} to {1e3 * (first + WINDOW * (HEIGHTS[1] - HEIGHTS[0])):.2f}"
        print(f"{name}: {ends}  {between:17.4f} {own:15.4f}   {100 * (own / between - 1):+.1f} %", flush=True)


def main(picture: str) -> None:
    figure, axes = plt.subplots(2, 3, figsize=(11, 5), sharex=True, sharey="row", layout="constrained")
    runs = (("bdf1", 0.0), ("bdf2", 0.0), ("bdf2", DAMPED))
    for (top, bottom), (integrator, damping) in zip(axes.T, runs, strict=True):
        solver = sb.Solver(h=1e-3, method="implicit", integrator=integrator)
        name = integrator + (", damped" if damping else "")
        losses, slopes = np.array([loss_and_slope(height, solver, damping) for height in HEIGHTS]).T
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
