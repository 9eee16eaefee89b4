"""Contact in this package and in newton on the same scene, in one run: time, error at the end, gradients.

    python experiments/bench/contact_beside.py FOLDER [--scenes rope cloth] [--columns 32] [--methods ...] [--peers ...]

FOLDER holds the environment `newton` (setup_peers.sh FOLDER newton). Methods are this package's: implicit, and for the
cloth gauss_seidel with two sweeps. Peers are newton's solvers: semi_implicit (default), xpbd, vbd. Times are processor
time of one thread. The error is the largest distance of a particle, and the median, at the end, from a run of the same
program at an eighth of its shortest substep, for semi_implicit of its law in double precision. Gradients are of one
number, a weighted sum of the positions at the end, with respect to the logarithms of friction and of all stiffnesses,
and along a direction of the start and of its velocities. `--forward` leaves them out.
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
from typing import Any

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
    median: float  # of all particles
    with_gradient: float | None  # None and empty where it was not asked for
    gradient: dict[str, float]
    differences: dict[str, float]


SOLVERS: dict[str, dict[str, Any]] = {
    "implicit": {"method": "implicit"},
    "gauss_seidel": {"method": "gauss_seidel", "iterations": 2},
}


def ends(s: Springs, method: str, h: float) -> np.ndarray:
    return sb.simulate(built(s), [0.0, s.seconds], sb.Solver(h=h, **SOLVERS[method])).positions[-1]


def gradient(s: Springs, method: str, h: float) -> dict[str, float]:
    """Of the loss, by `STEPS`' names."""
    scene = built(s)
    run = sb.rollout(scene, [0.0, s.seconds], sb.Solver(h=h, **SOLVERS[method]))
    bar = run.gradient(np.stack([0.0 * s.seed, s.seed]))
    of = bar.inputs
    return {
        "friction": s.friction * bar.quantities["shape_friction"],
        "stiffness": -float((of["compliance"] / s.stiffness).sum()),
        "start": float((of["position"] * s.direction).sum()),
        "velocity": float((of["velocity"] * s.direction).sum()),
    }


def difference(s: Springs, method: str, h: float, name: str, d: float) -> float:
    """The same derivative as a central difference."""
    there, back = (ends(changed(s, name, by), method, h) for by in (d, -d))
    return float((s.seed * (there - back)).sum() / (2 * d))


def timed(work: Callable[[], object]) -> float:
    """Processor time of the fastest of three runs, or of one where it takes over 10 s."""
    seconds: list[float] = []
    while len(seconds) < 3 and sum(seconds) < 10.0:
        begin = time.process_time()
        work()
        seconds.append(time.process_time() - begin)
    return min(seconds)


def ours(s: Springs, method: str, substeps: Sequence[float], forward: bool = False) -> Iterator[Row]:
    program = f"sheetbend {method}"
    finest = ends(s, method, min(substeps) / FINER)
    for h in substeps:
        errors, seconds = distances(ends(s, method, h), finest), timed(partial(ends, s, method, h))
        if forward:
            yield Row(program, h, seconds, *errors, None, {}, {})
            continue
        by_difference = {name: difference(s, method, h, name, d) for name, d in STEPS.items()}
        both = timed(partial(gradient, s, method, h))
        yield Row(program, h, seconds, *errors, both, gradient(s, method, h), by_difference)


