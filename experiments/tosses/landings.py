"""Where a tossed cube comes to rest: its contact with the table from 30 tosses, and 33 others predicted.

    python experiments/tosses/landings.py [--fit 30]

The cube is nine particles with rigid distances, of which the eight corners touch the table. Friction, restitution, the
inertia, the height of the table and the scale of lengths are fitted to every other toss. The others are predicted from
their first frames, beside the numbers that the authors of the data state, and beside predictions without physics.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import sheetbend as sb
from cube import MASS, RATE, SIDE
from scipy.stats.qmc import Sobol
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import Term

DATA = Path(__file__).parent / "data" / "tosses.npz"
SCALE = 1.0176  # of the data's lengths, from free flight
SEEN = 8  # frames that a prediction starts from
H = 1 / (4 * RATE)
SOLVER = sb.Solver(h=H, method="implicit")
CUBE = SIDE / 2 * np.array([[0, 0, 0], *([x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))])
BOX = {  # in which the fit searches
    "table_friction": (0.16, 0.2),
    "table_restitution": (0.0, 0.4),
    "hollow": (0.0, 1.2),
    "table_z": (-2e-3, 1e-3),
    "stretch": (-0.008, 0.008),
}
ROUNDS, POINTS, BEST = 3, 16, 4
AUTHORS = {"table_friction": 0.18, "table_restitution": 0.125, "hollow": 0.0, "table_z": 0.0, "stretch": 0.0}


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


def rigid_pairs() -> list[tuple[int, int]]:
    """21 distances that hold nine points: longest first, each that does not follow from those before it."""
    length = {(i, j): np.linalg.norm(CUBE[i] - CUBE[j]) for i, j in combinations(range(9), 2)}
    rows: list[np.ndarray] = []
    pairs = []
    for i, j in sorted(length, key=lambda pair: -length[pair]):
        row = np.zeros((9, 3))
        row[i] = (CUBE[i] - CUBE[j]) / length[i, j]
        row[j] = -row[i]
        if np.linalg.svd([*rows, row.ravel()], compute_uv=False)[-1] > 0.05:
            rows.append(row.ravel())
            pairs.append((i, j))
    return pairs


def scene_of(toss: Toss, seen: int) -> sb.Scene:
    """The cube that flies from its first `seen` frames onto the table.

    `stretch` is what its lengths are longer than SCALE makes them, and gravity with them. `hollow` is how much larger
    its inertia is than that of a homogeneous cube: mass goes from the center to the corners.
    """
    down = np.array([0.0, 0.0, -9.81 / SCALE])
    first = slice(0, min(seen, toss.free))
    start = sb.start_of_poses(toss.times[first], toss.positions[first], toss.quaternions[first], down)
    arms = CUBE / SCALE @ start["rotation"].T
    scene = sb.Scene(toss.name, gravity=down)
    masses = np.full(9, MASS / 24)
    masses[0] = MASS * 2 / 3
    velocities = np.cross(start["spin"], arms)
    scene.add_particles(start["at"] + arms, masses, start["velocity"] + velocities)
    pairs = np.array(rigid_pairs())
    lengths = np.linalg.norm(arms[pairs[:, 0]] - arms[pairs[:, 1]], axis=1)
    scene.add_constraints("distance", pairs, name="cube", compliance=0.0, rest=lengths)
    scene.add_quantity("stretch", AUTHORS["stretch"], "", positive=False, scale=0.01)
    scene.add_quantity("hollow", AUTHORS["hollow"], "", positive=False, scale=0.3)
    stretch, hollow = (("stretch", "identity"),), (("hollow", "identity"),)
    corners = np.arange(3, 27)
    scene.add_terms(
        [
            Term("position", corners, arms.ravel()[corners], stretch),
            Term("velocity", corners, velocities.ravel()[corners], stretch),
            Term("rest", np.arange(len(pairs)), lengths, stretch),
            Term("gravity", 2, down[2], stretch),
            Term("mass", np.arange(9), np.array([-MASS / 3, *np.full(8, MASS / 24)]), hollow),
        ]
    )
    friction, restitution = AUTHORS["table_friction"], AUTHORS["table_restitution"]
    scene.contact(np.arange(1, 9), sb.Plane(name="table"), friction=friction, restitution=restitution, settle=True)
    return scene


def fitted(group: list[Toss], rounds: int = ROUNDS, points: int = POINTS) -> dict[str, float]:
    """The numbers that all tosses share, by search: each round tries points spread evenly over a box, and the next box
    is around the best of them, half as wide.

    The score of a point is the mean error of the center over time plus a third of that at rest.
    """
    names, box = list(BOX), np.array(list(BOX.values()))
    scenes = [scene_of(toss, toss.free) for toss in group]
    tried: list[tuple[float, np.ndarray]] = []
    for k in range(rounds):
        spread = Sobol(len(names), seed=k).random(points)
        for share in spread:
            point = box[:, 0] + share * (box[:, 1] - box[:, 0])
            found = np.array(
                [errors(t, dict(zip(names, point, strict=True)), s) for t, s in zip(group, scenes, strict=True)]
            )
            tried.append((float(found[:, 0].mean() + found[:, 1].mean() / 3), point))
        tried.sort(key=lambda one: one[0])
        best = [point for _, point in tried[:BEST]]
        middle, half = np.mean(best, axis=0), 0.25 * (box[:, 1] - box[:, 0])
        box = np.column_stack([np.maximum(middle - half, box[:, 0]), np.minimum(middle + half, box[:, 1])])
        score, point = tried[0]
        print(f"round {k + 1}: best score {score:.2f} mm at {np.array2string(point, precision=4)}", flush=True)
    return dict(zip(names, (float(a) for a in np.mean(best, axis=0)), strict=True))


def errors(toss: Toss, values: dict[str, float], scene: sb.Scene) -> np.ndarray:
    """Of a prediction: of the center in mm, mean over time and at rest, and of the attitude in degrees, likewise."""
    motion = sb.simulate(scene, toss.times, SOLVER, values)
    x = motion.positions[:, :9]
    apart = 1e3 * np.linalg.norm(x[:, 0] - toss.positions, axis=1)
    u, _, vt = np.linalg.svd(np.einsum("fki,kj->fij", x[:, 1:] - x[:, :1], CUBE[1:]))
    trace = np.einsum("fij,fij->f", u @ vt, matrices_of(toss.quaternions))
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


def report(label: str, group: list[Toss], values: dict[str, float], seen: int | None) -> None:
    found = np.array([errors(toss, values, scene_of(toss, seen or toss.free)) for toss in group])
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
    report(f"fitted, the {len(data)} tosses of the fit", data, found, None)
    for seen in (None, SEEN):
        report(f"fitted, {len(rest)} others", rest, found, seen)
        report(f"authors, {len(rest)} others", rest, AUTHORS, seen)
    report(f"fitted but without restitution, {len(rest)} others", rest, found | {"table_restitution": 0.0}, None)
    plain = np.mean([without_physics(toss) for toss in rest], axis=0)
    guesses = ("lies where it was seen last", "flies on until it is as low as it rests")
    for label, row in zip(guesses, plain, strict=True):
        print(f"without physics, {label}: {row[0]:.0f} mm over time, {row[1]:.0f} at rest")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, default=30, help="how many tosses are fitted")
    main(parser.parse_args().fit)
