"""Writes recordings of five synthetic ropes held by two moving grips, in the layout of the DEFORM rope data.

    python experiments/gripped_ropes/make_data.py FOLDER [--train 6] [--eval 3] [--ropes 5] [--seconds 5] [--seed 7]
        [--nasty | --strange | --laboratory]

SYNTHETIC, no measurement. FOLDER/rope_1/train/00.pkl and so on, each a list of frames (3, markers) at 100 Hz, and
FOLDER/rope_1.json with the true values. A recording depends on the seed, its rope, its set and its number alone.

With --nasty the ropes have what real ones showed (`true_ropes`), some training files are spoiled (`spoil`), every other
rope is written as lists of lists of numbers, and the JSON also tells what the true values miss of the eval recordings.
With --strange it writes four ropes of which the recipe has no model (`strange`), with --laboratory five that change,
slip, roll or lose time as those of a laboratory do (`laboratory`).
"""

from __future__ import annotations

import argparse
import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from altered import as_kept, as_recorded, late, slipping
from grip_motion import KNOTS, NOMINAL, UP, motion
from laboratory import laboratory
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from sheetbend.gripped import GrippedMotion
from sheetbend.objects.grip import Grip
from sheetbend.quantities.quantities import product
from sheetbend.report.scores import coordinate_error
from spoil import BELONGS, SPOILED
from strange import strange
from true_ropes import GRAVITY, GRIPPED, Array, Rope, ropes

SEGMENTS, SUBSTEPS = 120, 16  # links, and substeps per frame
RATE = 100  # Hz, of recordings that do not say it
NOISE = 5e-4  # m, standard deviation of each coordinate of each marker
CREEP = ((1 / 100, 20.0), (1 / 400, 5.0), (1 / 1600, 0.5))  # substeps and times, s, until the rope is at rest at first
SNAP = 60.0  # m/s^2; a motion at which the rope snaps over, so that its path hangs on a hair, is drawn anew
SETS = ("train", "eval")
PHYSICAL = ("density", "EI", "GJ", "bend_damping", "twist_damping", "drag_linear", "yield_curvature", "yield_share")
PHYSICAL += ("EI2", "EA", "stretch_damping", "drag_quadratic")  # of strange ropes
MODELED, MODELED_SUBSTEPS, SMOOTHED = (
    48,
    8,
    0.08,
)  # links, substeps and smoothing, s, of predictions with the true values


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
        curvature_modes=_modes(rope, "curvature_1"),
        softness_modes=_modes(rope, "softness"),
        density_modes=_modes(rope, "density"),
        **stiffness,
    )
    share, knot = rope.knot
    weights = [(float(place), rope.marker_mass) for place in rope.places] + [(share * rope.free_length, knot)]
    _weigh_down(built, [(place, mass) for place, mass in weights if mass])
    return built


def _modes(rope: Rope, quantity: str) -> list[int]:
    return [int(name.rpartition("_")[2]) for name in rope.values if name.startswith(f"{quantity}_")]


def _weigh_down(built: sb.Scene, weights: list[tuple[float, float]]) -> None:
    """Masses, kg, at places along the rope, m; each is shared by the two nodes beside it."""
    rod = built.ropes["rod"]
    for place, mass in weights:
        k = int(np.searchsorted(rod.arc_length, place)) - 1
        ahead = (place - rod.arc_length[k]) / (rod.arc_length[k + 1] - rod.arc_length[k])
        for node, share in ((k, 1.0 - ahead), (k + 1, ahead)):
            built.add_terms([product("mass", int(rod.particles[node]), float(mass * share), {})])


def _hanging(first: Array, last: Array, length: float) -> Array:
    """(100, 3) m: a parabola of the given length that hangs between two points."""
    u = np.linspace(0.0, 1.0, 100)[:, None]

    def line(sag: float) -> Array:
        return np.asarray((1.0 - u) * first + u * last - 4.0 * sag * u * (1.0 - u) * UP)

    def excess(sag: float) -> float:
        return float(np.linalg.norm(np.diff(line(sag), axis=0), axis=1).sum() - length)

    return line(brentq(excess, 0.0, length))


