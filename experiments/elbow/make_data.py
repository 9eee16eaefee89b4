"""Cut the free flights out of the recorded tosses of two blocks on a hinge, and the tosses from there until they rest.

    python experiments/elbow/make_data.py FOLDER

FOLDER holds elbow_tosses.npz and its LICENSE.source (DAIRLab/dair_pll, every ninth toss). A flight is the longest part
of a toss in which nothing but gravity accelerates the center of mass: second differences of the middle between the
blocks are within 6 m/s^2 of gravity, and every corner is 16 mm or more above the table. A toss begins with its flight;
where that has fewer than five frames, with the five in which these differences are smallest.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
from blocks import DATA, RATE, SIDES, second_block
from sheetbend.arrays.rotations import matrices_of

ABOVE = 0.016  # m
FREE = 6.0  # m/s^2
GRAVITY = np.array([0.0, 0.0, -9.63])  # m/s^2, in the unit of the recording
FEWEST = 11  # frames of a flight
LEAST = 5  # of the beginning of a toss


def free(x: np.ndarray, frames: np.ndarray, angles: np.ndarray) -> slice:
    """The frames of one toss that are a flight."""
    corners = SIDES / 2 * np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    centers, turned = second_block(x, frames, angles)
    both = [o[:, None] + np.einsum("fab,kb->fka", R, corners) for o, R in ((x, frames), (centers, turned))]
    low = np.concatenate(both, axis=1)[..., 2].min(axis=1) < ABOVE
    end = int(low.argmax()) if low.any() else len(x)
    pull = np.linalg.norm(np.diff((x + centers)[:end] / 2, 2, axis=0) * RATE**2 - GRAVITY, axis=1)
    edges = [-1, *np.flatnonzero(pull > FREE), len(pull)]
    first, last = max(pairwise(edges), key=lambda pair: pair[1] - pair[0])
    found = slice(first + 1, last + 2)  # a second difference takes a frame on either side
    if found.stop - found.start >= LEAST:
        return found
    quietest = int(np.convolve(pull**2, np.ones(LEAST - 2), "valid").argmin())
    return slice(quietest, quietest + LEAST)


def main(folder: Path, to: Path) -> None:
    source = np.load(folder / "elbow_tosses.npz")
    told = json.loads((folder / "elbow_tosses.json").read_text())
    x, angles, turns = source["position"], source["angle"], source["quaternion"][:, [1, 2, 3, 0]]
    frames = matrices_of(turns)
    kept, numbers, starts = [], [], [0]
    whole, tosses, flown = [], [0], []
    for number, (first, last) in zip(source["toss"], pairwise(source["starts"]), strict=True):
        part = free(x[first:last], frames[first:last], angles[first:last])
        whole.append(np.arange(first + part.start, last))
        tosses.append(tosses[-1] + len(whole[-1]))
        flown.append(part.stop - part.start)
        if flown[-1] >= FEWEST:
            kept.append(np.arange(first + part.start, first + part.stop))
            numbers.append(number)
            starts.append(starts[-1] + len(kept[-1]))
    which = np.concatenate(kept)
    to.mkdir(exist_ok=True)
    arrays = {"positions": x[which], "quaternions": turns[which], "angles": angles[which]}
    np.savez_compressed(to / "flights.npz", starts=np.array(starts), toss=np.array(numbers), **arrays)
    every = np.concatenate(whole)
    turning = [np.unwrap(angles[own]) for own in whole]
    np.savez_compressed(
        to / "tosses.npz",
        starts=np.array(tosses),
        toss=source["toss"],
        free=np.array(flown),
        positions=x[every].astype(np.float32),
        quaternions=turns[every].astype(np.float32),
        angles=np.concatenate(turning).astype(np.float32),
    )
    about = {
        "what": "two blocks on a hinge, tossed, motion capture: flights.npz has the frames between the hand and the "
        "table, tosses.npz those from there until the blocks rest, in single precision",
        "rate_hz": told["rate_hz"],
        "keys": {
            "starts": "first frame of each flight or toss, and the end",
            "toss": "number of the toss in the source",
            "free": "of tosses: how many frames are free flight",
            "positions": "m, center of the first block, in a unit that is about 2 % short",
            "quaternions": "(x, y, z, w), from the first block's axes to the world's",
            "angles": "rad, of the hinge about the first block's y axis",
        },
        "known": told["known"],
        "source": told["source"],
        "licence": told["licence"],
        "attribution": told["attribution"],
    }
    for name in ("flights.json", "tosses.json"):
        (to / name).write_text(json.dumps(about, indent=1) + "\n")
    shutil.copyfile(folder / "LICENSE.source", to / "LICENSE.source")
    print(f"{len(numbers)} flights, {starts[-1]} frames")


def cut(source: Path | None) -> Path:
    """The folder of tosses that are cut already: the shipped ones, or a temporary one of those of another source."""
    if source is None:
        return DATA
    folder = Path(tempfile.mkdtemp())
    main(source, folder)
    return folder


if __name__ == "__main__":
    main(Path(sys.argv[1]), DATA)
