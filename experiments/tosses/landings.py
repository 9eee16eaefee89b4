"""Where a tossed cube comes to rest: its contact with the table from 30 tosses, and 33 others predicted.

    python experiments/tosses/landings.py [--fit 30]

The cube is a rigid body whose eight corners touch the table. Friction, the dissipation of the contact, the moment of
inertia, the center of mass, the height of the table and the scale of lengths are fitted to every other toss. The others
are predicted from their first frames, beside the numbers that the authors of the data state, and beside predictions
without physics.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from cube import MASS, RATE, SIDE
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import Term

DATA = Path(__file__).parent / "data" / "tosses.npz"
SCALE = 1.0176  # of the data's lengths, from free flight
SEEN = 8  # frames that a prediction starts from
SOLVER = sb.Solver(h=1 / (8 * RATE), method="implicit")
CORNERS = sb.box_corners(np.full(3, SIDE / SCALE))
INERTIA = MASS * (SIDE / SCALE) ** 2 / 6  # kg m^2, of a homogeneous cube
STIFFNESS = 1e4  # N/m, of a corner
BEGIN = {  # where the search begins, and how far around it looks: standard deviations
    "table_friction": (0.18, 0.01),
    "table_contact_dissipation": (2.0, 1.0),
    "hollow": (0.3, 0.3),
    "cube_center_x": (0.0, 2e-3),
    "cube_center_y": (0.0, 2e-3),
    "cube_center_z": (0.0, 2e-3),
    "table_z": (0.0, 5e-4),
    "stretch": (0.0, 3e-3),
}
ROUNDS, POINTS, BEST = 24, 16, 5
AUTHORS = {"table_friction": 0.18, "table_restitution": 0.125}  # and a homogeneous cube


@dataclass(frozen=True)
class Toss:
    """Poses of the cube from where the hand lets go until it rests.

    Attributes:
        positions: (frames, 3) m, in the data's unit.
        quaternions: (frames, 4), (x, y, z, w).
        free: frames before the first contact.
    """

    name: str
    positions: np.ndarray
    quaternions: np.ndarray
    free: int

    @property
    def times(self) -> np.ndarray:
        """(frames,) s."""
        return np.arange(len(self.positions)) / RATE


def tosses() -> list[Toss]:
    """All of them, in the order of the source."""
    data = np.load(DATA)
    x, q = (data[key].astype(float) for key in ("positions", "quaternions"))
    ends = zip(data["starts"][:-1], data["starts"][1:], data["toss"], data["free"], strict=True)
    return [Toss(f"toss {toss}", x[a:b], q[a:b], int(free)) for a, b, toss, free in ends]


def scene_of(toss: Toss, seen: int, restitution: float | None = None) -> sb.Scene:
    """The cube that flies from its first `seen` frames onto the table, which is soft, or rigid with a restitution.

    `stretch` is what its lengths are longer than SCALE makes them, and gravity with them.
    """
    down = np.array([0.0, 0.0, -9.81 / SCALE])
    first = slice(0, min(seen, toss.free))
    start = sb.start_of_poses(toss.times[first], toss.positions[first], toss.quaternions[first], down)
    scene = sb.Scene(toss.name, gravity=down)
    cube = scene.add_body("cube", of=sb.Inertia.box(MASS, np.full(3, SIDE / SCALE)), **start)
    law = {"stiffness": STIFFNESS, "dissipation": BEGIN["table_contact_dissipation"][0]}
    if restitution is not None:
        law = {"restitution": restitution}
    friction = AUTHORS["table_friction"]
    scene.contact(cube, sb.Plane(name="table"), friction=friction, points=CORNERS, settle=True, **law)
    scene.add_quantity("stretch", 0.0, "", positive=False, scale=0.01)
    axes = np.arange(4 * len(CORNERS)).reshape(-1, 4)[:, 1:].ravel()
    stretch = (("stretch", "identity"),)
    scene.add_terms([Term("contact_weight", axes, CORNERS.ravel(), stretch), Term("gravity", 2, down[2], stretch)])
    return scene


def quantities(point: Mapping[str, float]) -> dict[str, float]:
    """The scene's quantities of a point of the search: `hollow` is by how much the moments of inertia are larger than
    those of a homogeneous cube."""
    values = dict(point)
    moment = INERTIA * (1.0 + values.pop("hollow", 0.0))
    return values | {f"cube_inertia_{axis}": moment for axis in (1, 2, 3)}


def fitted(group: list[Toss], rounds: int = ROUNDS, points: int = POINTS) -> dict[str, float]:
    """The numbers that all tosses share, by the cross-entropy method (Rubinstein 1999): each round draws points around
    the best ones of the round before, as widely as those lie apart.

    The score of a point is the mean error of the center over time plus a third of that at rest.
    """
    names = list(BEGIN)
    middle, wide = np.array(list(BEGIN.values())).T
    scenes = [scene_of(toss, toss.free) for toss in group]
    random = np.random.default_rng(0)
    best: tuple[float, np.ndarray] = (np.inf, middle)
    for k in range(rounds):
        drawn = np.vstack([middle, middle + wide * random.standard_normal((points - 1, len(names)))])
        drawn[:, :3] = np.abs(drawn[:, :3])
        scores = []
        for point in drawn:
            values = dict(zip(names, point, strict=True))
            found = np.array([errors(t, values, s) for t, s in zip(group, scenes, strict=True)])
            scores.append(float(found[:, 0].mean() + found[:, 1].mean() / 3))
        order = np.argsort(scores)
        best = min(best, (scores[order[0]], drawn[order[0]]), key=lambda one: one[0])
        chosen = drawn[order[:BEST]]
        middle, wide = 0.3 * best[1] + 0.7 * chosen.mean(axis=0), np.maximum(0.75 * wide, 0.9 * chosen.std(axis=0))
        print(f"round {k + 1}: best score {best[0]:.2f} mm, around {np.array2string(middle, precision=4)}", flush=True)
    return dict(zip(names, (float(a) for a in middle), strict=True))


def errors(toss: Toss, point: Mapping[str, float], scene: sb.Scene) -> np.ndarray:
    """Of a prediction: of the center in mm, mean over time and at rest, and of the attitude in degrees, likewise."""
    values = quantities(point)
    motion = sb.simulate(scene, toss.times, SOLVER, values)
    places, axes = scene.bodies["cube"].pose(motion, values)
    apart = 1e3 * np.linalg.norm(places - toss.positions, axis=1)
    trace = np.einsum("fij,fij->f", axes, matrices_of(toss.quaternions))
    angle = np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))
    return np.array([apart.mean(), apart[-1], angle.mean(), angle[-1]])


def without_physics(toss: Toss, seen: int = SEEN) -> np.ndarray:
    """The same where it lies still from the last frame that is seen, and where it goes on as it flew until it is as
    low as it rests: two rows."""
    x, last = toss.positions, min(seen, toss.free)
    velocity = (x[last - 1] - x[0]) / toss.times[last - 1]
    along = x[0] + np.outer(toss.times, velocity) - np.outer(toss.times**2, [0.0, 0.0, 4.905 / SCALE])
    low = along[:, 2] < SIDE / 2 / SCALE
    stops = int(low.argmax()) if low.any() else len(x)
    along[stops:] = along[min(stops, len(x) - 1)]
    still = x.copy()
    still[last:] = x[last - 1]
    apart = [1e3 * np.linalg.norm(way - x, axis=1) for way in (still, along)]
    return np.array([[a.mean(), a[-1]] for a in apart])


def report(label: str, group: list[Toss], point: Mapping[str, float], seen: int | None = None) -> None:
    scenes = [scene_of(toss, seen or toss.free, point.get("table_restitution")) for toss in group]
    found = np.array([errors(toss, point, scene) for toss, scene in zip(group, scenes, strict=True)])
    mean, middle = found.mean(axis=0), np.median(found, axis=0)
    frames = "all frames before contact" if seen is None else f"the first {seen} frames"
    print(
        f"{label}, from {frames}: center {mean[0]:.1f} mm over time (median {middle[0]:.1f}), {mean[1]:.1f} at rest "
        f"({middle[1]:.1f}); attitude {mean[2]:.0f} degrees ({middle[2]:.0f}), {mean[3]:.0f} at rest ({middle[3]:.0f})",
        flush=True,
    )


def main(count: int) -> None:
    every = tosses()
    data = every[::2][:count]
    rest = [toss for toss in every if toss not in data]
    found = fitted(data)
    print("fitted: " + ", ".join(f"{name} {value:.4g}" for name, value in found.items()))
    report(f"fitted, the {len(data)} tosses of the fit", data, found)
    for seen in (None, SEEN):
        report(f"fitted, {len(rest)} others", rest, found, seen)
        report(f"authors, {len(rest)} others", rest, AUTHORS, seen)
    centered = found | {f"cube_center_{axis}": 0.0 for axis in "xyz"}
    report(f"fitted but with the center of mass in the middle, {len(rest)} others", rest, centered)
    elastic = {name: value for name, value in found.items() if name != "table_contact_dissipation"}
    for restitution in (0.0, 0.2):
        label = f"fitted but rigid with restitution {restitution}, {len(rest)} others"
        report(label, rest, elastic | {"table_restitution": restitution})
    plain = np.mean([without_physics(toss) for toss in rest], axis=0)
    guesses = ("lies where it was seen last", "flies on until it is as low as it rests")
    for label, row in zip(guesses, plain, strict=True):
        print(f"without physics, {label}: {row[0]:.0f} mm over time, {row[1]:.0f} at rest")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, default=30, help="how many tosses are fitted")
    main(parser.parse_args().fit)
