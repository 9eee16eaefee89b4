"""What the free flights of two blocks on a hinge tell: the length scale, the hinge, and where the blocks will be.

    python experiments/elbow/elbow.py [--flights 18] [--source FOLDER]

Fits the flights in two halves, and predicts every flight from its first four frames with what the other half shows.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import sheetbend as sb
from block_cutting import read_and_cut
from blocks import OWN, RATE, SEEN, Flight, experiment, flights, parameters, scene_of
from sheetbend.arrays.rotations import matrices_of
from turning_axes import turning

SHARED = ["gravity", "hinge_viscosity", *(f"{block}_center_{a}" for block in ("first", "second") for a in "xz")]


def fitted(group: list[Flight]) -> sb.FitResult:
    """The numbers that flights share, and the start of each."""
    return sb.fit([experiment(f) for f in group], parameters=parameters(SHARED), refine=False)


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees, of two attitudes (3, 3)."""
    return float(np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1.0) / 2.0, -1.0, 1.0))))


def start_of_all(flight: Flight, gravity: float) -> dict[str, float]:
    """The start that explains all frames of a flight best: what a motion from it misses is the model's share."""
    found = sb.fit(experiment(flight, gravity=gravity), parameters=list(OWN), refine=False)
    return {name: found[name].value for name in OWN}


def predicted(flight: Flight, gravity: float, viscosity: float, start: dict[str, float] | None = None) -> list[float]:
    """Errors at a flight's last frame of its motion from the first frames, or from another start: place (m) and
    attitude (degrees) of the first block, then of the second."""
    scene, *bodies = scene_of(flight, gravity)
    times = [0.0, float(flight.times[-1])]
    values = {"hinge_viscosity": viscosity, **(start or {})}
    motion = sb.simulate(scene, times, sb.Solver(h=1 / (4 * RATE)), values=values)
    centers, turned = flight.second()
    seen = [(flight.positions[-1], matrices_of(flight.quaternions)[-1]), (centers[-1], turned[-1])]
    errors: list[float] = []
    for body, (place, frame) in zip(bodies, seen, strict=True):
        origin, found = body.pose(motion)
        errors += [float(np.linalg.norm(origin[-1] - place)), angle_between(found[-1], frame)]
    return errors


def main(count: int | None, folder: Path | None) -> None:
    given = None if folder is None else read_and_cut(folder)[0]
    every = flights(given)[:count]
    if len(every) < 2:
        raise SystemExit(f"{len(every)} free flights are too few for two halves")
    middle = (len(every) + 1) // 2
    halves = [every[:middle], every[middle:]]
    rates = [turning([(f.times, f.middle(), ()) for f in half]) for half in halves]
    print("the axes turn about z by " + ", ".join(f"{rate:.3f} +- {half:.3f} rad/s" for rate, half in rates))
    found = []
    for group, (rate, _) in zip(halves, rates, strict=True):
        result = fitted([flight.steady(rate) for flight in group])
        found.append([result[name] for name in SHARED])
        print(f"{len(group)} flights, {group[0].name} to {group[-1].name}")
        for one in found[-1]:
            half = np.inf if one.half_width is None else one.half_width
            print(f"  {one.name:15s} {one.value:10.4g} +- {half:8.2g}  {one.verdict}")
    scales = [9.81 / values[0].value for values in found]
    apart = abs(scales[0] / scales[1] - 1)
    print(f"scale of lengths from gravity: {scales[0]:.4f} and {scales[1]:.4f}, {apart:.2%} apart")
    numbers = [
        (f.steady(rate), other[0].value, other[1].value)
        for group, other, (rate, _) in zip(halves, found[::-1], rates[::-1], strict=True)
        for f in group
    ]
    predictions = [predicted(*one) for one in numbers]
    followed = [predicted(*one, start_of_all(*one[:2])) for one in numbers]
    for frames, errors in ((f"the first {SEEN}", predictions), ("a start fitted to all", followed)):
        for k, block in enumerate(("first", "second")):
            place, turn = np.array(errors)[:, 2 * k : 2 * k + 2].T
            print(
                f"{block} block at the last frame, from {frames}: median {1e3 * np.median(place):.2f} mm, "
                f"{np.median(turn):.2f} degrees; largest {1e3 * place.max():.2f} mm, {turn.max():.2f} degrees"
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, help="how many of them; all by default")
    parser.add_argument(
        "--source", type=Path, metavar="FOLDER", help="other tosses of the source, instead of the shipped ones"
    )
    given = parser.parse_args()
    main(given.flights, given.source)
