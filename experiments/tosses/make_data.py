"""Cut the tosses of a cube where the hand has let go, and the free flights out of them.

    python experiments/tosses/make_data.py FOLDER

FOLDER holds cube_tosses.npz and its LICENSE.source (DAIRLab/contact-nets, every ninth toss). A flight ends with the
last frame in which every corner is 4 mm or more above the table. It begins when the hand has let go: from then on the
angular speed stays within 6 % of its median over the second half. A toss goes on from there until the cube rests.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
from sheetbend.arrays.rotations import matrices_of

HALF = 0.0524  # m, of a side, as the source states
ABOVE = 0.004  # m
STEADY = 0.06
FEWEST = 9  # frames
DATA = Path(__file__).parent / "data"


def in_hand(quaternions: np.ndarray) -> int:
    """How many frames, of quaternions (frames, 4), the angular speed takes to become steady."""
    cosines = np.abs((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    speed = np.arccos(np.clip(cosines, 0.0, 1.0))
    usual = np.median(speed[len(speed) // 2 :])
    smooth = np.convolve(np.pad(speed, 1, mode="edge"), np.ones(3) / 3.0, mode="valid")
    off = np.flatnonzero(np.abs(smooth / usual - 1.0) > STEADY)
    return int(off[-1]) + 2 if len(off) else 0


def main(folder: Path, to: Path) -> None:
    source = np.load(folder / "cube_tosses.npz")
    told = json.loads((folder / "cube_tosses.json").read_text())
    corners = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    turns = source["quaternion"][:, [1, 2, 3, 0]]
    lowest = (source["position"][:, None] + np.einsum("fab,kb->fka", matrices_of(turns), corners))[..., 2].min(axis=1)
    starts = source["starts"]
    kept, numbers, flights = [], [], [0]
    whole, tosses, free = [], [0], []
    for number, (first, last) in zip(source["toss"], pairwise(starts), strict=True):
        low = lowest[first:last] < ABOVE
        frames = int(low.argmax()) if low.any() else last - first
        held = in_hand(turns[first : first + frames])
        first, frames = first + held, frames - held
        whole.append(np.arange(first, last))
        tosses.append(tosses[-1] + last - first)
        free.append(frames)
        if frames >= FEWEST:
            kept.append(np.arange(first, first + frames))
            numbers.append(number)
            flights.append(flights[-1] + frames)
    which = np.concatenate(kept)
    to.mkdir(exist_ok=True)
    arrays = {"starts": np.array(flights), "toss": np.array(numbers)}
    np.savez_compressed(to / "flights.npz", **arrays, positions=source["position"][which], quaternions=turns[which])
    every = np.concatenate(whole)
    np.savez_compressed(
        to / "tosses.npz",
        starts=np.array(tosses),
        toss=source["toss"],
        free=np.array(free),
        positions=source["position"][every].astype(np.float32),
        quaternions=turns[every].astype(np.float32),
    )
    about = {
        "what": "a tossed acrylic cube, motion capture: flights.npz has the frames before the first contact, "
        "tosses.npz all frames until it rests, in single precision",
        "rate_hz": told["rate_hz"],
        "keys": {
            "starts": "first frame of each flight or toss, and the end",
            "toss": "number of the toss in the source",
            "free": "of tosses: how many frames there are before the first contact",
            "positions": "m, center, in a unit that is about 2 % short",
            "quaternions": "(x, y, z, w), from the cube's axes to the world's",
        },
        "known": {key: told["known"][key] for key in ("mass_kg", "side_m")},
        "source": told["source"],
        "licence": told["licence"],
        "attribution": told["attribution"],
    }
    for name in ("flights.json", "tosses.json"):
        (to / name).write_text(json.dumps(about, indent=1) + "\n")
    shutil.copyfile(folder / "LICENSE.source", to / "LICENSE.source")
    print(f"{len(numbers)} flights, {flights[-1]} frames")


def cut(source: Path | None) -> Path:
    """The folder of tosses that are cut already: the shipped ones, or a temporary one of those of another source."""
    if source is None:
        return DATA
    folder = Path(tempfile.mkdtemp())
    main(source, folder)
    return folder


if __name__ == "__main__":
    main(Path(sys.argv[1]), DATA)
