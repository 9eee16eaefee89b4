"""Where two tossed blocks on a hinge come to rest: predictions of tosses that nothing was fitted to.

    python experiments/elbow/block_landings.py [--others FOLDER]

Each block is a rigid body with eight rounded corners, which touch the table. The numbers of the contact, of the hinge
and of the moments of inertia are those that `block_landings_study.py` finds from every other toss. The other tosses are
predicted from their free flight, beside predictions without physics. FOLDER holds more tosses of these blocks in an
elbow_tosses.npz as the source's (`make_data.py`), which are predicted too.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from block_cutting import read_and_cut
from blocks import AXIS, HINGE, MASS, RATE, SIDES, Flight, leaning_of, level, leveled, second_block, start_of
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import Term
from toss_files import again

DATA = Path(__file__).parent / "data" / "tosses.npz"
SCALE = 1.018  # of the data's lengths, from free flight
DOWN = np.array([0.0, 0.0, -9.81 / SCALE])  # m/s^2 in the unit of the data
FEWEST = 7  # frames of free flight from which the state at the start is known well
SOLVER = sb.Solver(h=1 / (8 * RATE), method="implicit")
TOUCHING = sb.box_corners(SIDES / SCALE)
CORNERS = sb.box_corners(SIDES)  # as the source has them
BLOCKS = ("first", "second")
BOX = dict(enumerate(np.diag(sb.Inertia.box(MASS, SIDES / SCALE).matrix).tolist(), start=1))  # kg m^2, homogeneous
STIFFNESS = 2.5e5  # N/m, of a corner
FOUND = {  # of the first block, and alike of the second; moments of inertia and viscosity from flights between impacts
    "first_table_friction": 0.2,
    "first_table_contact_dissipation": 0.33,  # s/m
    "rounding": 3e-4,  # m
    "hinge_viscosity": 4e-4,  # N m s
    "hinge_tilt_stiffness": 85.0,  # N m/rad
    "hinge_tilt_damping": 0.06,  # N m s/rad
    **{f"first_inertia_{k}": ratio * BOX[k] for k, ratio in zip(BOX, (1.44, 1.20, 1.33), strict=True)},
}


@dataclass(frozen=True)
class Toss(Flight):
    """From where the blocks fly freely until they rest.

    Attributes:
        free: frames of free flight.
        recorded_up: z of the recording, in the axes of the poses here.
    """

    free: int
    recorded_up: np.ndarray


def tosses(folder: Path | None = None) -> list[Toss]:
    """All of them, in the order of the source: the ones that are shipped, or those of a folder."""
    data = np.load(DATA) if folder is None else read_and_cut(folder)[1]
    x, q, angles = (data[key].astype(float) for key in ("positions", "quaternions", "angles"))
    ends = zip(data["starts"][:-1], data["starts"][1:], data["toss"], data["free"], leaning_of(data), strict=True)
    return [
        Toss(
            name=f"toss {n}",
            times=np.arange(b - a) / RATE,
            positions=(poses := leveled(leans, x[a:b], q[a:b]))[0],
            quaternions=poses[1],
            angles=angles[a:b],
            free=int(free),
            recorded_up=level(leans)[:, 2],
        )
        for a, b, n, free, leans in ends
    ]


def scene_of(toss: Toss, height: float = 0.0) -> sb.Scene:
    """The blocks that fly from their first frames onto the table. `rounding` is the radius of their corners, m, and
    `stretch` what lengths are longer than SCALE makes them."""
    start = start_of(toss, toss.free, DOWN)
    scene = sb.Scene(toss.name, gravity=DOWN)
    box, at, frame = sb.Inertia.box(MASS, SIDES / SCALE), start.body["at"], start.body["rotation"]
    centers, turned = second_block(at[None], frame[None], np.array([start.angle]))
    first = scene.add_body("first", of=box, **start.body)
    second = scene.add_body("second", of=box, at=centers[0], rotation=turned[0])
    sb.hinge(
        first,
        second,
        at=at + frame @ HINGE,
        axis=frame @ AXIS,
        rate=start.rate,
        viscosity=1e-4,
        tilt_stiffness=FOUND["hinge_tilt_stiffness"],
        tilt_damping=FOUND["hinge_tilt_damping"],
    )
    table = sb.Plane(name="table", point=(0.0, 0.0, height))
    for body in (first, second):
        name = f"{body.name}_table"
        scene.add_contact(body, table, friction=0.2, stiffness=STIFFNESS, dissipation=2.0, points=TOUCHING, name=name)
    scene.add_quantity("rounding", 0.0, "m", positive=False, scale=2e-3, limits=(0.0, 0.02))
    scene.add_quantity("stretch", 0.0, "", positive=False, scale=0.01)
    axes = np.arange(4 * 2 * len(TOUCHING)).reshape(-1, 4)[:, 1:].ravel()  # of the weights of the corners' nodes
    corners = np.tile(TOUCHING.ravel(), 2)
    rounding, stretch = (("rounding", "identity"),), (("stretch", "identity"),)
    scene.add_terms(
        [
            Term("contact_weight", axes, -np.sign(corners), rounding),
            Term("contact_radius", np.arange(2), 1.0, rounding),
            Term("contact_weight", axes, corners, stretch),
            Term("gravity", 2, DOWN[2], stretch),
        ]
    )
    return scene


def other(name: str) -> str:
    return name.replace("first", "second")


def of_both(values: Mapping[str, float]) -> dict[str, float]:
    """With the second block's numbers, which are those of the first."""
    return {**values, **{other(name): value for name, value in values.items()}}


