"""Contact in this package and in newton on the same scene, in one run: time, error at the end, gradients.

    python experiments/bench/contact_beside.py FOLDER [--scenes rope cloth] [--columns 32]

FOLDER holds the environment `newton` (setup_peers.sh FOLDER newton). Times are processor time of one thread. The error
is the largest distance of a particle, at the end, from a run of the same program at an eighth of its shortest substep,
for newton of its law in double precision. Gradients are of one number, a weighted sum of the positions at the end, with
respect to the logarithms of friction and of all stiffnesses, and along a direction of the start and of its velocities.
Prints tables in Markdown.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import sheetbend as sb
from contact_scenes import Springs, built, changed, cloth_on_sphere, loop, rope_on_plane

HERE = Path(__file__).resolve().parent
STEPS = {"friction": 1e-5, "stiffness": 1e-5, "start": 1e-7, "velocity": 1e-6}  # of our differences
FINER = 8
LIMIT = 1200  # s for one call of newton


@dataclass(frozen=True)
class Row:
    """One program at one substep; seconds of processor time, error in m."""

    program: str
    h: float
    forward: float
    error: float
    with_gradient: float
    gradient: dict[str, float]
    differences: dict[str, float]


def solver(h: float) -> sb.Solver:
    return sb.Solver(h=h, method="implicit")


def ends(s: Springs, h: float) -> np.ndarray:
    return sb.simulate(built(s), [0.0, s.seconds], solver(h)).positions[-1]


def gradient(s: Springs, h: float) -> dict[str, float]:
    """Of the loss, by `STEPS`' names."""
    scene = built(s)
    run = sb.rollout(scene, [0.0, s.seconds], solver(h))
    bar = run.gradient(np.stack([0.0 * s.seed, s.seed]))
    of = bar.inputs
    return {
        "friction": s.friction * bar.quantities["shape_friction"],
        "stiffness": -float((of["compliance"] / s.stiffness).sum()),
        "start": float((of["position"] * s.direction).sum()),
        "velocity": float((of["velocity"] * s.direction).sum()),
    }


def timed(work: Callable[[], object]) -> float:
    """Processor time of the fastest of three runs, or of one where it takes over 10 s."""
    seconds: list[float] = []
    while len(seconds) < 3 and sum(seconds) < 10.0:
        begin = time.process_time()
        work()
        seconds.append(time.process_time() - begin)
    return min(seconds)


def ours(s: Springs, substeps: Sequence[float]) -> Iterator[Row]:
    finest = ends(s, min(substeps) / FINER)
    for h in substeps:
        by_difference = {
            name: float((s.seed * (ends(changed(s, name, d), h) - ends(changed(s, name, -d), h))).sum() / (2 * d))
            for name, d in STEPS.items()
        }
        forward, both = timed(partial(ends, s, h)), timed(partial(gradient, s, h))
        yield Row("sheetbend", h, forward, distance(ends(s, h), finest), both, gradient(s, h), by_difference)


def newtons(s: Springs, substeps: Sequence[float], folder: Path) -> Iterator[Row]:
    finest = loop(s, min(substeps) / FINER)
    env = {**os.environ, "WARP_CACHE": str(folder / "warp-cache")}
    python, script = folder / "newton" / "bin" / "python", HERE / "peers" / "with_newton.py"
    with tempfile.TemporaryDirectory() as scratch:
        problem = Path(scratch) / "problem.npz"
        s.export(problem)
        for h in substeps:
            command = [str(python), str(script), str(problem), str(h)]
            done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=LIMIT)
            if done.returncode != 0:
                sys.exit(f"error: with_newton.py failed at a substep of {h:g} s:\n{done.stderr.strip()[-2000:]}")
            told = json.loads(done.stdout.splitlines()[-1])
            error = distance(np.array(told["end"]), finest)
            yield Row(
                f"newton {told['version']}",
                h,
                told["forward_s"],
                error,
                told["gradient_s"],
                told["gradient"],
                told["differences"],
            )
    print(f"\nBoth programs at their shortest substeps over {FINER} end ", end="")
    print(f"{1e3 * distance(finest, ends(s, min(SUBSTEPS[s.sphere > 0][0]) / FINER)):.2g} mm apart.")


# By whether there is a sphere: ours, newton's [s].
SUBSTEPS = {
    False: ((1e-2, 2.5e-3, 5e-4, 1e-4), (1.5e-4, 1e-4, 5e-5)),
    True: ((1e-3, 5e-4, 2.5e-4), (1.5e-4, 1e-4, 5e-5)),
}


def distance(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.linalg.norm(x - y, axis=1).max())


def tables(rows: Sequence[Row]) -> Iterator[str]:
    yield "| | substep, ms | error at the end, mm | forward, s | forward and gradient, s |"
    yield "| --- | --- | --- | --- | --- |"
    for r in rows:
        yield f"| {r.program} | {1e3 * r.h:g} | {1e3 * r.error:.2g} | {r.forward:.3g} | {r.with_gradient:.3g} |"
    yield ""
    yield "| derivative with respect to | " + " | ".join(f"{r.program}, {1e3 * r.h:g} ms" for r in rows) + " |"
    yield "| --- |" + " --- |" * len(rows)
    for name in STEPS:
        pairs = (f"{r.gradient[name]:.6g} ({r.differences[name]:.6g})" for r in rows)
        yield f"| {name} | " + " | ".join(pairs) + " |"
    theirs = min((r for r in rows if r.program != "sheetbend"), key=lambda r: r.error)
    good = [r for r in rows if r.program == "sheetbend" and r.error <= theirs.error]
    yield ""
    if good:
        best = min(good, key=lambda r: r.forward)
        yield f"At newton's smallest error ours takes {best.forward / theirs.forward:.2g} of its forward time."
    else:
        yield "No substep of ours reaches newton's smallest error."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", nargs="+", choices=["rope", "cloth"], default=["rope", "cloth"])
    parser.add_argument("--columns", type=int, default=32, help="particles along a side of the cloth")
    given = parser.parse_args()
    for name in given.scenes:
        s = rope_on_plane() if name == "rope" else cloth_on_sphere(given.columns)
        mine, theirs = SUBSTEPS[s.sphere > 0]
        rows = [*ours(s, mine), *newtons(s, theirs, given.folder.resolve())]
        print(f"\n{name}, {len(s.start)} particles, {s.seconds:g} s\n")
        print("\n".join(tables(rows)), flush=True)


if __name__ == "__main__":
    main()
