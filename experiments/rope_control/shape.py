"""Shape: two grippers move and turn so that the rod between them comes to rest in a given shape."""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from motion import RATE, Array, Control, Motion
from task import Task

MOVING, FRAMES = 1.0, np.array([1.05, 1.1, 1.17, 1.25])  # s, of the motion, and where the rod shall be at rest
KNOTS = 5  # of each of the grippers' 12 ways to move
LENGTH, SEGMENTS, APART = 1.0, 30, 0.6  # m, links, m between the grippers at first
DROOP = np.radians(45.0)  # the rod leaves its grippers downwards
NEAR = 0.05  # m, the root mean square distance that costs 1
PLACE, ANGLE = (0.3, 5.0), (0.5, 8.0)  # m and rad, and their accelerations, of an effort of 1
EFFORT = 1e-4  # what an effort of 1 costs
REACHED, AT_REST = 5e-3, 0.05  # m and m/s
SOLVER = sb.Solver(h=1 / 400)
FINAL = {  # m, and tangents of angles: the pose to which another motion took the grippers of the target
    "start_x": 0.05,
    "start_y": 0.15,
    "start_z": 0.10,
    "start_up": 0.5,
    "start_aside": 0.6,
    "end_x": -0.15,
    "end_y": -0.10,
    "end_z": 0.20,
    "end_up": 0.6,
    "end_aside": -0.4,
    "end_roll": 1.5,
}


def held_rod() -> Control:
    """A rod at rest between two grippers, each of which moves along and turns about three axes."""
    times = np.arange(round(MOVING * RATE) + 1) / RATE
    grips = [
        sb.Grip.fixed((x, 0, 0), (np.cos(DROOP), 0, -s * np.sin(DROOP)), (0, 1, 0)) for x, s in ((0, 1), (APART, -1))
    ]
    options = {"length": LENGTH, "segments": SEGMENTS, "density": 0.05, "EI": 1e-2, "GJ": 1e-2, "EA": 1e3}
    options |= {"stretch_damping": 1e-3, "bend_damping": 0.03, "twist_damping": 0.03, "drag_linear": 0.03}
    sagging = [[0, 0, 0], [0.1, 0, -0.25], [0.3, 0, -0.37], [0.5, 0, -0.25], [APART, 0, 0]]
    still = sb.rod(start=grips[0], end=grips[1], points=sagging, **options)
    rest = sb.equilibrium(still).positions[still.ropes["rod"].particles]

    scene = sb.Scene("shape")
    one = np.ones((len(times), 1))
    moved = [sb.Grip(times, one * g.position, one * g.direction, one * g.director) for g in grips]
    rod = sb.add_rod(scene, start=moved[0], end=moved[1], points=rest, **options)
    control = Control(scene, Motion(MOVING, KNOTS, stops=True))
    ends = (("start", rod.particles[0], rod.start_ghost, rod.directors[0]),)
    ends += (("end", rod.particles[-1], rod.end_ghost, rod.directors[-1]),)
    for (name, node, ghost, director), grip in zip(ends, grips, strict=True):
        add_gripper(control, name, int(node), int(ghost), int(director), grip)
    return control


def add_gripper(control: Control, name: str, node: int, ghost: int, director: int, grip: sb.Grip) -> None:
    """Places move node and ghost. Angles, by their tangents, move the ghost, by which the direction is held, or the
    director."""
    for axis, along in zip("xyz", np.eye(3), strict=True):
        control.add(f"{name}_{axis}", "m", *PLACE, {node: along, ghost: along})
    aside, up = grip.director[0], np.cross(grip.direction[0], grip.director[0])
    reach = float((control.scene.nodes[ghost] - control.scene.nodes[node]) @ grip.direction[0])
    control.add(f"{name}_up", "1", *ANGLE, {ghost: reach * up})
    control.add(f"{name}_aside", "1", *ANGLE, {ghost: reach * aside})
    control.add(f"{name}_roll", "1", *ANGLE, {director: up})


def other_motion() -> dict[str, float]:
    """Knots that take the grippers smoothly to their final poses."""
    u = np.linspace(0.0, 1.0, KNOTS + 1)[1:]
    ease = u**2 * (3.0 - 2.0 * u)
    return {f"{name}_{k + 1}": size * e for name, size in FINAL.items() for k, e in enumerate(ease.tolist())}


def target_shape(control: Control) -> Array:
    """(nodes, 3) m: where the rod is after the other motion and 20 s of rest."""
    nodes = control.scene.ropes["rod"].particles
    return sb.simulate(control.scene, [20.0], SOLVER, other_motion()).positions[0, nodes]


def shape() -> Task:
    control = held_rod()
    target, nodes = target_shape(control), control.scene.ropes["rod"].particles

    def error(x: Array) -> float:
        return float(np.sqrt(np.mean(np.sum((x[:, nodes] - target) ** 2, axis=-1))))

    def loss(x: Array) -> tuple[float, Array]:
        bar = np.zeros_like(x)
        gap = (x[:, nodes] - target) / NEAR
        count = len(x) * len(nodes)
        bar[:, nodes] = 2.0 * gap / NEAR / count
        return float((gap * gap).sum()) / count, bar

    def speed(x: Array) -> float:
        return float(np.linalg.norm(x[-1, nodes] - x[-2, nodes], axis=-1).max() / (FRAMES[-1] - FRAMES[-2]))

    def reached(error: float, speed: float) -> bool:
        return error < REACHED and speed < AT_REST

    return Task("shape", control, FRAMES, SOLVER, target, loss, error, speed, reached, EFFORT)
