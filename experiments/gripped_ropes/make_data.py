"""Writes recordings of five synthetic ropes held by two moving grips, in the layout of the DEFORM rope data.

    python experiments/gripped_ropes/make_data.py FOLDER [--train 6] [--eval 3] [--ropes 5] [--seconds 5] [--seed 7]

SYNTHETIC, no measurement. FOLDER/rope_1/train/00.pkl and so on, each a list of frames (3, markers) at 100 Hz, and
FOLDER/rope_1.json with the true values. A recording depends on the seed, its rope, its set and its number alone.
"""

import argparse
import json
import pickle
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from sheetbend.grip import Grip, any_across, carried

SEGMENTS, H = 120, 1 / 1600
RATE, KNOTS = 100, 400  # Hz, of the frames and of the grips' motion
GRIPPED = 0.03  # m of rope in each grip, between its two markers
NOISE = 5e-4  # m, standard deviation of each coordinate of each marker
UP, ALONG, ACROSS = np.eye(3)[[2, 0, 1]]
DROOP = np.radians(35.0)  # the rope leaves its grips downwards
NOMINAL = [np.cos(DROOP) * ALONG - side * np.sin(DROOP) * UP for side in (1.0, -1.0)]
REACH, TURN = 0.3, np.radians(60.0)  # m and rad, how far a grip goes from its nominal pose
MEAN_APART, APART = 0.65, (0.4, 0.9)  # of the rope's length, between the grips
PLACE, SWING = 0.13, 0.5  # m and rad, size of one wave of a grip's place and direction
REST, START = 0.1, 1.0  # s, at rest, and how long the motion takes to reach its full pace
CREEP = ((1 / RATE, 20.0), (H, 1.0))  # substeps and times, s, until the rope is at rest at first
SETS = ("train", "eval")
PHYSICAL = ("density", "EI", "GJ", "bend_damping", "twist_damping", "drag_linear")
MODES = (0, 1, 2)  # of the rest curvature

Array = np.ndarray


@dataclass(frozen=True)
class Rope:
    """True values of a rope; `values` are quantities of its rod, in SI units.

    Attributes:
        length: m, between the outermost markers, the gripped pieces included.
        extra_roll: rad, by which the end grip slowly rolls beside what `Grip.from_markers` knows: a model error.
        slack: (free markers, 3) m, where a marker sits off its material point: along the rope's two directors, and
            along its arc.
    """

    name: str
    markers: int
    length: float
    values: dict[str, float]
    extra_roll: float
    slack: Array

    @property
    def free_length(self) -> float:
        return self.length - 2.0 * GRIPPED


def ropes(seed: int = 7) -> list[Rope]:
    """Five ropes, from soft to stiff: the bending length (EI/(density g))^(1/3) goes from 0.1 to 0.45 m."""
    table = [
        # markers, length, density, bending length, GJ/EI, bend and twist damping, drag, rest curvature, extra roll
        (13, 1.04, 0.045, 0.10, 0.60, 0.030, 0.030, 4e-3, 2.0, 0.0),
        (12, 0.93, 0.060, 0.16, 1.30, 0.020, 0.030, 6e-3, 1.2, 0.0),
        (12, 0.90, 0.080, 0.23, 0.30, 0.015, 0.020, 4e-3, 0.9, np.radians(15.0)),
        (13, 1.00, 0.070, 0.33, 0.80, 0.010, 0.015, 8e-3, 0.6, 0.0),
        (12, 0.96, 0.110, 0.45, 1.00, 0.008, 0.010, 5e-3, 0.3, 0.0),
    ]
    return [_rope(number, seed, *row) for number, row in enumerate(table, start=1)]


def _rope(
    number: int,
    seed: int,
    markers: int,
    length: float,
    density: float,
    bending_length: float,
    ratio: float,
    bend_damping: float,
    twist_damping: float,
    drag: float,
    curvature: float,
    extra_roll: float,
) -> Rope:
    rng = np.random.default_rng([seed, number])
    EI = density * 9.81 * bending_length**3
    values = {"density": density, "EI": EI, "GJ": ratio * EI}
    values |= {"bend_damping": bend_damping, "twist_damping": twist_damping, "drag_linear": drag}
    for k, share in ((0, 1.0), (1, 0.7), (2, 0.4)):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        values[f"curvature_1_{k}"] = share * curvature * np.cos(angle)
        values[f"curvature_2_{k}"] = share * curvature * np.sin(angle)
    for grip in ("start", "end"):
        tilt, angle = np.radians(rng.uniform(2.0, 5.0)), rng.uniform(0.0, 2.0 * np.pi)
        values[f"{grip}_tilt_1"], values[f"{grip}_tilt_2"] = tilt * np.cos(angle), tilt * np.sin(angle)
    values["roll"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.3)
    free = markers - 4
    around, off = rng.uniform(0.0, 2.0 * np.pi, free), rng.uniform(1e-3, 2e-3, free)
    slack = np.stack([off * np.cos(around), off * np.sin(around), rng.uniform(-3e-3, 3e-3, free)], axis=1)
    return Rope(f"rope_{number}", markers, length, values, extra_roll, slack)


