"""Cut the tosses of a cube where the hand has let go, and the free flights out of them.

    python experiments/tosses/make_data.py FOLDER

FOLDER holds cube_tosses.npz and its LICENSE.source (DAIRLab/contact-nets, every ninth toss).
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
from cutting import cut

DATA = Path(__file__).parent / "data"


def main(folder: Path) -> None:
    flights, tosses, _ = cut(np.load(folder / "cube_tosses.npz"))
    told = json.loads((folder / "cube_tosses.json").read_text())
    DATA.mkdir(exist_ok=True)
    np.savez_compressed(DATA / "flights.npz", **flights)
    np.savez_compressed(DATA / "tosses.npz", **tosses)
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
        (DATA / name).write_text(json.dumps(about, indent=1) + "\n")
    shutil.copyfile(folder / "LICENSE.source", DATA / "LICENSE.source")
    print(f"{len(flights['toss'])} flights, {flights['starts'][-1]} frames")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
