"""Cut the free flights out of the recorded tosses of two blocks on a hinge, and the tosses from there until they rest.

    python experiments/elbow/make_data.py FOLDER

FOLDER holds elbow_tosses.npz, elbow_tosses.json and LICENSE.source (DAIRLab/dair_pll, every ninth toss).
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
from block_cutting import cut

DATA = Path(__file__).parent / "data"


def main(folder: Path) -> None:
    flights, tosses, _ = cut(np.load(folder / "elbow_tosses.npz"))
    told = json.loads((folder / "elbow_tosses.json").read_text())
    DATA.mkdir(exist_ok=True)
    np.savez_compressed(DATA / "flights.npz", **flights)
    np.savez_compressed(DATA / "tosses.npz", **tosses)
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
        (DATA / name).write_text(json.dumps(about, indent=1) + "\n")
    shutil.copyfile(folder / "LICENSE.source", DATA / "LICENSE.source")
    print(f"{len(flights['toss'])} flights, {flights['starts'][-1]} frames")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
