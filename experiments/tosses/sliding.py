"""How a tossed cube slides at the end, flat on the table: friction over speed, and when it begins to lie flat.

    python experiments/tosses/sliding.py

Friction is read off the recorded paths alone: a parabola through nine frames of a cube that lies flat has the
deceleration along its way. The predictions are those of `landings.py` with the values that it prints.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import sheetbend as sb
from cutting import RATE
from landings import SCALE, SOLVER, scene_of, tosses
from sheetbend.arrays.rotations import matrices_of

FOUND = {  # expected/landings.txt
    "table_friction": 0.1805,
    "table_contact_dissipation": 3.356,
    "rounding": 0.00306,
    "cube_inertia_1": 0.001059,
    "cube_inertia_2": 0.001055,
    "cube_inertia_3": 0.001022,
    "cube_center_x": -2.3e-4,
    "cube_center_y": -2e-5,
    "cube_center_z": 0.00638,
    "table_z": -2.7e-4,
    "stretch": 3e-4,
}
LEVEL = 2e-4  # that the cosine of the tilt is off 1: 1.1 degrees
HIGHER = 8e-4  # m, than at rest
WINDOW, APART = 9, 3  # frames, and from one window to the next
SPEEDS = (0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.65)  # m/s


def flat_from(x: np.ndarray, axes: np.ndarray) -> int:
    """The frame from which on a cube at x (frames, 3) m with axes (frames, 3, 3) lies flat."""
    level = np.abs(np.abs(axes[:, 2]).max(axis=1) - 1.0) < LEVEL
    lies = level & (np.abs(x[:, 2] - np.median(x[-10:, 2])) < HIGHER)
    return len(x) - int(np.argmin(np.append(lies[::-1], False)))


def sliding(x: np.ndarray) -> list[tuple[float, float]]:
    """Speed in m/s and friction in each window of a path (frames, 3) m that lies flat."""
    t = (np.arange(WINDOW) - WINDOW // 2) / RATE
    found = []
    for first in range(0, len(x) - WINDOW, APART):
        bend, v, _ = np.polyfit(t, x[first : first + WINDOW, :2], 2)
        speed = float(np.linalg.norm(v))
        found.append((speed, float(-2.0 * bend @ v / speed * SCALE / 9.81)))
    return found


def main() -> None:
    slid, late = [], []
    for toss in tosses():
        recorded = flat_from(toss.positions, matrices_of(toss.quaternions))
        slid += sliding(toss.positions[recorded:])
        scene = scene_of(toss, toss.free)
        motion = sb.simulate(scene, toss.times, SOLVER, FOUND)
        late.append((recorded - toss.free, flat_from(*scene.bodies["cube"].pose(motion, FOUND)) - toss.free))
    speed, friction = np.array(slid).T
    for low, high in pairwise(SPEEDS):
        own = friction[(speed >= low) & (speed < high)]
        error = own.std() / np.sqrt(len(own) * APART / WINDOW)  # as windows overlap
        print(f"{low:g} to {high:g} m/s: friction {own.mean():.3f} +- {error:.3f}, {len(own)} windows")
    frames = np.median(late, axis=0)
    print(f"flat {frames[0]:.0f} frames after the first contact, predicted {frames[1]:.0f} (medians)")


if __name__ == "__main__":
    main()
