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
from cube import CORNERS, MASS, RATE, SIDE
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import Term

DATA = Path(__file__).parent / "data" / "tosses.npz"
SCALE = 1.0176  # of the data's lengths, from free flight
SEEN = 8  # frames that a prediction starts from
SIGMA = 5e-3  # m: what the model is asked to explain
H = 1 / (4 * RATE)
SOLVER = sb.Solver(h=H, method="implicit")
CUBE = SIDE / 2 * np.array([[0, 0, 0], *([x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))])
START = {"table_friction": 0.18, "table_restitution": 0.125, "hollow": 0.2, "table_z": 0.0, "stretch": 0.0}  # the fit's
AUTHORS = {"table_friction": 0.18, "table_restitution": 0.125}


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
    scene.add_quantity("stretch", START["stretch"], "", positive=False, scale=0.01)
    scene.add_quantity("hollow", START["hollow"], "", positive=False, scale=0.3)
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
    friction, restitution = START["table_friction"], START["table_restitution"]
    scene.contact(np.arange(1, 9), sb.Plane(name="table"), friction=friction, restitution=restitution, settle=True)
    return scene


def fitted(group: list[Toss], frames: int = 4) -> sb.FitResult:
    """What all tosses share, from every so many frames of the center and of four corners."""
    corner = [int(np.argmin(np.linalg.norm(CUBE - c, axis=1))) for c in CORNERS]
    experiments = []
    for toss in group:
        few = slice(0, None, frames)
        points = np.vstack([np.zeros(3), CORNERS]) / SCALE
        recording = sb.Recording.from_poses(
            toss.times[few], toss.positions[few], toss.quaternions[few], points, name=toss.name.replace(" ", "_")
        )
        places = [sb.on_particle(k) for k in (0, *corner)]
        scene = scene_of(toss, toss.free)
        experiments.append(sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=SIGMA))
    return sb.fit(experiments, parameters=list(START), refine=False, beginnings=False)


def errors(toss: Toss, values: dict[str, float], seen: int = SEEN) -> np.ndarray:
    """Of a prediction from the first frames: of the center in mm, mean over time and at rest, and of the attitude in
    degrees, likewise."""
    scene = scene_of(toss, seen)
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


def main(count: int) -> None:
    every = tosses()
    data = every[::2][:count]
    rest = [toss for toss in every if toss not in data]
    result = fitted(data)
    print(result.report())
    found = {e.name: e.value for e in result.estimates}
    for label, values in (("fitted", found), ("authors", AUTHORS | {"hollow": 0.0})):
        for what, group in ((f"{len(data)} fitted tosses", data), (f"{len(rest)} others", rest)):
            all_errors = np.array([errors(toss, values) for toss in group])
            mean, middle = all_errors.mean(axis=0), np.median(all_errors, axis=0)
            print(
                f"{label}, {what}, from the first {SEEN} frames: center {mean[0]:.1f} mm over time (median "
                f"{middle[0]:.1f}), {mean[1]:.1f} at rest ({middle[1]:.1f}); attitude {mean[2]:.1f} degrees "
                f"({middle[2]:.1f}), {mean[3]:.1f} at rest ({middle[3]:.1f})"
            )
    plain = np.mean([without_physics(toss) for toss in rest], axis=0)
    for label, row in zip(
        ("lies where it was seen last", "flies on until it is as low as it rests"), plain, strict=True
    ):
        print(f"without physics, {label}: {row[0]:.0f} mm over time, {row[1]:.0f} at rest")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, default=30, help="how many tosses are fitted")
    main(parser.parse_args().fit)
