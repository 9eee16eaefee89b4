"""Makes sheetbend_bench/reference.json: the reference gradients of the workloads, by complex step in plain.cpp.

Run: python experiments/bench/make_reference.py
"""

from __future__ import annotations

import json
import tempfile
from importlib.resources import files
from pathlib import Path

import plain
from sheetbend_bench import WORKLOADS

ABOUT = (
    "Loss gradients of the benchmark workloads by stretch compliance, bend compliance, mass and along the direction "
    "of the start, per checked scene: complex step (1e-40) by experiments/bench/plain.cpp, without contraction."
)


def main() -> None:
    gradients: dict[str, dict[str, list[float]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        program = plain.build(Path(folder), "-ffp-contract=off")
        for w in WORKLOADS.values():
            scene_of = "W1" if w.scenes > 1 else w.name
            gradients[w.name] = {
                str(k): plain.run(program, scene_of, "--reference", *map(repr, w.parameters[k].tolist()))["gradient"]
                for k in w.checked
            }
            print(w.name, gradients[w.name]["0"], flush=True)
    text = json.dumps({"about": ABOUT, "gradients": gradients}, indent=2)
    files("sheetbend_bench").joinpath("reference.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