def at_rest(rope: Rope, start: Grip, end: Grip, segments: int) -> Array:
    """(nodes, 3) m, the equilibrium into which the hanging rope creeps in thick air, of several there may be."""
    still = scene(rope, *(Grip.fixed(g.position[0], g.direction[0], g.director[0]) for g in (start, end)), segments)
    slow = {f"rod_{k}": v for k, v in rope.values.items()} | {"rod_drag_linear": 1.0, "rod_bend_damping": 0.1}
    shape = None
    for h, seconds in CREEP:
        shape = sb.simulate(still, [seconds], sb.Solver(h=h), slow, shape).nodes[-1]
    return shape


def simulated(
    rope: Rope, start: Grip, end: Grip, seconds: float, segments: int = SEGMENTS, substeps: int = SUBSTEPS
) -> tuple[Array, Array, Array]:
    """Nodes (frames, nodes, 3) m, and the frames (frames, edges, 3) of the edges, from rest."""
    values = {f"rod_{k}": v for k, v in rope.values.items()}
    built = scene(rope, start, end, segments)
    rod = built.ropes["rod"]
    times = np.arange(round(seconds * rope.rate)) / rope.rate
    solver = sb.Solver(h=1 / (substeps * rope.rate))
    x = sb.simulate(built, times, solver, values, at_rest(rope, start, end, segments)).nodes
    return x[:, rod.particles], x[:, rod.directors[1:-1]]


def free_markers(rope: Rope, nodes: Array, directors: Array) -> Array:
    """(frames, free markers, 3) m, with their slack."""
    segments = nodes.shape[1] - 1
    arc = rope.free_length * np.arange(segments + 1) / segments
    place = rope.places + rope.slack[:, 2]
    line = CubicSpline(arc, nodes, axis=1)
    along = line(place, 1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    first = directors[:, (place / arc[1]).astype(int)]
    first = first - (first * along).sum(axis=2, keepdims=True) * along
    first /= np.linalg.norm(first, axis=2, keepdims=True)
    return np.asarray(line(place) + rope.slack[:, :1] * first + rope.slack[:, 1:2] * np.cross(along, first))


def gripped_markers(grip: Grip, back: float, ahead: float, rope: Rope) -> Array:
    """(frames, 2, 3) m: on the grip, so far before and after where the rope leaves it."""
    pair = np.stack([grip.position - back * grip.direction, grip.position + ahead * grip.direction], axis=1)
    return late(rope, pair, KNOTS)[::KNOTS][:-1]


def recording(rope: Rope, part: str, number: int, seed: int, seconds: float) -> Array:
    """(frames, markers, 3) m, with noise."""
    rng = np.random.default_rng([seed, int(rope.name.removeprefix("rope_")), SETS.index(part), number])
    found = as_recorded(rope, rng)
    while True:
        start, end = motion(rope, rng, seconds)
        nodes, directors = simulated(found, *slipping(rope, start, end, rng), seconds)
        if rope.rate**2 * np.linalg.norm(np.diff(nodes, 2, axis=0), axis=2).max() < SNAP:
            break
    free = free_markers(rope, nodes, directors)
    grips = [gripped_markers(start, GRIPPED, 0.0, rope), gripped_markers(end, 0.0, GRIPPED, rope)]
    clean = np.concatenate([grips[0], free, grips[1]], axis=1)
    noisy = clean + rope.louder * NOISE * rng.standard_normal(clean.shape)
    return as_kept(rope, noisy, rng) if part == "train" else noisy


def write(path: Path, positions: Array, rope: Rope) -> None:
    """A list of frames (3, markers), arrays or lists of lists of numbers; beside it the rate where it is another one
    than readers assume."""
    frames = [np.ascontiguousarray(frame.T) for frame in positions[:, :, list(rope.axes)]]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps([frame.tolist() for frame in frames] if rope.lists else frames, protocol=4))
    if rope.rate != RATE:
        path.with_suffix(".json").write_text(json.dumps({"rate": rope.rate}) + "\n")


