"""The figure: what the gradient found, and the error over time of both searches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import sheetbend as sb
from matplotlib.patches import Circle
from motion import Array
from search import Search
from sheetbend.pictures.drawing import ACCENT, INK, WARM, clean, key, new_figure
from task import Task

SHAPES = 9  # of the rope over time, in one picture
AWAY = np.array([0.45, 0.25])  # how much of the depth y is drawn along x and z
COLORS = {"L-BFGS": ACCENT, "Gauss-Newton": ACCENT, "CMA-ES": WARM}


def draw(found: Sequence[tuple[Task, list[Search]]], path: Path) -> None:
    """One column per task."""
    figure = new_figure(3.6 * len(found), 6.2, "Ropes controlled by gradient")
    panels = figure.subplots(2, len(found), squeeze=False, height_ratios=(1.2, 1.0))
    for (picture, errors), (task, searches) in zip(panels.T, found, strict=True):
        _picture(picture, task, searches[0].best)
        _errors(errors, task, searches)
    key(figure, [("target", WARM), ("gripped", INK), ("rope", ACCENT)])
    figure.savefig(path, dpi=130, facecolor="white")


def _seen(task: Task, x: Array) -> Array:
    """(..., 2): places (..., 3) m as they are drawn: from above beside posts, else obliquely."""
    return np.asarray(x[..., :2] if task.posts else x[..., [0, 2]] + x[..., 1:2] * AWAY)


def _picture(panel, task: Task, best: Array) -> None:
    control, last = task.control, round(task.frames[-1] / task.solver.h)
    steps = np.arange(0, last + 1)
    values = control.values(best)
    motion = sb.simulate(control.scene, steps * task.solver.h, task.solver, values).positions
    (rope,) = control.scene.ropes.values()
    lines = _seen(task, motion[:, rope.particles])
    for share in np.linspace(0.0, 1.0, SHAPES):
        line = lines[round(share * last)]
        panel.plot(*line.T, color=ACCENT, alpha=0.15 + 0.85 * share**2, lw=1.0 + 0.8 * share)
    for node in rope.particles:
        if int(node) in control.scene.boundary.driven:
            panel.plot(*_seen(task, motion[:, node]).T, color=INK, lw=1.4)
            panel.plot(*_seen(task, motion[-1, node]), "o", color=INK, ms=4)
    target = np.atleast_2d(_seen(task, task.target))
    style = {"marker": "+", "ms": 14, "mew": 2} if len(target) == 1 else {"ls": "--", "lw": 1.6}
    panel.plot(*target.T, color=WARM, zorder=5, **style)
    for x, y, radius in task.posts:
        panel.add_patch(Circle((x, y), radius, color=INK, alpha=0.25, lw=0))
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_title(task.name, fontsize=10, color=INK, loc="left")
    panel.set_xlabel("x, seen from above (m)" if task.posts else "along, and a part of the depth (m)")
    panel.set_ylabel("y (m)" if task.posts else "up, and a part of the depth (m)")
    clean(panel)


def _errors(panel, task: Task, searches: Sequence[Search]) -> None:
    for search in searches:
        errors = [1e3 * outcome.error for outcome in search.outcomes]
        panel.plot(search.seconds, errors, color=COLORS[search.name], lw=1.6, label=search.name)
        count = search.reached_after()
        if count is not None:
            place = (search.seconds[count - 1], errors[count - 1])
            panel.plot(*place, "o", color=INK, ms=5)
            panel.annotate("reached", place, (8, 4), textcoords="offset points", fontsize=8, color=INK)
    panel.set_yscale("log")
    panel.set_xlabel("processor time (s)")
    panel.set_ylabel("distance to the target (mm)")
    panel.legend(frameon=False, fontsize=8, labelcolor="linecolor")
    clean(panel)
