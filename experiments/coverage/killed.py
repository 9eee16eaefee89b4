"""Thirty ropes of a population, fitted by one command that is killed in the middle and started again, then collected.

    python experiments/coverage/killed.py   # writes to out/coverage/killed

The values must have the bits of those of a run that nobody stopped, and finished fits must not be made again.
"""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import population_cases as many
import sheetbend as sb
from coverage import OUT

ROPES, KILLED_AFTER = 30, 12
CONFIG = """
[experiment]
name = "{name}"

[solver]
h = {h!r}

[[scene.rope]]
name = "rope"
length = 0.5
segments = {links}
density = 0.05
EI = {start!r}
bend_damping = 0.01
drag_linear = 5e-3
clamp_start = [1, 0, 0]
pinned = [0]

[[recording]]
file = "{name}.npz"
sigma = {sigma!r}

[parameters.rope_EI]

[fit]
halve_step = false
double_segments = false

[output]
figures = "none"
"""


def make(folder: Path) -> None:
    """Recordings and configurations."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(0)
    numbers = {"h": many.SOLVER.h, "links": many.LINKS, "start": 1.3 * many.MEDIAN, "sigma": many.SIGMA}
    for k in range(ROPES):
        scene = many.rope(many.MEDIAN * math.exp(many.SPREAD * rng.standard_normal()))
        x = sb.simulate(scene, many.TIMES, many.SOLVER).positions[:, scene.ropes["rope"].particles]
        name = f"rope_{k:02d}"
        sb.Recording(x + many.SIGMA * rng.standard_normal(x.shape), many.TIMES, name=name).save(folder / f"{name}.npz")
        (folder / f"{name}.toml").write_text(CONFIG.format(name=name, **numbers))


def command(*words: str | Path) -> list[str]:
    return [sys.executable, "-m", "sheetbend", *map(str, words)]


def results(folder: Path) -> dict[str, dict]:
    return {file.parent.name: json.loads(file.read_text())["parameters"] for file in sorted(folder.glob("*/fit.json"))}


def main() -> None:
    folder = OUT / "killed"
    shutil.rmtree(folder, ignore_errors=True)
    make(folder / "ropes")
    fit = ("fit", folder / "ropes" / "*.toml", "--output")
    with (folder / "killed.log").open("w") as log:
        process = subprocess.Popen(command(*fit, folder / "out"), stdout=log, stderr=log)
        while len(results(folder / "out")) < KILLED_AFTER:
            if process.poll() is not None:
                raise SystemExit(f"the fits ended by themselves, see {log.name}")
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        process.wait()
    made = {file: file.stat().st_mtime_ns for file in (folder / "out").glob("*/fit.json")}
    print(f"killed when {len(made)} results were there")
    again = subprocess.run(command(*fit, folder / "out"), capture_output=True, text=True, check=True)
    print(next(line for line in again.stdout.splitlines() if "configurations" in line))
    kept = sum(file.stat().st_mtime_ns == at for file, at in made.items())
    subprocess.run(command(*fit, folder / "whole"), capture_output=True, check=True)
    alike = results(folder / "out") == results(folder / "whole")
    print(f"{kept} of {len(made)} finished fits untouched; all values have the bits of a run without a kill: {alike}")
    collected = command("collect", folder / "out", "--output", folder / "all")
    print(subprocess.run(collected, capture_output=True, text=True, check=True).stdout)


if __name__ == "__main__":
    main()
