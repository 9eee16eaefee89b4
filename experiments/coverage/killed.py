"""A thousand ropes of 20 populations, fitted by one command that is killed once and started again, then collected.

    python experiments/coverage/killed.py                   # writes to out/coverage/killed
    python experiments/coverage/killed.py --populations 1   # 50 ropes

Finished fits must not be made again, and in the population at which the command was killed all values must have the
bits of a run that nobody stopped. Each population is collected by itself; its intervals of the mean and of the spread
should contain the true values.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
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


def make(folder: Path, populations: int) -> None:
    """Recordings and configurations of all ropes."""
    folder.mkdir(parents=True)
    numbers = {"h": many.SOLVER.h, "links": many.LINKS, "start": 1.3 * many.MEDIAN, "sigma": many.SIGMA}
    for p in range(populations):
        rng = np.random.default_rng(p)
        for k in range(many.SPECIMENS):
            scene = many.rope(many.MEDIAN * math.exp(many.SPREAD * rng.standard_normal()))
            x = sb.simulate(scene, many.TIMES, many.SOLVER).positions[:, scene.ropes["rope"].particles]
            name = f"{_population(p)}_rope_{k:02d}"
            noisy = x + many.SIGMA * rng.standard_normal(x.shape)
            sb.Recording(noisy, many.TIMES, name=name).save(folder / f"{name}.npz")
            (folder / f"{name}.toml").write_text(CONFIG.format(name=name, **numbers))


def _population(p: int) -> str:
    return f"population_{p:02d}"


def command(*words: str | Path) -> list[str]:
    return [sys.executable, "-m", "sheetbend", *map(str, words)]


def results(folder: Path) -> dict[str, dict]:
    return {file.parent.name: json.loads(file.read_text())["parameters"] for file in sorted(folder.glob("*/fit.json"))}


def kill_in_the_middle(words: list[str], out: Path, results_there: int, log: Path) -> dict[Path, int]:
    """Start the fits and end them by SIGKILL when so many results exist; the results, and when they were made."""
    with log.open("w") as file:
        process = subprocess.Popen(words, stdout=file, stderr=file)
        while len(list(out.glob("*/fit.json"))) < results_there:
            if process.poll() is not None:
                raise SystemExit(f"the fits ended by themselves, see {log}")
            time.sleep(0.2)
        process.send_signal(signal.SIGKILL)
        process.wait()
    return {file: file.stat().st_mtime_ns for file in out.glob("*/fit.json")}


def unbroken(folder: Path, p: int) -> bool:
    """Whether the values of a population have the bits of a run that nobody stopped."""
    ropes = folder / "ropes" / f"{_population(p)}_*.toml"
    subprocess.run(command("fit", ropes, "--output", folder / "whole"), capture_output=True, check=True)
    whole, every = results(folder / "whole"), results(folder / "out")
    return len(whole) == many.SPECIMENS and all(every[name] == values for name, values in whole.items())


def collected(folder: Path, p: int) -> tuple[bool, bool]:
    """Whether the intervals of mean and spread that `sheetbend collect` writes hold the truth."""
    out = folder / "all" / _population(p)
    fits = sorted((folder / "out").glob(f"{_population(p)}_*"))
    subprocess.run(command("collect", *fits, "--output", out), capture_output=True, check=True)
    found = json.loads((out / "population.json").read_text())["rope_EI"]["found"]
    mean, spread = np.exp(found["mean_interval"]), found["spread_interval"]
    held = mean[0] <= many.MEDIAN <= mean[1], spread[0] <= many.SPREAD <= spread[1]
    print(f"{_population(p)}: mean {mean[0]:.5g} to {mean[1]:.5g}, spread {spread[0]:.3g} to {spread[1]:.3g}", *held)
    return held


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--populations", type=int, default=20)
    populations = parser.parse_args().populations
    folder = OUT / "killed"
    shutil.rmtree(folder, ignore_errors=True)
    make(folder / "ropes", populations)
    words = command("fit", folder / "ropes" / "*.toml", "--output", folder / "out")
    made = kill_in_the_middle(words, folder / "out", populations * many.SPECIMENS // 2, folder / "killed.log")
    print(f"killed when {len(made)} results were there")
    again = subprocess.run(words, capture_output=True, text=True, check=True)
    print(next(line for line in again.stdout.splitlines() if "configurations" in line))
    kept = sum(file.stat().st_mtime_ns == at for file, at in made.items())
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{used.ru_utime + used.ru_stime:.0f} s of processor time, at most {used.ru_maxrss / 1024:.0f} MB")
    print(f"{kept} of {len(made)} finished fits untouched; values have the bits of a run without a kill:", end=" ")
    print(unbroken(folder, min(len(made) // many.SPECIMENS, populations - 1)))
    held = np.array([collected(folder, p) for p in range(populations)])
    means, spreads = held.sum(axis=0)
    print(f"of {populations} populations the interval holds the mean in {means}, the spread in {spreads}")


if __name__ == "__main__":
    main()
