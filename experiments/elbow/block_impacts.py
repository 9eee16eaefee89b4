"""What first impacts of two tossed blocks on a hinge tell of the hinge: errors of predictions some frames after an
impact on one corner, with an axis of the hinge that is rigid and with ones that give way.

    python experiments/elbow/block_impacts.py

Looks at those of the tosses that numbers are from whose first impact is on one corner. Takes half a minute of processor
time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from block_landings import FOUND, TOUCHING, Toss, centers_apart, halves, of_both, poses
from sheetbend.arrays.rotations import matrices_of

LOW, ALONE = 0.01, 0.003  # m: height below which a corner turns, by which it is lower than all others
LATER = (3, 6, 10, 15)  # frames after the one in which it turns
INERTIA = 2.6e-4  # kg m^2, of two blocks that lean against each other about the middle of their hinge
RATIO = 0.3  # of the damping of the axis to the critical one
STIFFNESSES = (1e6, 200.0, 100.0, 50.0)  # N m/rad of the axis; the first is rigid
FRICTIONS = (0.15, 0.3)


def heights(toss: Toss) -> np.ndarray:
    """(frames, 16) m, of all corners in the recording."""
    seen = (toss.positions, matrices_of(toss.quaternions)), toss.second()
    corners = [x[:, None] + np.einsum("fab,kb->fka", frames, TOUCHING) for x, frames in seen]
    return np.concatenate(corners, axis=1)[..., 2]


def first_touch(toss: Toss) -> int | None:
    """The frame in which the lowest corner turns first, where no other corner is near the table then."""
    z = heights(toss)
    z -= z[-1].min()
    low = z.min(axis=1)
    turns = 1 + np.flatnonzero((low[1:-1] < LOW) & (low[2:] > low[1:-1]))
    turn = int(turns[turns >= toss.free - 1][0])
    lowest = np.sort(z[turn])
    return turn if lowest[1] - lowest[0] > ALONE else None


def errors_after(toss: Toss, turn: int, values: dict[str, float]) -> np.ndarray:
    """mm, mean of both centers, LATER frames after the touch."""
    end = slice(0, turn + LATER[-1] + 1)
    kept = {name: getattr(toss, name)[end] for name in ("times", "positions", "quaternions", "angles")}
    part = replace(toss, **kept)
    found = poses(part, {**of_both(values), "table_z": float(heights(toss)[-1].min())})
    return np.asarray(centers_apart(part, found).mean(axis=0)[[turn + k for k in LATER]])


def main() -> None:
    hit = [(toss, turn) for toss in halves()[0] if (turn := first_touch(toss)) is not None]
    print(f"{len(hit)} first impacts on one corner; errors of the centers {LATER} frames later, medians")
    for friction in FRICTIONS:
        for stiffness in STIFFNESSES:
            damping = 2.0 * RATIO * np.sqrt(stiffness * INERTIA)
            own = {"hinge_tilt_stiffness": stiffness, "hinge_tilt_damping": damping, "first_table_friction": friction}
            off = np.array([errors_after(toss, turn, {**FOUND, **own}) for toss, turn in hit])
            medians = ", ".join(f"{a:.1f}" for a in np.median(off, axis=0))
            print(f"axis of {stiffness:g} N m/rad, friction {friction}: {medians} mm", flush=True)


if __name__ == "__main__":
    main()
