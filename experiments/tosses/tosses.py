"""What the free flights of a tossed cube tell: its length scale, its inertia, and where it will be.

    python experiments/tosses/tosses.py [--flights 62] [--source FOLDER]

Finds how fast the axes of the recordings turn, fits four groups of flights in the order of the source, compares what
gravity says of the scale in the first and the second half, and predicts every flight from its first four frames with
the gravity, the drag, the center of mass and the turn of the axes that the other half shows.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import sheetbend as sb
from cube import CORNERS, SEEN, Flight, experiment, flights, parameters, scene_of, turning
from cutting import RATE

SHARED = ["gravity", "cube_drag", *(f"cube_center_{a}" for a in "xyz"), "cube_inertia_2", "cube_inertia_3"]
GROUPS = 4


def fitted(group: list[Flight]) -> sb.FitResult:
    """The numbers that flights share, and the start of each."""
    return sb.fit([experiment(f) for f in group], parameters=parameters(SHARED), refine=False)


def pooled(values: list[tuple[float, float]]) -> tuple[float, float]:
    """Mean and 95 % half-width of independent values with theirs."""
    weights = np.array([1.0 / half**2 for _, half in values])
    return float(weights @ [v for v, _ in values] / weights.sum()), float(weights.sum() ** -0.5)


def predicted(
    flight: Flight, gravity: float, drag: float, center: Sequence[float] = (0.0, 0.0, 0.0), rate: float = 0.0
) -> tuple[float, float]:
    """Errors at a flight's last frame, m and degrees, of its prediction from the first frames: of the center of mass,
    and in axes that do not turn."""
    flight = flight.steady(rate).about(np.array(center))
    scene, body = scene_of(flight, gravity, drag)
    motion = sb.simulate(scene, [0.0, float(flight.times[-1])], sb.Solver(h=1 / (4 * RATE)))
    origin, frame = body.pose(motion)
    seen = sb.Recording.from_poses(flight.times, flight.positions, flight.quaternions, CORNERS).positions[-1]
    arms = seen - flight.positions[-1]
    u, _, vt = np.linalg.svd(arms.T @ (CORNERS @ frame[-1].T))
    angle = np.degrees(np.arccos(np.clip((np.trace(u @ vt) - 1.0) / 2.0, -1.0, 1.0)))
    return float(np.linalg.norm(origin[-1] - flight.positions[-1])), float(angle)


def main(count: int | None, folder: Path | None) -> None:
    every = flights(folder)[:count]
    if len(every) < 2 * GROUPS:
        raise SystemExit(f"{len(every)} free flights are too few for {GROUPS} groups")
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in SHARED}
    middle = len(every) // 2
    rates = [turning(half) for half in (every[:middle], every[middle:])]
    print("the axes turn about z by " + ", ".join(f"{rate:.4f} +- {half:.4f} rad/s" for rate, half in rates))
    for k in range(GROUPS):
        group = every[k * len(every) // GROUPS : (k + 1) * len(every) // GROUPS]
        result = fitted([flight.steady(rates[2 * k // GROUPS][0]) for flight in group])
        print(f"group {k + 1}: {len(group)} flights, {group[0].name} to {group[-1].name}")
        for name in SHARED:
            one = result[name]
            found[name].append((one.value, np.inf if one.half_width is None else one.half_width))
            print(f"  {name:15s} {one.value:10.4g} +- {found[name][-1][1]:8.2g}  {one.verdict}")
    for name in SHARED:
        print(f"all: {name:15s} {pooled(found[name])[0]:10.4g} +- {pooled(found[name])[1]:8.2g}")
    halves = [[pooled(found[q][part])[0] for q in SHARED[:5]] for part in (slice(0, 2), slice(2, 4))]
    scales = [9.81 / values[0] for values in halves]
    apart = abs(scales[0] / scales[1] - 1)
    print(f"scale of lengths from gravity: {scales[0]:.4f} and {scales[1]:.4f}, {apart:.2%} apart")
    errors = np.array(
        [
            predicted(f, gravity, drag, center, rate)
            for part, (gravity, drag, *center), (rate, _) in (
                (every[:middle], halves[1], rates[1]),
                (every[middle:], halves[0], rates[0]),
            )
            for f in part
        ]
    )
    for label, column, unit in (("place", 1e3 * errors[:, 0], "mm"), ("attitude", errors[:, 1], "degrees")):
        order = np.argsort(column)
        worst = every[order[-1]]
        print(
            f"{label} at the last frame, from the first {SEEN}: median {np.median(column):.2f} {unit}, "
            f"largest {column[order[-1]]:.2f} ({worst.name}, {1e3 * worst.times[-1]:.0f} ms), "
            f"then {column[order[-2]]:.2f}"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, help="how many of them; all by default")
    parser.add_argument(
        "--source", type=Path, metavar="FOLDER", help="other tosses of the source, instead of the shipped ones"
    )
    given = parser.parse_args()
    main(given.flights, given.source)
