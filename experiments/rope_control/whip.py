"""A whip: a hand at one end of a rope moves so that the free end is at a point at a given time."""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from motion import RATE, Array, Control, Motion
from task import Task

SECONDS = 0.7
TARGET = np.array([0.9, 0.4, 0.35])  # m; the hand starts at zero, and the rope hangs down by its length of 1 m
KNOTS = 12  # of each axis
NEAR, SPEED = 0.1, 5.0  # m and m/s: distances and missing speeds that cost 1
ACCELERATION, REACH = 30.0, 0.3  # m/s^2 and m of the hand
EFFORT, REACHED = 1e-2, 5e-3  # cost of an effort of 1; m
SUBSTEP = 1 / 500


def whip(fast: float = 0.0, seconds: float = SECONDS, axes: str = "xyz", EI: float | None = 1e-3) -> Task:
    """A rope of 1 m that hangs at rest.

    Args:
        fast: m/s that the tip shall have at the target at least.
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

    def speed(x: Array) -> float:
        return float(np.linalg.norm(x[1, tip] - x[0, tip])) / SUBSTEP

    def error(x: Array) -> float:
        return float(np.linalg.norm(x[1, tip] - TARGET))

    def loss(x: Array) -> tuple[float, Array]:
        bar = np.zeros_like(x)
        bar[1, tip] = 2.0 * (x[1, tip] - TARGET) / NEAR**2
        missing = max(0.0, fast - speed(x)) / SPEED
        if missing and speed(x):
            pull = -2.0 * missing / SPEED * (x[1, tip] - x[0, tip]) / (speed(x) * SUBSTEP**2)
            bar[1, tip] += pull
            bar[0, tip] -= pull
        return (error(x) / NEAR) ** 2 + missing**2, bar

    def reached(error: float, speed: float) -> bool:
        return error < REACHED and speed > 0.99 * fast

    name = f"whip at {fast:g} m/s" if fast else "whip"
    frames, solver = np.array([seconds - SUBSTEP, seconds]), sb.Solver(h=SUBSTEP)
    return Task(name, control, frames, solver, TARGET, loss, error, speed, reached, EFFORT)
