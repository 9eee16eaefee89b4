"""Writes data/: the robot's log of poses, and what the camera sees under one seed.

    python experiments/held_cloth/make_data.py

It takes some 10 s. The same seed gives the same files.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import camera
import numpy as np

SEED = 0
FOLDER = Path(__file__).parent / "data"


def main(folder: Path = FOLDER) -> None:
    folder.mkdir(exist_ok=True)
    t, x, q = camera.poses()
    header = "time,x,y,z,qx,qy,qz,qw"
    table = np.column_stack([t, x, q])
    np.savetxt(folder / "poses.csv", table, fmt="%.6f", delimiter=",", header=header, comments="")
    replace(camera.seen(camera.truth(), SEED), name="seen").save(folder / "seen.npz")


if __name__ == "__main__":
    main()
