"""Where the errors of `block_landings.py` come from.

    python experiments/elbow/block_budget.py [spread | time | numbers]

spread: how far apart predictions come to rest whose starts differ by the noise of the recording, which no law of
impacts can mend. time: how the error grows from the last frame of free flight on. numbers: what changed numbers do to
the mean errors. All of it is about the tosses that the numbers are from. Each takes some two minutes of processor time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from block_landings import FOUND, Toss, centers_apart, errors, halves, of_both, predicted
from sheetbend.arrays.rotations import matrices_of, quaternions_of, rotation_matrix

NOISE = (3e-5, 4e-4, 7e-4)  # m, rad, rad: of places, attitudes and angles of the hinge, from their third differences
DRAWS = 3
LATER = (0, 1, 3, 6, 10, 20, 40)  # frames after the last one of free flight
OTHERWISE = {
    "first_table_friction": (0.8, 1.25),
    "first_table_contact_dissipation": (0.7, 1.4),
    "rounding": (0.3, 2.0),
    "hinge_viscosity": (0.1, 4.0),
    "hinge_tilt_stiffness": (0.6, 1.6),
    "hinge_tilt_damping": (0.3, 3.0),
    "first_inertia": (0.9, 1.1),
}


def disturbed(toss: Toss, random: np.random.Generator) -> Toss:
    """The same toss, as another recording with the same noise would have it."""
    place, turn, angle = NOISE
    frames = matrices_of(toss.quaternions)
    turns = [rotation_matrix("noise", turn * random.standard_normal(3)) for _ in frames]
    return replace(
        toss,
        positions=toss.positions + place * random.standard_normal(toss.positions.shape),
        quaternions=quaternions_of(np.array(turns) @ frames),
        angles=toss.angles + angle * random.standard_normal(toss.angles.shape),
    )


def spread(group: list[Toss]) -> None:
    random = np.random.default_rng(0)
    values = of_both(FOUND)
    found = []
    for toss in group:
        runs = [predicted(disturbed(toss, random), values) for _ in range(DRAWS)]
        places = 1e3 * np.array([[x for x, _ in run] for run in runs])  # (draws, blocks, frames, 3)
        away = np.linalg.norm(places - places.mean(axis=0), axis=3).mean(axis=1) * np.sqrt(DRAWS / (DRAWS - 1.0))
        apart = errors(toss, values)
        found.append([away.mean(), away[:, -1].mean(), apart[0], apart[1]])
        print(
            f"{toss.name}, {toss.free} frames of flight: spread {found[-1][0]:.0f} mm over time, {found[-1][1]:.0f} at "
            f"rest; error {found[-1][2]:.0f}, {found[-1][3]:.0f}",
            flush=True,
        )
    means, middles = np.mean(found, axis=0), np.median(found, axis=0)
    print("means and medians: " + ", ".join(f"{a:.0f} ({b:.0f})" for a, b in zip(means, middles, strict=True)))


def over_time(group: list[Toss]) -> None:
    values = of_both(FOUND)
    found = []
    for toss in group:
        apart = centers_apart(toss, predicted(toss, values)).mean(axis=0)
        found.append([apart[min(toss.free - 1 + k, len(apart) - 1)] for k in LATER])
    for k, column in zip(LATER, np.transpose(found), strict=True):
        print(f"{k:2d} frames after the end of free flight: {column.mean():.1f} mm, median {np.median(column):.1f}")


def numbers(group: list[Toss]) -> None:
    def mean(values: dict[str, float]) -> np.ndarray:
        return np.mean([errors(toss, of_both(values)) for toss in group], axis=0)

    print(f"as they are: {mean(FOUND).round(1)}", flush=True)
    for name, factors in OTHERWISE.items():
        for factor in factors:
            changed = {own: value * (factor if own.startswith(name) else 1.0) for own, value in FOUND.items()}
            print(f"{name} times {factor}: {mean(changed).round(1)}", flush=True)


def main(what: str) -> None:
    ways: dict[str, Callable[[list[Toss]], None]] = {"spread": spread, "time": over_time, "numbers": numbers}
    ways[what](halves()[0])


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["time"]))
