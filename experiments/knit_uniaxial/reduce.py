"""Reduces the recordings of the source to what this folder ships: medians of force and pins in bins of equal extension.

python experiments/knit_uniaxial/reduce.py FOLDER, which holds acrylic_yarn_<knit>_<x or y>.npz and .json.
"""

import argparse
import json
import shutil
from pathlib import Path

import numpy as np

BINS = 80
LEAST = 3  # frames of a bin
BOTTOM, TOP = 2, 3  # pins
WORDS = (
    f"the source's frames (1,300 to 6,200 per repeat) as medians of force and pins in {BINS} bins of equal extension "
    f"of the pins top and bottom, NaN in bins of fewer than {LEAST} frames; px divided by clamp_px"
)


def reduced(path):
    """Force (repeats, bins) N and pins (repeats, bins, 7, 2) in clamp widths, of the source's file or one that is
    reduced already."""
    source = np.load(path)
    if "force" in source:
        return source["force"], source["pins"]
    clamp = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["clamp_px"]
    count = sum(name.startswith("force_") for name in source)
    force, pins = np.full((count, BINS), np.nan), np.full((count, BINS, 7, 2), np.nan)
    for repeat in range(count):
        F, x = source[f"force_{repeat + 1}"], source[f"pins_px_{repeat + 1}"] / clamp
        extension = np.linalg.norm(x[:, TOP] - x[:, BOTTOM], axis=1)
        edges = np.linspace(extension.min(), extension.max(), BINS + 1)[1:-1]
        where = np.searchsorted(edges, extension)
        for k in range(BINS):
            inside = where == k
            if inside.sum() >= LEAST:
                force[repeat, k], pins[repeat, k] = np.median(F[inside]), np.median(x[inside], axis=0)
    return force.astype(np.float32), pins.astype(np.float32)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder, data = parser.parse_args().folder, Path(__file__).parent / "data"
    shutil.copyfile(folder / "LICENSE.source", data / "LICENSE.source")
    for path in sorted(folder.glob("acrylic_yarn_*.npz")):
        name = path.stem.removeprefix("acrylic_yarn_")
        force, pins = reduced(path)
        np.savez_compressed(data / f"{name}.npz", force=force, pins=pins)
        told = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        for key in ("arrays", "fields", "missing"):
            told.pop(key)
        told |= {"fields": "force (5, bins) N; pins (5, bins, 7, 2) clamp widths, x right, y down", "reduced": WORDS}
        (data / f"{name}.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
