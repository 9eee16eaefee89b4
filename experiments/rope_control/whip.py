"""A whip: a hand at one end of a rope moves so that the free end is at a point at a given time."""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from task import RATE, Array, Control, Motion, Task

SECONDS = 0.7
TARGET = np.array([0.9, 0.4, 0.35])  # m; the hand starts at zero, and the rope hangs down by its length of 1 m
KNOTS = 12  # of each axis
NEAR, SPEED = 0.1, 5.0  # m and m/s: distances and missing speeds that cost 1
ACCELERATION, REACH = 30.0, 0.3  # m/s^2 and m of the hand
EFFORT, REACHED = 1e-2, 5e-3  # cost of an effort of 1; m
SUBSTEP = 1 / 500


def whip(speed: float = 0.0, seconds: float = SECONDS, axes: str = "xyz", EI: float | None = 1e-3) -> Task:
    """A rope of 1 m that hangs at rest.

    Args:
        speed: m/s that the tip shall have at the target at least.
        seconds: when it shall be there.
        axes: that the hand moves along.
        EI: N m^2; None = no bending.
    """
    scene = sb.Scene("whip")
    bending = {} if EI is None else {"EI": EI, "bend_damping": 0.02}
    hanging = [[0, 0, 0], [0, 0, -1]]
    rope = sb.add_rope(scene, points=hanging, segments=30, density=0.05, drag_quadratic=0.005, **bending)
    hand, tip = int(rope.particles[0]), int(rope.particles[-1])
    times = np.arange(round(seconds * RATE) + 1) / RATE
    scene.drive([hand], times, np.zeros((len(times), 1, 3)))
    control = Control(scene, Motion(seconds, KNOTS, stops=False))
    for axis in axes:
        control.add(f"hand_{axis}", "m", REACH, ACCELERATION, {hand: np.eye(3)["xyz".index(axis)]})

    def loss(x: Array) -> tuple[float, Array]:
        bar = np.zeros_like(x)
        gap = (x[1, tip] - TARGET) / NEAR
        bar[1, tip] = 2.0 * gap / NEAR
        value = float(gap @ gap)
        velocity = (x[1, tip] - x[0, tip]) / SUBSTEP
        fast = float(np.linalg.norm(velocity))
        missing = max(0.0, speed - fast) / SPEED
        if missing and fast:
            pull = -2.0 * missing / SPEED * velocity / fast / SUBSTEP
            bar[1, tip] += pull
            bar[0, tip] -= pull
        return value + missing**2, bar

    def error(x: Array) -> float:
        return float(np.linalg.norm(x[1, tip] - TARGET))

    name = f"whip, tip at {speed:g} m/s or more" if speed else "whip"
    frames = np.array([seconds - SUBSTEP, seconds])
    return Task(name, control, frames, sb.Solver(h=SUBSTEP), loss, error, TARGET, REACHED, EFFORT)
