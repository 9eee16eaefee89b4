"""Fit thousands of synthetic recordings of ropes at once, and compare with a fit to a hundred of them.

    python experiments/coverage/many.py 10000               # memory, time, estimates
    python experiments/coverage/many.py 200 --workers 2     # the same bits

Every rope has 12 markers and is seen for 1 s. Stiffness, drag and length are shared; damping and the angle at which the
rope was mounted are each recording's own.
"""

from __future__ import annotations

import argparse
import hashlib
import resource
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from coverage import OUT
from sheetbend.minimum.progress import Progress

TRUTH = {"rope_EI": 1e-3, "rope_drag_linear": 0.02, "rope_length": 0.6}
DAMPING, SPREAD, TILT, NOISE = 0.01, 0.3, 0.03, 1e-3  # s, of its logarithm, rad, m
LINKS, FRAMES, SOLVER = 12, 51, sb.Solver(h=1 / 200)
MARKERS = [sb.on_particle(p) for p in range(1, LINKS + 1)]
WANTED = {
    "rope_EI": {"initial": 2e-3},
    "rope_drag_linear": {"initial": 0.01},
    "rope_length": {},
    "rope_bend_damping": {"private": True, "initial": 0.02},
    "rope_start_angle": {"private": True, "initial": 0.0},
}


def rope() -> sb.Scene:
    more = {"density": 0.05, "bend_damping": DAMPING, "clamp_start": (1, 0, 0), "clamp_angles": True}
    EI, drag, length = TRUTH.values()
    return sb.rope(length, LINKS, EI=EI, drag_linear=drag, plane=(0, 1, 0), **more)


def experiments(count: int, seed: int = 1) -> Iterator[sb.Experiment]:
    """Each with a scene of its own, as configurations and loops make them."""
    rng, made, times = np.random.default_rng(seed), rope(), np.arange(FRAMES) / (FRAMES - 1)
    for k in range(count):
        damping, tilt = DAMPING * np.exp(SPREAD * rng.standard_normal()), TILT * rng.standard_normal()
        own = {"rope_bend_damping": damping, "rope_start_angle": tilt}
        exact = sb.simulate(made, times, SOLVER, values=own).positions[:, 1:]
        seen = exact + NOISE * rng.standard_normal(exact.shape)
        recording = sb.Recording(seen, times, name=f"rope {k:05}")
        yield sb.Experiment(scene=rope(), recording=recording, solver=SOLVER, markers=MARKERS, sigma=NOISE)


def resident(peak: bool = True) -> float:
    """MB of this process."""
    if peak:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("--few", type=int, default=100, help="recordings of the fit to compare with")
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--journal", type=Path)
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    began = time.process_time()
    every = list(experiments(given.count))
    made, before = time.process_time() - began, resident()
    began, clock = time.process_time(), time.perf_counter()

    def told(progress: Progress) -> None:
        print(f"step {progress.iteration}: cost {progress.cost:.6g}, {time.process_time() - began:.0f} s", flush=True)

    with ProcessPoolExecutor(given.workers) if given.workers else nullcontext() as executor:
        found = sb.fit_many(every, WANTED, progress=told, executor=executor, journal=given.journal)
    seconds, wall, peak = time.process_time() - began, time.perf_counter() - clock, resident()
    print(f"experiments: {made:.1f} s, {before:.0f} MB")
    print(f"fit: {seconds:.0f} s of the processor, {wall:.0f} s, {peak:.0f} MB")
    print(found.report())
    given.out.mkdir(parents=True, exist_ok=True)
    path, began = given.out / f"many_{given.count}.json", time.process_time()
    found.save(path)
    written, began = time.process_time() - began, time.process_time()
    assert sb.ManyFit.load(path) == found
    read, sizes = time.process_time() - began, [p.stat().st_size / 1e3 for p in (path, path.with_suffix(".csv"))]
    print(f"{sizes[0]:.1f} kB and {sizes[1]:.0f} kB, written in {written:.2f} s and read in {read:.2f} s")
    same = hashlib.blake2b(repr(replace(found, seconds=0.0)).encode(), digest_size=8).hexdigest()
    print(f"digest of the result: {same}")
    few = sb.fit_many(every[: given.few], WANTED)
    for one in few.estimates:
        here, off = found[one.name], (found[one.name].value - one.value) / one.half_width
        print(
            f"{one.name}: {here.value:.6g} +- {here.half_width:.2g}, {off:+.2f} half-widths of the {given.few}; "
            f"the truth {(TRUTH[one.name] - here.value) / here.half_width:+.2f} of its own"
        )


if __name__ == "__main__":
    main()
