"""A cable harness: a trunk that a grip moves, a left branch that swings, a right one whose end is held."""

from pathlib import Path

import numpy as np
import sheetbend as sb

PARTS = ("trunk", "left", "right")
LENGTH = {"trunk": 0.4, "left": 0.35, "right": 0.3}  # m
DENSITY = {"trunk": 0.08, "left": 0.05, "right": 0.04}  # kg/m
LINKS = {"trunk": 16, "left": 14, "right": 16}
ANGLE = 0.6  # rad, of each branch to the trunk, as molded
RATIO = 0.8  # GJ/EI
RATE, SECONDS = 100, 3.0  # frames per second
SUBSTEPS = 2  # per frame
HELD_AT = (0.57, -0.14, 0.03)  # m, the right branch's end: nearer than it reaches, so that it sags
FILE = Path(__file__).parent / "data" / "harness.npz"


def grip_motion():
    """times (knots,), positions (knots, 3) m and quaternions (knots, 4) of the grip: known, as a robot's are."""
    t = np.arange(round(SECONDS * RATE) + 1) / RATE
    swell = np.sin(np.pi * np.minimum(t / 1.0, 0.5)) ** 2
    wave = np.sin(2 * np.pi * np.outer(t, [0.9, 1.3, 1.1]) + [0.0, 0.5, 1.0]) - np.sin([0.0, 0.5, 1.0])
    position = swell[:, None] * wave * [0.02, 0.05, 0.04]
    yaw = 0.3 * swell * np.sin(2 * np.pi * 0.7 * t)
    nothing = np.zeros_like(yaw)
    return t, position, np.stack([nothing, nothing, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)


def scene(values, finer=1):
    """The harness with the quantities `values` by name; `finer` times the links."""
    times, position, quaternions = grip_motion()
    built = sb.Scene("harness")
    at, branch, rods = LENGTH["trunk"], sb.Junction(), {}
    for part, side in zip(PARTS, (0, 1, -1), strict=True):
        way = np.array([np.cos(ANGLE), side * np.sin(ANGLE), 0.0])
        ends = {"start": branch, "points": [(at, 0, 0), (at, 0, 0) + LENGTH[part] * way]}
        if not side:
            ends = {"start": sb.Grip.from_poses(times, position, quaternions), "end": branch}
        rods[part] = sb.add_rod(
            built,
            part,
            length=LENGTH[part],
            segments=finer * LINKS[part],
            density=DENSITY[part],
            EI=values[f"{part}_EI"],
            GJ=RATIO * values[f"{part}_EI"],
            bend_damping=values["trunk_bend_damping"],
            **ends,
        )
    held = rods["right"].particles[-1:]
    built.drive(held, times, np.broadcast_to(HELD_AT, (len(times), 1, 3)))
    return built


def places(built):
    """Markers: the trunk's quarters (the last at the branch), quarters of the left branch, and of the right one."""
    return {
        f"{part} {k}": sb.on_rope(built.ropes[part], 0.25 * k * LENGTH[part])
        for part in PARTS
        for k in range(1, 4 if part == "right" else 5)
    }


def experiment(recording, values, finer=1, seconds=2.0):
    """The first `seconds` fitted, from the hanging rest at the start; what follows is only predicted."""
    built = scene(values, finer)
    h = 1.0 / (RATE * SUBSTEPS)
    return sb.Experiment(
        scene=built,
        recording=recording,
        markers=places(built),
        start="equilibrium",
        solver=sb.Solver(h=h),
        sigma=5e-4,
        fit=(0.0, seconds),
        held_out=(seconds, SECONDS + 1e-6),
    )


def parameters(start):
    """Three EI, with GJ = 0.8 EI of a round elastic section, and one time constant for all parts."""
    given = {"trunk_bend_damping": {"initial": start["trunk_bend_damping"], "log": True}}
    for part in PARTS:
        given[f"{part}_EI"] = {"initial": start[f"{part}_EI"], "log": True}
        given[f"{part}_GJ"] = {"tied_to": f"{part}_EI", "factor": RATIO}
        if part != "trunk":
            given[f"{part}_bend_damping"] = {"tied_to": "trunk_bend_damping"}
    return given
