"""A load of unknown mass, center and inertia in a driven gripper, weighed by the force and torque at the wrist.

    python experiments/payload/payload.py [--draws 20]

The motion is given; force and torque follow from Newton's and Euler's equations, apart from the simulator, and get
noise of 0.05 N and 2 mN m. Each draw of the noise is fitted; the table counts the 95 % intervals that hold the truth.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
import sheetbend as sb
from sheetbend.arrays.rotations import quaternions_of
from sheetbend.quantities.expression import numbers, rotation

MASS, CENTER = 0.5, np.array([0.02, -0.015, 0.06])  # kg, m
INERTIA = np.array([[1.2e-3, 1e-4, -5e-5], [1e-4, 1.8e-3, 8e-5], [-5e-5, 8e-5, 2.2e-3]])  # kg m^2, about the center
SECONDS, FINE, KNOTS = 1.0, 10_000, 500  # s, and Hz of the truth and of the poses that drive the gripper
SAMPLES = np.arange(1, 100) * 0.01  # s, of the wrist
FORCE, TORQUE = 0.05, 2e-3  # N, N m of noise
MARKER = [[0.05, 0.0, 0.0]]


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) s, places (n, 3) m and attitudes (n, 3, 3) of the gripper, at rest at the start."""
    t = np.arange(round(SECONDS * FINE) + 1) / FINE
    swing = 1.0 - np.cos(2.0 * np.pi * np.outer(t, [1.1, 1.6, 2.1, 1.2, 1.7, 1.4]))
    x, angles = swing[:, :3] * [0.1, 0.08, 0.06], swing[:, 3:] * [0.5, -0.45, 0.6]
    turn = rotation(["a", "b", "c"])
    return t, x, np.stack([numbers(turn, dict(zip("abc", a, strict=True))) for a in angles])


def load(t: np.ndarray, x: np.ndarray, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and torque (samples, 3) that move the load, about the gripper's origin."""
    rate = partial(np.gradient, axis=0)
    center = x + turns @ CENTER
    force = MASS * (rate(rate(center, t), t) - np.array([0.0, 0.0, -9.81]))
    skew = rate(turns, t) @ np.swapaxes(turns, 1, 2)
    spin = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    momentum = np.einsum("fab,bc,fdc,fd->fa", turns, INERTIA, turns, spin)
    torque = rate(momentum, t) + np.cross(center - x, force)
    at = np.round(SAMPLES * FINE).astype(int)
    return force[at], torque[at]


def fitted(tool: sb.Tool, wrist: sb.ForceRecording, seen: np.ndarray) -> sb.FitResult:
    """The ten numbers, started at values that are 3 to 25 % off."""
    scene = sb.Scene("payload")
    gripper = scene.add_body("gripper", mass=1e-6, inertia=(1e-9, 1e-9, 1e-9), poses=tool)
    origin, frame = gripper.pose(scene.nodes)
    moments, axes = sb.Inertia(MASS, INERTIA).principal()
    guess = axes @ np.diag(moments * [1.05, 0.97, 1.03]) @ axes.T
    held = scene.add_body("load", mass=1.1 * MASS, inertia=guess, center=0.8 * CENTER, at=origin, rotation=frame)
    sb.fixed(gripper, held, name="grasp")
    sensor = sb.ForceSensor(recording=wrist, at=gripper, sigma=FORCE, torque_sigma=TORQUE)
    return sb.fit(
        scene,
        sb.Recording(seen, tool.times[:-1:10]),
        list(truth()),
        markers=sb.on_body(held, MARKER),
        solver=sb.Solver(h=1 / KNOTS),
        forces=[sensor],
        start_time=0.0,
        refine=False,
    )


def truth() -> dict[str, float]:
    moments = sb.Inertia(MASS, INERTIA).principal()[0]
    return {
        "load_mass": MASS,
        **{f"load_center_{a}": float(c) for a, c in zip("xyz", CENTER, strict=True)},
        **{f"load_inertia_{k}": float(m) for k, m in enumerate(moments, start=1)},
        **{f"load_axes_turn_{a}": 0.0 for a in "xyz"},
    }


def main(draws: int) -> None:
    t, x, turns = motion()
    force, torque = load(t, x, turns)
    knots = slice(0, None, FINE // KNOTS)
    tool = sb.Tool(t[knots], x[knots], quaternions_of(turns[knots]))
    rng, inside = np.random.default_rng(1), dict.fromkeys(truth(), 0)
    for draw in range(draws):
        wrist = sb.ForceRecording(
            SAMPLES,
            force + FORCE * rng.standard_normal(force.shape),
            torque + TORQUE * rng.standard_normal(torque.shape),
            name="wrist",
        )
        places = tool.path(MARKER)[:-1:10]
        found = fitted(tool, wrist, places + 1e-3 * rng.standard_normal(places.shape))
        for name, value in truth().items():
            one = found[name]
            inside[name] += one.lower is not None and one.upper is not None and one.lower <= value <= one.upper
            if draw == 0:
                print(f"{name:18s} {value:10.4g}  fitted {one.value:10.4g} +- {one.half_width:8.2g}  {one.verdict}")
    print(f"intervals that hold the truth, of {draws}: {inside}, together {sum(inside.values())} of {10 * draws}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20)
    main(parser.parse_args().draws)
