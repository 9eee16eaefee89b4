"""Writes recordings of five synthetic ropes held by two moving grips, in the layout of the DEFORM rope data.

    python experiments/gripped_ropes/make_data.py FOLDER [--train 6] [--eval 3] [--ropes 5] [--seconds 5] [--seed 7]

SYNTHETIC, no measurement. FOLDER/rope_1/train/00.pkl and so on, each a list of frames (3, markers) at 100 Hz, and
FOLDER/rope_1.json with the true values. A recording depends on the seed, its rope, its set and its number alone.
"""

from __future__ import annotations

import argparse
import json
import pickle
from pathlib import Path

import numpy as np
import sheetbend as sb
from grip_motion import KNOTS, NOMINAL, UP, motion
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from sheetbend.grip import Grip
from true_ropes import GRAVITY, GRIPPED, MODES, Array, Rope, ropes

SEGMENTS, H = 120, 1 / 1600
RATE = 100  # Hz, of the frames
NOISE = 5e-4  # m, standard deviation of each coordinate of each marker
CREEP = ((1 / 100, 20.0), (1 / 400, 5.0), (H, 0.5))  # substeps and times, s, until the rope is at rest at first
SNAP = 60.0  # m/s^2; a motion at which the rope snaps over, so that its path hangs on a hair, is drawn anew
SETS = ("train", "eval")
PHYSICAL = ("density", "EI", "GJ", "bend_damping", "twist_damping", "drag_linear")


def scene(rope: Rope, start: Grip, end: Grip, segments: int = SEGMENTS) -> sb.Scene:
    """The rope between its grips, hanging; its rest curvature, tilts and roll are zero until their values are given."""
    built = sb.Scene(rope.name)
    stiffness = {k: v for k, v in rope.values.items() if k in PHYSICAL}
    sb.add_rod(
        built,
        "rod",
        length=rope.free_length,
        segments=segments,
        points=_hanging(start.position[0], end.position[0], rope.free_length),
        start=start,
        end=end,
        tilts=True,
        roll=True,
        curvature_modes=MODES,
        **stiffness,
    )
    return built


def _hanging(first: Array, last: Array, length: float) -> Array:
    """(100, 3) m: a parabola of the given length that hangs between two points."""
    u = np.linspace(0.0, 1.0, 100)[:, None]

    def line(sag: float) -> Array:
        return np.asarray((1.0 - u) * first + u * last - 4.0 * sag * u * (1.0 - u) * UP)

    def excess(sag: float) -> float:
        return float(np.linalg.norm(np.diff(line(sag), axis=0), axis=1).sum() - length)

    return line(brentq(excess, 0.0, length))


def at_rest(rope: Rope, start: Grip, end: Grip, segments: int) -> Array:
    """(particles, 3) m, the equilibrium into which the hanging rope creeps in thick air, of several there may be."""
    still = scene(rope, *(Grip.fixed(g.position[0], g.direction[0], g.director[0]) for g in (start, end)), segments)
    slow = {f"rod_{k}": v for k, v in rope.values.items()} | {"rod_drag_linear": 1.0, "rod_bend_damping": 0.1}
    shape = None
    for h, seconds in CREEP:
        shape = sb.simulate(still, [seconds], sb.Solver(h=h), slow, shape).positions[-1]
    return shape


def simulated(
    rope: Rope, start: Grip, end: Grip, seconds: float, segments: int = SEGMENTS, h: float = H
) -> tuple[Array, Array, Array]:
    """Nodes (frames, nodes, 3) m, and the frames (frames, edges, 3) of the edges, from rest."""
    values = {f"rod_{k}": v for k, v in rope.values.items()}
    built = scene(rope, start, end, segments)
    rod = built.ropes["rod"]
    times = np.arange(round(seconds * RATE)) / RATE
    positions = sb.simulate(built, times, sb.Solver(h=h), values, at_rest(rope, start, end, segments)).positions
    return positions[:, rod.particles], positions[:, rod.directors[1:-1]]


def free_markers(rope: Rope, nodes: Array, directors: Array) -> Array:
    """(frames, free markers, 3) m, with their slack."""
    segments = nodes.shape[1] - 1
    arc = rope.free_length * np.arange(segments + 1) / segments
    place = rope.free_length * np.arange(1, rope.markers - 3) / (rope.markers - 3) + rope.slack[:, 2]
    line = CubicSpline(arc, nodes, axis=1)
    along = line(place, 1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    first = directors[:, (place / arc[1]).astype(int)]
    first = first - (first * along).sum(axis=2, keepdims=True) * along
    first /= np.linalg.norm(first, axis=2, keepdims=True)
    return np.asarray(line(place) + rope.slack[:, :1] * first + rope.slack[:, 1:2] * np.cross(along, first))


def gripped_markers(grip: Grip, back: float, ahead: float) -> Array:
    """(frames, 2, 3) m: on the rope, so far before and after where it leaves the grip."""
    pair = np.stack([grip.position - back * grip.direction, grip.position + ahead * grip.direction], axis=1)
    return np.asarray(pair[:: KNOTS // RATE][:-1])


def recording(rope: Rope, part: str, number: int, seed: int, seconds: float) -> Array:
    """(frames, markers, 3) m, with noise."""
    rng = np.random.default_rng([seed, int(rope.name.removeprefix("rope_")), SETS.index(part), number])
    while True:
        start, end = motion(rope, rng, seconds)
        nodes, directors = simulated(rope, start, end, seconds)
        if RATE**2 * np.linalg.norm(np.diff(nodes, 2, axis=0), axis=2).max() < SNAP:
            break
    free = free_markers(rope, nodes, directors)
    clean = np.concatenate([gripped_markers(start, GRIPPED, 0.0), free, gripped_markers(end, 0.0, GRIPPED)], axis=1)
    return clean + NOISE * rng.standard_normal(clean.shape)


def write(path: Path, positions: Array) -> None:
    """A list of frames (3, markers)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps([np.ascontiguousarray(frame.T) for frame in positions], protocol=4))


def describe(rope: Rope, seed: int) -> dict[str, object]:
    return {
        "what": "SYNTHETIC: a rope held by two moving grips; no measurement",
        "true": {**rope.values, "length": rope.free_length},
        "bending_length": (rope.values["EI"] / (rope.values["density"] * GRAVITY)) ** (1.0 / 3.0),
        "markers": rope.markers,
        "extra_roll": rope.extra_roll,
        "marker_slack": rope.slack.tolist(),
        "nominal_directions": {"start": NOMINAL[0].tolist(), "end": NOMINAL[1].tolist()},
        "made_with": {
            "segments": SEGMENTS,
            "substep": H,
            "noise": NOISE,
            "gripped": GRIPPED,
            "rate": RATE,
            "seed": seed,
        },
        "units_of_values": "SI: m, kg/m, N m^2, s, N s/m^2, rad, 1/m. length is the free one, between the grips",
    }


def main(folder: Path, train: int, evaluation: int, count: int, seconds: float, seed: int) -> None:
    for rope in ropes(seed)[:count]:
        for part, number in ((SETS[0], train), (SETS[1], evaluation)):
            for k in range(number):
                write(folder / rope.name / part / f"{k:02d}.pkl", recording(rope, part, k, seed, seconds))
        (folder / f"{rope.name}.json").write_text(json.dumps(describe(rope, seed), indent=2) + "\n")
        print(f"{rope.name}: {train} + {evaluation} recordings", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--train", type=int, default=6)
    parser.add_argument("--eval", type=int, default=3)
    parser.add_argument("--ropes", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    main(given.folder, given.train, given.eval, given.ropes, given.seconds, given.seed)