def poses(toss: Toss, values: Mapping[str, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Predicted places (frames, 3) and attitudes (frames, 3, 3) of both blocks."""
    scene = scene_of(toss)
    motion = sb.simulate(scene, toss.times, SOLVER, values)
    return [scene.bodies[block].pose(motion, values) for block in BLOCKS]


def shift(toss: Toss, rest: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """How far blocks that rest so are to be moved up to lie as recordings do: at rest the lowest corner is at z = 0."""
    low = min(((x[-1] + CORNERS @ frames[-1].T) @ toss.recorded_up).min() for x, frames in rest)
    return -float(low) / float(toss.recorded_up[2])


def predicted(toss: Toss, values: Mapping[str, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The same on a table as high as the recordings have it. That height follows from where the blocks rest, so a first
    prediction finds it, on a table below where they would be if nothing stopped them."""
    end = without_table(toss)[-1]
    up = toss.recorded_up
    height = -float(up[:2] @ end[:2] / up[2])
    first = poses(toss, {**values, "table_z": height})
    return poses(toss, {**values, "table_z": height + shift(toss, first)})


def centers_apart(toss: Toss, found: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(2, frames) mm, of the blocks' predicted centers from the recorded ones."""
    seen = np.stack([toss.positions, toss.second()[0]])
    return 1e3 * np.linalg.norm(np.stack([places for places, _ in found]) - seen, axis=2)


def errors(toss: Toss, values: Mapping[str, float]) -> np.ndarray:
    """Of a prediction, means of both blocks: of their centers in mm, mean over time and at rest, and of their attitudes
    in degrees, likewise."""
    found = predicted(toss, values)
    apart = centers_apart(toss, found)
    seen = np.stack([matrices_of(toss.quaternions), toss.second()[1]])
    cosine = (np.einsum("bfij,bfij->bf", np.stack([axes for _, axes in found]), seen) - 1.0) / 2.0
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.array([apart.mean(), apart[:, -1].mean(), angle.mean(), angle[:, -1].mean()])


def without_table(toss: Toss) -> np.ndarray:
    """Where the middle goes on as it flew until it is as low as it rests, and stays: (frames, 3) m."""
    start = start_of(toss, toss.free, DOWN)
    along = start.middle + np.outer(toss.times, start.velocity) + 0.5 * np.outer(toss.times**2, DOWN)
    low = along @ toss.recorded_up < SIDES[2] / 2 / SCALE
    stops = int(low.argmax()) if low.any() else len(along) - 1
    along[stops:] = along[stops]
    return along


def without_physics(toss: Toss) -> np.ndarray:
    """The error of the middle, where it lies still from the last frame of free flight, and where it goes on as it flew
    until it is as low as it rests: two rows."""
    x, along = toss.middle(), without_table(toss)
    still = x.copy()
    still[toss.free :] = x[toss.free - 1]
    return np.array([[a.mean(), a[-1]] for a in (1e3 * np.linalg.norm(way - x, axis=1) for way in (still, along))])


def report(label: str, group: list[Toss], values: Mapping[str, float]) -> None:
    if not group:
        print(f"{label}: none")
        return
    found = np.array([errors(toss, values) for toss in group])
    mean, middle = found.mean(axis=0), np.median(found, axis=0)
    print(
        f"{label}, {len(group)} tosses: centers {mean[0]:.0f} mm over time (median {middle[0]:.0f}), {mean[1]:.0f} at "
        f"rest ({middle[1]:.0f}); attitudes {mean[2]:.0f} degrees ({middle[2]:.0f}), {mean[3]:.0f} at rest "
        f"({middle[3]:.0f})",
        flush=True,
    )


def halves() -> tuple[list[Toss], list[Toss]]:
    """The tosses that numbers are found from, and those that are predicted."""
    every = tosses()
    return every[::2], every[1::2]


def main(folder: Path | None) -> None:
    more = [] if folder is None else tosses(folder)
    seen, rest = halves()
    values = of_both(FOUND)
    report("the half that the numbers are from", seen, values)
    report("others", rest, values)
    report(f"others with {FEWEST} frames of free flight or more", [t for t in rest if t.free >= FEWEST], values)
    plain = np.mean([without_physics(toss) for toss in rest], axis=0)
    guesses = ("lie where they were seen last", "fly on until they are as low as they rest")
    for label, row in zip(guesses, plain, strict=True):
        print(f"others without physics, {label}: {row[0]:.0f} mm over time, {row[1]:.0f} at rest")
    if more:
        held_out = [toss for toss in more if not again(toss.positions, [own.positions for own in seen])]
        print(f"{folder}: {len(more)} landings, {len(held_out)} that numbers are not from")
        flown = [toss for toss in held_out if toss.free >= FEWEST]
        report(f"others of {folder}", held_out, values)
        report(f"others of {folder} with {FEWEST} frames of free flight or more", flown, values)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--others", type=Path, metavar="FOLDER", help="more tosses of these blocks to predict")
    main(parser.parse_args().others)