def newtons(s: Springs, kind: str, substeps: Sequence[float], folder: Path, forward: bool) -> Iterator[Row]:
    env = {**os.environ, "WARP_CACHE": str(folder / "warp-cache")}
    python, script = folder / "newton" / "bin" / "python", HERE / "peers" / "with_newton.py"
    with tempfile.TemporaryDirectory() as scratch:
        problem = Path(scratch) / "problem.npz"
        s.export(problem)

        def told(h: float, *more: str) -> dict[str, Any]:
            command = [str(python), str(script), str(problem), str(h), kind, *more]
            done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=LIMIT)
            if done.returncode != 0:
                sys.exit(f"error: with_newton.py failed at a substep of {h:g} s:\n{done.stderr.strip()[-2000:]}")
            result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
            return result

        last = min(substeps) / FINER
        finest = loop(s, last) if kind == "semi_implicit" else np.array(told(last, "forward")["end"])
        for h in substeps:
            t = told(h, *(["forward"] if forward else []))
            yield Row(
                f"newton {t['version']} {kind}",
                h,
                t["forward_s"],
                *distances(np.array(t["end"]), finest),
                t.get("gradient_s"),
                t.get("gradient", {}),
                t.get("differences", {}),
            )
    if kind == "semi_implicit":
        apart, _ = distances(finest, ends(s, "implicit", min(SUBSTEPS[s.sphere > 0]["implicit"]) / FINER))
        print(f"\nBoth programs at their shortest substeps over {FINER} end {1e3 * apart:.2g} mm apart.")


# By whether there is a sphere [s].
PEERS = ("semi_implicit", "xpbd", "vbd")
SUBSTEPS = {
    False: {"implicit": (1e-2, 2.5e-3, 5e-4, 1e-4), **dict.fromkeys(PEERS, (1.5e-4, 1e-4, 5e-5))},
    True: {
        "semi_implicit": (1.5e-4, 1e-4, 5e-5),
        **dict.fromkeys(("implicit", "gauss_seidel", "xpbd", "vbd"), (1e-3, 5e-4, 2.5e-4)),
    },
}


def distances(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """The largest distance of a particle, and the median."""
    apart = np.linalg.norm(x - y, axis=1)
    return float(apart.max()), float(np.median(apart))


def tables(rows: Sequence[Row]) -> Iterator[str]:
    yield "| | substep, ms | error at the end, mm | median, mm | forward, s | forward and gradient, s |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for r in rows:
        both = "" if r.with_gradient is None else f"{r.with_gradient:.3g}"
        yield f"| {r.program} | {1e3 * r.h:g} | {1e3 * r.error:.2g} | {1e3 * r.median:.2g} | {r.forward:.3g} | {both} |"
    if derived := [r for r in rows if r.gradient]:
        yield ""
        yield "| derivative with respect to | " + " | ".join(f"{r.program}, {1e3 * r.h:g} ms" for r in derived) + " |"
        yield "| --- |" + " --- |" * len(derived)
        for name in STEPS:
            pairs = (f"{r.gradient[name]:.6g} ({r.differences[name]:.6g})" for r in derived)
            yield f"| {name} | " + " | ".join(pairs) + " |"
    for peer in dict.fromkeys(r.program for r in rows if not r.program.startswith("sheetbend")):
        theirs = min((r for r in rows if r.program == peer), key=lambda r: r.error)
        good = [r for r in rows if r.program.startswith("sheetbend") and r.error <= theirs.error]
        yield ""
        if good:
            best = min(good, key=lambda r: r.forward)
            yield f"At the smallest error of {peer} ours takes {best.forward / theirs.forward:.2g} of its forward time."
        else:
            yield f"No substep of ours reaches the smallest error of {peer}."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", nargs="+", choices=["rope", "cloth"], default=["rope", "cloth"])
    parser.add_argument("--columns", type=int, default=32, help="particles along a side of the cloth")
    parser.add_argument("--methods", nargs="+", choices=list(SOLVERS), default=list(SOLVERS), help="this package's")
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=["semi_implicit"], help="solvers of newton")
    parser.add_argument("--forward", action="store_true", help="no gradients")
    given = parser.parse_args()
    for name in given.scenes:
        s = rope_on_plane() if name == "rope" else cloth_on_sphere(given.columns)
        substeps = SUBSTEPS[s.sphere > 0]
        rows = [row for m in given.methods if m in substeps for row in ours(s, m, substeps[m], given.forward)]
        for peer in given.peers:
            rows += newtons(s, peer, substeps[peer], given.folder.resolve(), given.forward)
        print(f"\n{name}, {len(s.start)} particles, {s.seconds:g} s\n")
        print("\n".join(tables(rows)), flush=True)


if __name__ == "__main__":
    main()
