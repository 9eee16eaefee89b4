"""Two hands lift a bar by two ropes that lie under it, and hold it at a place above the table."""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from motion import RATE, Array, Control, Motion
from posts import arrived
from task import Task

MOVING, AT_END = 1.2, 3  # s, of the motion, and how many of the frames look at where the bar is
FRAMES = np.arange(1, 34) * 0.04  # s; in all of them the hands shall be where they may
KNOTS = 6  # of each hand along each axis
LENGTH, SEGMENTS, RADIUS, FRICTION = 0.4, 16, 0.004, 0.3  # m, links, m, of ropes on the table and under the bar
SPAN = LENGTH  # m, how far apart the hands may be: ropes are to carry the bar, not to be stretched
BAR, HALF = 0.01, 0.08  # m, its radius and half its middle line
RISE = 0.1  # m that both hands rise where the control does nothing: from the table no gradient leads up
TARGET = np.array([0.1, 0.0, 0.15])  # m, from the middle of the table
NEAR = 0.05  # m, the distance that costs 1
PLACE, ACCELERATION, EFFORT = 0.3, 3.0, 1e-5  # m, m/s^2, and what an effort of 1 costs
SOLVER = sb.Solver(h=1 / 250, method="implicit", integrator="bdf1")


def on_ropes() -> tuple[Control, int]:
    """A bar that lies across two ropes on a table; each hand holds an end of both and moves in the plane along them.

    Returns:
        The control, and the particle that is the bar's center of mass.
    """
    scene = sb.Scene("lift")
    for name, y in (("left", -0.05), ("right", 0.05)):
        sb.add_rope(
            scene, name, length=LENGTH, segments=SEGMENTS, start=(-0.5 * LENGTH, y, RADIUS), density=0.05,
            EA=500.0, EI=2e-4, bend_damping=0.02, stretch_damping=1e-3,
        )  # fmt: skip
    on_top = 2.0 * RADIUS + BAR + 1e-6
    bar = scene.add_body("bar", of=sb.Inertia.box(0.05, (0.015, 0.16, 0.015)), at=(0.0, 0.0, on_top))
    line = [(0.0, -HALF, 0.0), (0.0, HALF, 0.0)]
    table, ropes = sb.Plane(name="table"), list(scene.ropes.values())
    free = np.concatenate([rope.particles[1:-1] for rope in ropes])
    scene.add_contact(free, table, friction=FRICTION, radius=RADIUS, name="ropes")
    scene.add_contact(bar, table, friction=FRICTION, radius=BAR, points=line, name="ends")
    scene.add_self_contact(*ropes, bar.capsules([line]), radius=[RADIUS, RADIUS, BAR], friction=FRICTION)
    hands = {"first": [rope.particles[0] for rope in ropes], "second": [rope.particles[-1] for rope in ropes]}
    held = [int(p) for ends in hands.values() for p in ends]
    times = np.arange(round(MOVING * RATE) + 1) / RATE
    share = np.clip(times / MOVING, 0.0, 1.0)
    ease = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    up = np.outer(ease, [0.0, 0.0, RISE])[:, None]
    scene.drive(held, times, scene.nodes[held] + up)
    control = Control(scene, Motion(MOVING, KNOTS, stops=True))
    for hand, ends in hands.items():
        for axis, along in zip("xz", np.eye(3)[[0, 2]], strict=True):
            control.add(f"{hand}_{axis}", "m", PLACE, ACCELERATION, {int(p): along for p in ends})
    return control, int(bar.particles[0])


def lift() -> Task:
    """The bar shall be held 15 cm above the table, 10 cm beside where it lay."""
    control, bar = on_ropes()
    held = control.scene.boundary.driven
    rope = control.scene.ropes["left"].particles[[0, -1]]  # whose ends are where those of the other one are

    def error(x: Array) -> float:
        return float(np.sqrt(np.mean(np.sum((x[-AT_END:, bar] - TARGET) ** 2, axis=-1))))

    def loss(x: Array) -> tuple[float, Array]:
        by = np.zeros_like(x)
        gap = (x[-AT_END:, bar] - TARGET) / NEAR
        by[-AT_END:, bar] = 2.0 * gap / NEAR / AT_END
        low = np.maximum(RADIUS - x[:, held, 2], 0.0) / NEAR
        by[:, held, 2] -= 2.0 * low / NEAR
        across = x[:, rope[1]] - x[:, rope[0]]
        span = np.linalg.norm(across, axis=1)
        wide = np.maximum(span - SPAN, 0.0) / NEAR
        pull = (2.0 * wide / NEAR / span)[:, None] * across
        by[:, rope[1]] += pull
        by[:, rope[0]] -= pull
        return float((gap * gap).sum()) / AT_END + float((low * low).sum()) + float((wide * wide).sum()), by

    def speed(x: Array) -> float:
        return float(np.linalg.norm(x[-1, bar] - x[-2, bar]) / (FRAMES[-1] - FRAMES[-2]))

    return Task("lift", control, FRAMES, SOLVER, TARGET, loss, error, speed, arrived, EFFORT)
