"""Where a tossed cube comes to rest: its contact with the table from 30 tosses, and 33 others predicted.

    python experiments/tosses/landings.py [--fit 30] [--others FOLDER]

The cube is a rigid body with rounded corners, which touch the table. A fit to the first frames after contact of every
other toss finds friction, the dissipation of the contact, the rounding, the moments of inertia, the center of mass, the
height of the table and the scale of lengths. Friction and dissipation are found again from the whole paths. The other
tosses are predicted from their frames before contact, beside the numbers that the authors of the data state, and beside
predictions without physics. FOLDER holds more tosses of this cube in a cube_tosses.npz as the source's
(`make_data.py`), which are predicted too.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from cube import MASS, SIDE
from cutting import RATE, read_and_cut
from scipy.optimize import minimize
from sheetbend.arrays.rotations import matrices_of
from sheetbend.quantities.quantities import Term
from toss_files import again

DATA = Path(__file__).parent / "data" / "tosses.npz"
SCALE = 1.0176  # of the data's lengths, from free flight
CENTER = np.array([3e-4, 5e-4, 5.2e-3])  # m, of mass, from free flight
SEEN = 8  # frames that a prediction starts from
FEWEST = 4  # frames before contact of a toss of another folder
AFTER = (2, 4, 6)  # frames from the first contact on that the fits see, one after the other
SOLVER = sb.Solver(h=1 / (16 * RATE), method="implicit")
CORNERS = sb.box_corners(np.full(3, SIDE / SCALE))
COMPARED = CORNERS[[0, 3, 5, 6]]  # a tetrahedron
INERTIA = MASS * (SIDE / SCALE) ** 2 / 6  # kg m^2, of a homogeneous cube
STIFFNESS = 6e4  # N/m, of a corner
SIGMA = 1e-3  # m, of a corner: what the model may be off by
STEPS = {"table_friction": 0.01, "table_contact_dissipation": 1.0}  # with which those of whole paths are looked for
FROM = {  # where the fit starts
    "table_friction": 0.2,
    "table_contact_dissipation": 2.0,
    "rounding": 2e-3,
    **{f"cube_inertia_{axis}": 1.3 * INERTIA for axis in (1, 2, 3)},
    **{f"cube_center_{axis}": 0.0 for axis in "xyz"},
    "table_z": 0.0,
    "stretch": 0.0,
}
SIZES = {"table_z": 1e-3, "stretch": 0.01, **{f"cube_center_{axis}": 1e-3 for axis in "xyz"}}
AUTHORS = {"table_friction": 0.18, "table_restitution": 0.125, "rounding": 0.0}  # and a homogeneous cube


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


def tosses(folder: Path | None = None) -> list[Toss]:
    """All of them, in the order of the source: the ones that are shipped, or those of a folder."""
    data = np.load(DATA) if folder is None else read_and_cut(folder)[1]
    x, q = (data[key].astype(float) for key in ("positions", "quaternions"))
    ends = zip(data["starts"][:-1], data["starts"][1:], data["toss"], data["free"], strict=True)
    return [Toss(f"toss {toss}", x[a:b], q[a:b], int(free)) for a, b, toss, free in ends]


def start_of(toss: Toss, seen: int, down: np.ndarray, center: np.ndarray) -> dict[str, np.ndarray]:
    """The state that the cube starts with. Its center of mass (3,) m flies along a parabola, and not its middle."""
    first = slice(0, min(seen, toss.free))
    flown = toss.positions[first] + matrices_of(toss.quaternions[first]) @ center
    start = sb.start_of_poses(toss.times[first], flown, toss.quaternions[first], down)
    arm = start["rotation"] @ center
    return {**start, "at": start["at"] - arm, "velocity": start["velocity"] - np.cross(start["spin"], arm)}


def scene_of(toss: Toss, seen: int, restitution: float | None = None) -> sb.Scene:
    """The cube that flies from its first `seen` frames onto the table, which is soft, or rigid with a restitution (the
    authors' model, whose center of mass is the middle).

    `rounding` is the radius of its corners, m. `stretch` is what its lengths are longer than SCALE makes them, and
    gravity with them.
    """
    down = np.array([0.0, 0.0, -9.81 / SCALE])
    start = start_of(toss, seen, down, CENTER if restitution is None else np.zeros(3))
    scene = sb.Scene(toss.name, gravity=down)
    cube = scene.add_body("cube", of=sb.Inertia.box(MASS, np.full(3, SIDE / SCALE)), **start)
    soft = {"stiffness": STIFFNESS, "dissipation": FROM["table_contact_dissipation"]}
    law = soft if restitution is None else {"restitution": restitution}
    friction = AUTHORS["table_friction"]
    scene.add_contact(cube, sb.Plane(name="table"), friction=friction, points=CORNERS, settle=True, **law)
    scene.add_quantity("rounding", 0.0, "m", positive=False, scale=2e-3, limits=(0.0, 0.02))
    scene.add_quantity("stretch", 0.0, "", positive=False, scale=0.01)
    axes = np.arange(4 * len(CORNERS)).reshape(-1, 4)[:, 1:].ravel()  # of the weights of the corners' nodes
    rounding, stretch = (("rounding", "identity"),), (("stretch", "identity"),)
    scene.add_terms(
        [
            Term("contact_weight", axes, -np.sign(CORNERS).ravel(), rounding),
            Term("contact_radius", 0, 1.0, rounding),
            Term("contact_weight", axes, CORNERS.ravel(), stretch),
            Term("gravity", 2, down[2], stretch),
        ]
    )
    return scene


def experiment(toss: Toss, after: int) -> sb.Experiment:
    """A toss up to `after` frames from its first contact on."""
    scene, until = scene_of(toss, toss.free), min(toss.free + after, len(toss.times))
    poses = toss.times[:until], toss.positions[:until], toss.quaternions[:until]
    return sb.Experiment(
        scene=scene,
        recording=sb.Recording.from_poses(*poses, COMPARED, name=toss.name.replace(" ", "_")),
        markers=sb.on_body(scene.bodies["cube"], COMPARED),
        solver=SOLVER,
        sigma=SIGMA,
        loss="soft_l1",
        loss_scale=2.0,
    )


def fitted(group: list[Toss]) -> sb.Fit:
    """The numbers that all tosses share. Where each begins is given by its poses before contact.

    The cost of more frames has more kinks, at which a search may end, so fits to fewer frames go first.
    """
    values: Mapping[str, float] = FROM
    for after in AFTER:
        seen = [experiment(toss, after) for toss in group]
        free = [sb.Parameter(name=name, initial=values[name], scale=SIZES.get(name)) for name in FROM]
        fit = sb.fit(seen, parameters=free, windows=[], tolerance=1e-6, refine=False, profiles=False)
        values = fit.values
    return fit


def of_whole_paths(group: list[Toss], values: Mapping[str, float]) -> dict[str, float]:
    """The values with the friction and the dissipation that predict whole paths best: the score is the mean error of
    the center over time plus a third of that at rest."""
    scenes = [scene_of(toss, toss.free) for toss in group]

    def with_them(steps: np.ndarray) -> dict[str, float]:
        return {**values, **{name: values[name] + step * STEPS[name] for name, step in zip(STEPS, steps, strict=True)}}

    def score(steps: np.ndarray) -> float:
        found = np.array([errors(toss, with_them(steps), scene) for toss, scene in zip(group, scenes, strict=True)])
        return float(found[:, 0].mean() + found[:, 1].mean() / 3.0)

    around = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]])
    options = {"initial_simplex": around, "xatol": 0.05, "fatol": 0.02}
    return with_them(minimize(score, around[0], method="Nelder-Mead", options=options).x)


def errors(toss: Toss, values: Mapping[str, float], scene: sb.Scene) -> np.ndarray:
    """Of a prediction: of the center in mm, mean over time and at rest, and of the attitude in degrees, likewise."""
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


def report(label: str, group: list[Toss], values: Mapping[str, float], seen: int | None = None) -> None:
    scenes = [scene_of(toss, seen or toss.free, values.get("table_restitution")) for toss in group]
    found = np.array([errors(toss, values, scene) for toss, scene in zip(group, scenes, strict=True)])
    mean, middle = found.mean(axis=0), np.median(found, axis=0)
    frames = "all frames before contact" if seen is None else f"the first {seen} frames"
    print(
        f"{label}, from {frames}: center {mean[0]:.1f} mm over time (median {middle[0]:.1f}), {mean[1]:.1f} at rest "
        f"({middle[1]:.1f}); attitude {mean[2]:.0f} degrees ({middle[2]:.0f}), {mean[3]:.0f} at rest ({middle[3]:.0f})",
        flush=True,
    )


def main(count: int, folder: Path | None) -> None:
    every, more = tosses(), [] if folder is None else tosses(folder)
    data = every[::2][:count]
    rest = [toss for toss in every if toss not in data]
    fit = fitted(data)
    print(fit.report())
    impact = {name: fit.values[name] for name in FROM}
    ratios = ", ".join(f"{impact[f'cube_inertia_{axis}'] / INERTIA:.3f}" for axis in (1, 2, 3))
    print(f"moments of inertia over those of a homogeneous cube: {ratios} (of a thin shell 1.667)")
    found = of_whole_paths(data, impact)
    print("of whole paths: " + ", ".join(f"{name} {found[name]:.4g}" for name in STEPS))
    report(f"fitted, the {len(data)} tosses of the fit", data, found)
    for seen in (None, SEEN):
        report(f"fitted, {len(rest)} others", rest, found, seen)
        report(f"authors, {len(rest)} others", rest, AUTHORS, seen)
    report(f"fitted to the first {AFTER[-1]} frames after contact alone, {len(rest)} others", rest, impact)
    new = [toss for toss in more if not again(toss.positions, [own.positions for own in data])]
    held_out = [toss for toss in new if toss.free >= FEWEST]
    if more:
        print(
            f"{folder}: {len(more)} landings, {len(new)} that were not fitted, {len(held_out)} of them with {FEWEST} "
            "frames before contact"
        )
    if held_out:
        for seen in (None, SEEN):
            report(f"fitted, {len(held_out)} of {folder}", held_out, found, seen)
        report(f"authors, {len(held_out)} of {folder}", held_out, AUTHORS)
    plain = np.mean([without_physics(toss) for toss in rest], axis=0)
    guesses = ("lies where it was seen last", "flies on until it is as low as it rests")
    for label, row in zip(guesses, plain, strict=True):
        print(f"without physics, {label}: {row[0]:.0f} mm over time, {row[1]:.0f} at rest")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, default=30, help="how many tosses are fitted")
    parser.add_argument("--others", type=Path, metavar="FOLDER", help="more tosses of this cube to predict")
    given = parser.parse_args()
    main(given.fit, given.others)