def missed(rope: Rope, positions: Array) -> float:
    """Mean error of a coordinate, m, of the true values, as `sheetbend.gripped.evaluate` scores a fit.

    They are simulated between the grips as recorded and smoothed, from the true shape at rest. The places of the
    markers along the rope are known, how far they sit beside it is not.
    """
    count = rope.markers
    recorded = sb.Recording(positions, np.arange(len(positions)) / rope.rate, clamped=(0, 1, count - 2, count - 1))
    motion = GrippedMotion.of(recorded, SMOOTHED)
    grips = [motion.grip(end, slice(None), nominal) for end, nominal in zip((False, True), NOMINAL, strict=True)]
    straight = replace(rope, slack=rope.slack * [0.0, 0.0, 1.0])
    found = positions.copy()
    found[:, 2:-2] = free_markers(
        straight, *simulated(rope, *grips, len(positions) / rope.rate, MODELED, MODELED_SUBSTEPS)
    )
    return coordinate_error(recorded, found)


def describe(rope: Rope, seed: int) -> dict[str, object]:
    return {
        "what": "SYNTHETIC: a rope held by two moving grips; no measurement",
        "true": {**rope.values, "length": rope.free_length},
        "bending_length": (rope.values["EI"] / (rope.values["density"] * GRAVITY)) ** (1.0 / 3.0),
        "markers": rope.markers,
        "extra_roll": rope.extra_roll,
        "marker_slack": rope.slack.tolist(),
        "marker_places": rope.places.tolist(),
        "marker_mass": rope.marker_mass,
        "weighed": rope.weighed,
        "knot": rope.knot,
        "axes": rope.axes,
        "nominal_directions": {"start": NOMINAL[0].tolist(), "end": NOMINAL[1].tolist()},
        "made_with": {
            "segments": SEGMENTS,
            "substep": 1 / (SUBSTEPS * rope.rate),
            "noise": rope.louder * NOISE,
            "gripped": GRIPPED,
            "rate": rope.rate,
            "seed": seed,
        },
        "units_of_values": "SI: m, kg/m, N m^2, s, N s/m^2, rad, 1/m. length is the free one, between the grips",
    }


def main(
    folder: Path,
    train: int,
    evaluation: int,
    count: int,
    seconds: float,
    seed: int,
    nasty: bool = False,
    odd: Callable[[int], list[Rope]] | None = None,
) -> None:
    known = {rope.name: rope for rope in (odd(seed) if odd else ropes(seed, nasty))}
    for rope in list(known.values())[:count]:
        told = describe(rope, seed)
        for k in range(train):
            which = (rope.name, k) if nasty else None
            positions = recording(known[BELONGS.get(which, rope.name)], "train", k, seed, seconds)
            spoiled = SPOILED[which](positions) if which in SPOILED else positions
            write(folder / rope.name / "train" / f"{k:02d}.pkl", spoiled, rope)
        unseen = [recording(rope, "eval", k, seed, seconds) for k in range(evaluation)]
        for k, positions in enumerate(unseen):
            write(folder / rope.name / "eval" / f"{k:02d}.pkl", positions, rope)
        if nasty or odd:
            told["missed_by_true_values"] = [missed(rope, positions) for positions in unseen]
        if nasty:
            words = {which: what.__name__ for which, what in SPOILED.items()}
            words |= {which: f"a recording of {other}" for which, other in BELONGS.items()}
            told["spoiled"] = {f"{k:02d}": what for (name, k), what in words.items() if name == rope.name and k < train}
        (folder / f"{rope.name}.json").write_text(json.dumps(told, indent=2) + "\n")
        print(f"{rope.name}: {train} + {evaluation} recordings", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--train", type=int, default=6)
    parser.add_argument("--eval", type=int, default=3)
    parser.add_argument("--ropes", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=7)
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--nasty", action="store_true")
    kind.add_argument("--strange", action="store_const", dest="odd", const=strange)
    kind.add_argument("--laboratory", action="store_const", dest="odd", const=laboratory)
    given = parser.parse_args()
    main(given.folder, given.train, given.eval, given.ropes, given.seconds, given.seed, given.nasty, given.odd)