def motion(rope: Rope, rng: np.random.Generator, seconds: float) -> tuple[Grip, Grip]:
    """Two grips that start at rest and move at random, as smoothly as two robot arms."""
    times = np.arange(round(seconds * KNOTS) + 1) / KNOTS
    base = MEAN_APART * rope.length * ALONG
    while True:
        (x0, d0), (x1, d1) = (_wander(rng, times, nominal) for nominal in NOMINAL)
        apart = np.linalg.norm(x1 + base - x0, axis=1) / rope.length
        if APART[0] < apart.min() and apart.max() < APART[1]:
            break
    q0, q1 = (carried(any_across(n), n, d) for n, d in zip(NOMINAL, (d0, d1), strict=True))  # as Grip.from_markers
    extra = rope.extra_roll * np.sin(2.0 * np.pi * 0.15 * _pace(times))[:, None]
    q1 = np.cos(extra) * q1 + np.sin(extra) * np.cross(d1, q1)
    return Grip(times, x0, d0, q0), Grip(times, x1 + base, d1, q1)


def _wander(rng: np.random.Generator, times: Array, nominal: Array) -> tuple[Array, Array]:
    """(knots, 3) m off the nominal place, and (knots, 3) unit directions."""
    frequency, start = rng.uniform(0.1, 0.9, (4, 5)), rng.uniform(0.0, 2.0 * np.pi, (4, 5))
    size = rng.normal(size=(4, 5)) / np.sqrt(2.0)
    waves = (size * np.sin(2.0 * np.pi * frequency * _pace(times)[:, None, None] + start)).sum(axis=1)
    across = _within(TURN, SWING * waves[:, 3:])
    angle = np.linalg.norm(across, axis=1)[:, None]
    plane = np.stack([ACROSS, np.cross(nominal, ACROSS)])
    return _within(REACH, PLACE * waves[:, :3]), np.cos(angle) * nominal + np.sinc(angle / np.pi) * across @ plane


def _within(limit: float, vectors: Array) -> Array:
    """Vectors (knots, k) shortened smoothly to less than a limit."""
    share = np.linalg.norm(vectors, axis=1, keepdims=True) / limit
    return np.asarray(vectors * np.tanh(share) / np.maximum(share, 1e-12))


def _pace(times: Array) -> Array:
    """The motion's own time: it stands still at first and then comes smoothly to full pace."""
    u = np.clip((times - REST) / START, 0.0, 1.0)
    return START * (2.5 * u**4 - 3.0 * u**5 + u**6) + np.maximum(times - REST - START, 0.0)


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


def markers(rope: Rope, start: Grip, end: Grip, nodes: Array, directors: Array) -> Array:
    """(frames, markers, 3) m without noise: two in each grip, and the free ones with their slack."""
    segments = nodes.shape[1] - 1
    arc = rope.free_length * np.arange(segments + 1) / segments
    place = rope.free_length * np.arange(1, rope.markers - 3) / (rope.markers - 3) + rope.slack[:, 2]
    line = CubicSpline(arc, nodes, axis=1)
    along = line(place, 1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    first = directors[:, np.minimum((place / arc[1]).astype(int), segments - 1)]
    first = first - (first * along).sum(axis=2, keepdims=True) * along
    first /= np.linalg.norm(first, axis=2, keepdims=True)
    free = line(place) + rope.slack[:, :1] * first + rope.slack[:, 1:2] * np.cross(along, first)
    every = KNOTS // RATE
    gripped = [
        np.stack([grip.position - back * grip.direction, grip.position + ahead * grip.direction], axis=1)[::every]
        for grip, back, ahead in ((start, GRIPPED, 0.0), (end, 0.0, GRIPPED))
    ]
    frames = len(nodes)
    return np.concatenate([gripped[0][:frames], free, gripped[1][:frames]], axis=1)


def recording(rope: Rope, part: str, number: int, seed: int, seconds: float) -> Array:
    """(frames, markers, 3) m, with noise."""
    rng = np.random.default_rng([seed, int(rope.name.removeprefix("rope_")), SETS.index(part), number])
    start, end = motion(rope, rng, seconds)
    clean = markers(rope, start, end, *simulated(rope, start, end, seconds))
    return clean + NOISE * rng.standard_normal(clean.shape)


def write(path: Path, positions: Array) -> None:
    """A list of frames (3, markers)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps([np.ascontiguousarray(frame.T) for frame in positions], protocol=4))


def describe(rope: Rope, seed: int) -> dict[str, object]:
    return {
        "what": "SYNTHETIC: a rope held by two moving grips; no measurement",
        "true": {**rope.values, "length": rope.free_length},
        "bending_length": (rope.values["EI"] / (rope.values["density"] * 9.81)) ** (1.0 / 3.0),
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
