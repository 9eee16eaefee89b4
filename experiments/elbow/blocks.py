"""Two blocks on a hinge, in flight: their recordings, and the scene of one flight."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.arrays.rotations import matrices_of, quaternions_of, rotation_matrix
from sheetbend.quantities.quantities import product

sys.path.insert(0, str(Path(__file__).parents[1] / "tosses"))

from turning_axes import steady

DATA = Path(__file__).parent / "data" / "flights.npz"
RATE, MASS, SIDES = 148.0, 0.37, np.array([0.1, 0.05, 0.05])  # Hz, kg, m
HINGE, ARM = np.array([-0.035, 0.06, 0.0]), np.array([0.035, 0.0, 0.0])  # m: center to hinge, hinge to second center
AXIS = (0.0, 1.0, 0.0)
CORNERS = SIDES / 2 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # four of each block
SIGMA = 1e-4  # m, of a corner
LEVELED = 328  # number of the toss in the source from which on the recording's z is vertical
UP = np.array([-0.0361, 0.0257, 0.9990])  # of the table, in the recordings before
SEEN = 4  # frames that a prediction starts from
OWN = {
    **{
        f"first_{key}{axis}": unit
        for key, unit in (("", "m"), ("turn_", "rad"), ("velocity_", "m/s"), ("spin_", "rad/s"))
        for axis in "xyz"
    },
    "hinge_angle": "rad",
    "hinge_rate": "rad/s",
}


@dataclass(frozen=True)
class Flight:
    """Poses of the first block and the angle of the hinge: times (frames,) s, positions (frames, 3) m, quaternions
    (frames, 4), angles (frames,) rad."""

    name: str
    times: np.ndarray
    positions: np.ndarray
    quaternions: np.ndarray
    angles: np.ndarray

    def second(self, hinge: np.ndarray = HINGE) -> tuple[np.ndarray, np.ndarray]:
        """Place (frames, 3) m and attitude (frames, 3, 3) of the second block, where its hinge is at `hinge` (3,) m."""
        return second_block(self.positions, matrices_of(self.quaternions), self.angles, hinge)

    def middle(self) -> np.ndarray:
        """(frames, 3) m, between the centers of the blocks."""
        return (self.positions + self.second()[0]) / 2.0

    def steady(self, rate: float) -> Flight:
        """In axes that do not turn, where those of the recording turn about z at a rate (rad/s)."""
        positions, quaternions = steady(self.times, self.positions, self.quaternions, rate)
        return replace(self, positions=positions, quaternions=quaternions)


@dataclass(frozen=True)
class Start:
    """State at a flight's first frame: what `Scene.add_body` takes of the first block, angle and rate of the hinge, and
    place and velocity of the middle between the blocks, which alone falls as a point does."""

    body: dict[str, np.ndarray]
    angle: float
    rate: float
    middle: np.ndarray
    velocity: np.ndarray


def start_of(flight: Flight, frames: int, down: np.ndarray) -> Start:
    """From a flight's first frames, in a gravity (3,) m/s^2."""
    few = slice(0, frames)
    t = flight.times[few]
    turns = sb.start_of_poses(t, flight.positions[few], flight.quaternions[few], down)
    spin = np.asarray(turns["spin"])
    middle, velocity = np.polynomial.polynomial.polyfit(t, flight.middle()[few] - 0.5 * np.outer(t**2, down), 1)
    angle, rate = np.polynomial.polynomial.polyfit(t, flight.angles[few], 1)
    frame = np.asarray(turns["rotation"])
    hinge, arm = frame @ HINGE, frame @ rotation_matrix("angle", angle * np.array(AXIS)) @ ARM
    swing = np.cross(spin, hinge) + np.cross(spin + rate * (frame @ AXIS), arm)
    body = {
        "at": middle - 0.5 * (hinge + arm),
        "rotation": frame,
        "velocity": velocity - 0.5 * swing,
        "spin": spin,
    }
    return Start(body, float(angle), float(rate), middle, velocity)


def second_block(
    positions: np.ndarray, frames: np.ndarray, angles: np.ndarray, hinge: np.ndarray = HINGE
) -> tuple[np.ndarray, np.ndarray]:
    turned = frames @ np.array([rotation_matrix("angle", a * np.array(AXIS)) for a in angles])
    return positions + frames @ hinge + turned @ ARM, turned


