"""The cube in flight: its recordings, and the scene of one flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
import turning_axes
from cutting import RATE, read_and_cut
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import product
from turning_axes import steady

DATA = Path(__file__).parent / "data" / "flights.npz"
MASS, SIDE = 0.37, 0.1048  # kg, m
DRAG = 0.02  # N s/m, to start from
CORNERS = SIDE / 2 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # four of them, a tetrahedron
SIGMA = 5e-5  # m, of a corner
SEEN = 4  # frames that a prediction starts from
START = [f"cube_{key}{axis}" for key in ("", "turn_", "velocity_", "spin_") for axis in "xyz"]


@dataclass(frozen=True)
class Flight:
    """Poses of the cube: times (frames,) s, positions (frames, 3) m, quaternions (frames, 4)."""

    name: str
    times: np.ndarray
    positions: np.ndarray
    quaternions: np.ndarray

    def steady(self, rate: float) -> Flight:
        """In axes that do not turn, where those of the recording turn about z at a rate (rad/s)."""
        return Flight(self.name, self.times, *steady(self.times, self.positions, self.quaternions, rate))

    def about(self, center: np.ndarray) -> Flight:
        """Of a point (3,) m of the cube, such as its center of mass, instead of its middle."""
        moved = self.positions + matrices_of(self.quaternions) @ center
        return Flight(self.name, self.times, moved, self.quaternions)


def flights(folder: Path | None = None) -> list[Flight]:
    """All of them, in the order of the source: the ones that are shipped, or those of a folder."""
    data = np.load(DATA) if folder is None else read_and_cut(folder)[0]
    ends = zip(data["starts"][:-1], data["starts"][1:], data["toss"], strict=True)
    return [
        Flight(f"toss {toss}", np.arange(b - a) / RATE, data["positions"][a:b], data["quaternions"][a:b])
        for a, b, toss in ends
    ]


def turning(group: Sequence[Flight]) -> tuple[float, float]:
    """How fast the axes of the recordings turn about z, rad/s, and its 95 % half-width; the center of mass may be
    anywhere in the cube."""
    return turning_axes.turning([(f.times, f.positions, np.moveaxis(-matrices_of(f.quaternions), 2, 0)) for f in group])


def scene_of(flight: Flight, gravity: float = 9.81, drag: float = DRAG) -> tuple[sb.Scene, sb.Body]:
    """The cube as a homogeneous box that flies from the first poses, slowed by the air; gravity is the quantity
    `gravity`, m/s^2 in the recording's unit of length."""
    scene = sb.Scene(flight.name, gravity=(0.0, 0.0, 0.0))
    down = np.array([0.0, 0.0, -gravity])
    first = slice(0, SEEN)
    start = sb.start_of_poses(flight.times[first], flight.positions[first], flight.quaternions[first], down)
    body = scene.add_body("cube", of=sb.Inertia.box(MASS, np.full(3, SIDE)), drag=drag, **start)
    scene.add_quantity("gravity", gravity, "m/s^2")
    scene.add_terms([product("gravity", 2, -1.0, {"gravity": "identity"})])
    return scene, body


def experiment(flight: Flight, frames: int | None = None, predict: str | None = None) -> sb.Experiment:
    """The flight's first frames as data, all by default; those after them are held out."""
    scene, body = scene_of(flight)
    recording = sb.Recording.from_poses(
        flight.times, flight.positions, flight.quaternions, CORNERS, name=flight.name.replace(" ", "_")
    )
    cut = None if frames is None else float(flight.times[frames] - 0.5 / RATE)
    return sb.Experiment(
        scene=scene,
        recording=recording,
        markers=sb.on_body(body, CORNERS),
        solver=sb.Solver(h=1 / (4 * RATE)),
        fit=None if cut is None else (0.0, cut),
        held_out=None if cut is None else (cut, float(flight.times[-1]) + 1e-6),
        sigma=SIGMA,
        predict=predict,
    )


def parameters(shared: Sequence[str]) -> list[sb.Parameter | str]:
    """What all flights share, and the start of each."""
    units = {"": "m", "turn": "rad", "velocity": "m/s", "spin": "rad/s"}
    own = [(name, name.removeprefix("cube_").rpartition("_")[0]) for name in START]
    return [*shared, *(sb.Parameter(name=name, private=True, unit=units[key], scale=0.1) for name, key in own)]
