"""A hand drags one end of a rope over a table until the rope is wrapped around a post, or drawn through a gap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sheetbend as sb
from motion import RATE, Array, Control, Motion
from scipy.sparse import csr_array
from task import Task

MOVING, AT_END = 1.5, 3  # s, of the motion, and how many of the frames look at where the rope lies
FRAMES = np.append(np.arange(1, 25) * 0.06, [1.52, 1.56, 1.6])  # s; in the others the hand shall keep off the posts
KNOTS = 8  # of the hand along each axis
SEGMENTS, RADIUS, FRICTION = 30, 0.004, 0.2  # links, m, of the rope on the table and at the posts
NEAR = 0.05  # m, the root mean square distance that costs 1
CLEAR = 0.02  # m that the hand shall keep off the posts
PLACE, ACCELERATION, EFFORT = 0.5, 3.0, 1e-5  # m, m/s^2, and what an effort of 1 costs
REACHED, AT_REST = 1e-2, 0.05  # m and m/s
SOLVER = sb.Solver(h=1 / 250, method="implicit", integrator="bdf1")


def arrived(error: float, speed: float) -> bool:
    """Whether it is where it shall be, and at rest there."""
    return error < REACHED and speed < AT_REST


def on_table(name: str, points: Array, posts: Sequence[tuple[float, float, float]]) -> Control:
    """A rope that lies on a table beside upright posts (x, y, radius); a hand moves its last particle in the plane."""
    scene = sb.Scene(name)
    line = np.column_stack([points, np.full(len(points), RADIUS)])
    rope = sb.add_rope(
        scene, segments=SEGMENTS, points=line, density=0.05, EA=500.0, EI=2e-4, bend_damping=0.02, stretch_damping=1e-3
    )
    scene.add_contact(rope, sb.Plane(name="table"), friction=FRICTION, radius=RADIUS)
    for k, (x, y, radius) in enumerate(posts):
        post = sb.Capsule(start=(x, y, -0.2), end=(x, y, 0.2), radius=radius, name=f"post_{k + 1}")
        scene.add_contact(rope, post, friction=FRICTION, radius=RADIUS)
    hand = int(rope.particles[-1])
    times = np.arange(round(MOVING * RATE) + 1) / RATE
    scene.drive([hand], times, np.broadcast_to(scene.nodes[hand], (len(times), 1, 3)))
    control = Control(scene, Motion(MOVING, KNOTS, stops=True))
    for axis, along in zip("xy", np.eye(3)[:2], strict=True):
        control.add(f"hand_{axis}", "m", PLACE, ACCELERATION, {hand: along})
    return control


def to_target(name: str, control: Control, posts: Sequence[tuple[float, float, float]], way: Array) -> Task:
    """Bring the rope to where it lies when the hand goes another way, (knots, 2) m from where it starts."""
    (rope,) = control.scene.ropes.values()
    nodes = rope.particles
    knots = {f"hand_{axis}_{k + 1}": float(way[k, a]) for a, axis in enumerate("xy") for k in range(KNOTS)}
    target = sb.simulate(control.scene, FRAMES[-1:], SOLVER, knots).positions[0, nodes]

    def error(x: Array) -> float:
        return float(np.sqrt(np.mean(np.sum((x[-AT_END:, nodes] - target) ** 2, axis=-1))))

    def residuals(x: Array) -> tuple[Array, csr_array]:
        """How far the rope is from its target, and how much too near the hand comes to each post in each frame."""
        at = np.arange(x.size).reshape(x.shape)
        scale = 1.0 / (NEAR * np.sqrt(AT_END * len(nodes)))
        ends = at[-AT_END:, nodes].ravel()
        values, parts = [scale * (x[-AT_END:, nodes] - target).ravel()], [np.full(ends.size, scale)]
        rows, columns, first = [np.arange(ends.size)], [ends], ends.size
        for *center, radius in posts:
            away = x[:, nodes[-1], :2] - center
            distance = np.linalg.norm(away, axis=-1)
            deep = np.maximum(radius + CLEAR - distance, 0.0) / NEAR
            values.append(deep)
            parts.append(((deep > 0.0) / (-NEAR * distance))[:, None] * away)
            rows.append(np.repeat(first + np.arange(len(x)), 2))
            columns.append(at[:, nodes[-1], :2].ravel())
            first += len(x)
        entries = np.concatenate([part.ravel() for part in parts])
        where = np.concatenate(rows), np.concatenate(columns)
        return np.concatenate(values), csr_array((entries, where), shape=(first, x.size))

    def loss(x: Array) -> tuple[float, Array]:
        rest, derivative = residuals(x)
        return float(rest @ rest), 2.0 * (derivative.T @ rest).reshape(x.shape)

    def speed(x: Array) -> float:
        return float(np.linalg.norm(x[-1, nodes] - x[-2, nodes], axis=-1).max() / (FRAMES[-1] - FRAMES[-2]))

    return Task(name, control, FRAMES, SOLVER, target, loss, error, speed, arrived, EFFORT, residuals, tuple(posts))


def wrap() -> Task:
    """The hand shall lead the rope around a post by half a turn; friction alone holds the other end."""
    start = np.column_stack([np.linspace(0.0, 0.8, SEGMENTS + 1), np.full(SEGMENTS + 1, -0.07)])
    posts = [(0.35, 0.0, 0.05)]
    control = on_table("wrap", start, posts)
    angle = np.pi * np.linspace(0.0, 1.0, KNOTS + 1)[1:]
    free = 0.8 - 0.35 - 0.062 * angle  # m of rope beyond the post
    reached = np.array([0.35, 0.0]) + np.column_stack(
        [0.062 * np.sin(angle) + 0.97 * free * np.cos(angle), -0.062 * np.cos(angle) + 0.97 * free * np.sin(angle)]
    )
    return to_target("wrap", control, posts, reached - start[-1])


def gap() -> Task:
    """The hand shall draw the whole rope through the gap between two posts, aslant."""
    start = np.column_stack([np.linspace(-0.7, -0.1, SEGMENTS + 1), np.linspace(0.15, 0.0, SEGMENTS + 1)])
    posts = [(0.0, 0.06, 0.03), (0.0, -0.06, 0.03)]
    control = on_table("gap", start, posts)
    share = np.linspace(0.0, 1.0, KNOTS + 1)[1:, None]
    way = share * np.array([0.85, 0.0]) + np.maximum(share - 0.35, 0.0) * np.array([0.0, -0.45])
    return to_target("gap", control, posts, way)