def level(leans: bool) -> np.ndarray:
    """The rotation (3, 3) from the recording's axes, which may lean, to those of the table."""
    if not leans:
        return np.eye(3)
    axis = np.cross(UP, (0.0, 0.0, 1.0))
    sine = float(np.linalg.norm(axis))
    return rotation_matrix("table", np.arctan2(sine, UP[2]) / sine * axis)


def leveled(leans: bool, positions: np.ndarray, quaternions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turn = level(leans)
    return positions @ turn.T, quaternions_of(turn @ matrices_of(quaternions))


def leaning_of(data: Mapping[str, np.ndarray]) -> np.ndarray:
    """(tosses,) whether each was recorded in axes that lean; by its number in the source where nothing else says it."""
    return data["leans"] if "leans" in data else data["toss"] < LEVELED


def flights(data: Mapping[str, np.ndarray] | None = None) -> list[Flight]:
    """The shipped ones, or given ones of `block_cutting.cut`, in the order of the source; z is vertical."""
    data = np.load(DATA) if data is None else data
    ends = zip(data["starts"][:-1], data["starts"][1:], data["toss"], leaning_of(data), strict=True)
    x, q, angles = (data[key] for key in ("positions", "quaternions", "angles"))
    return [
        Flight(f"toss {n}", np.arange(b - a) / RATE, *leveled(leans, x[a:b], q[a:b]), angles[a:b])
        for a, b, n, leans in ends
    ]


def scene_of(flight: Flight, gravity: float = 9.81) -> tuple[sb.Scene, sb.Body, sb.Body]:
    """Two homogeneous boxes that fly from the first poses; gravity is the quantity `gravity`, m/s^2 in the recording's
    unit of length."""
    scene = sb.Scene(flight.name, gravity=(0.0, 0.0, 0.0))
    start = start_of(flight, SEEN, np.array([0.0, 0.0, -gravity]))
    at, frame = start.body["at"], start.body["rotation"]
    centers, turned = second_block(at[None], frame[None], np.array([start.angle]))
    box = sb.Inertia.box(MASS, SIDES)
    first = scene.add_body("first", of=box, **start.body)
    second = scene.add_body("second", of=box, at=centers[0], rotation=turned[0])
    sb.hinge(first, second, at=at + frame @ HINGE, axis=frame @ AXIS, rate=start.rate, viscosity=1e-4)
    scene.add_quantity("gravity", gravity, "m/s^2")
    scene.add_terms([product("gravity", 2, -1.0, {"gravity": "identity"})])
    return scene, first, second


def experiment(
    flight: Flight, frames: int | None = None, hinge: np.ndarray = HINGE, gravity: float = 9.81
) -> sb.Experiment:
    """The flight's first frames as data, all by default; those after them are held out."""
    scene, first, second = scene_of(flight, gravity)
    centers, turned = flight.second(hinge)
    one = sb.Recording.from_poses(flight.times, flight.positions, flight.quaternions, CORNERS)
    two = sb.Recording.from_poses(flight.times, centers, quaternions_of(turned), CORNERS)
    names = [f"{block}_{k}" for block in ("first", "second") for k in range(len(CORNERS))]
    recording = sb.Recording(
        np.concatenate([one.positions, two.positions], axis=1),
        flight.times,
        markers=tuple(names),
        name=flight.name.replace(" ", "_"),
    )
    cut = None if frames is None else float(flight.times[frames] - 0.5 / RATE)
    return sb.Experiment(
        scene=scene,
        recording=recording,
        markers=[*sb.on_body(first, CORNERS), *sb.on_body(second, CORNERS)],
        solver=sb.Solver(h=1 / (4 * RATE)),
        fit=None if cut is None else (0.0, cut),
        held_out=None if cut is None else (cut, float(flight.times[-1]) + 1e-6),
        sigma=SIGMA,
    )


def parameters(shared: Sequence[str]) -> list[sb.Parameter | str]:
    """What all flights share, and the start of each."""
    return [*shared, *(sb.Parameter(name=name, private=True, unit=unit, scale=0.1) for name, unit in OWN.items())]
