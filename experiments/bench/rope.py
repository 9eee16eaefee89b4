"""Times of one rope on the direct chain solver: forward, and a gradient by every input, per substep.

Run: python experiments/bench/rope.py [segments ...]
"""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import sheetbend as sb

SUBSTEPS = 600
H = 1 / 600  # s
REPEATS = 7


def best_us(work: Callable[[], object]) -> float:
    """Microseconds per substep of the fastest of several runs."""
    seconds = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return 1e6 * min(seconds) / SUBSTEPS


def measure(segments: int) -> tuple[float, float]:
    """Forward, and forward with the gradient of the last frame by every input: microseconds per substep."""
    scene = sb.rope(1.0, segments, density=0.05, EA=1e4, EI=1e-3, bend_damping=0.01, pinned=[0])
    inputs, solver, frames = scene.compiled.inputs(), sb.Solver(h=H).core(scene.compiled), [SUBSTEPS]
    x_bar = np.ones((1, scene.compiled.core.dofs))
    forward = best_us(lambda: solver.simulate(inputs, frames, 0.0))
    gradient = best_us(lambda: solver.vjp(inputs, solver.record(inputs, frames, 0.0)[1], frames, x_bar, 0.0))
    return forward, gradient


def processor() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")),
        platform.processor() or platform.machine(),
    )


def main(sizes: list[int]) -> None:
    print(f"{processor()}, one thread, double precision, BDF2, {sb.Solver().sweeps} Newton iterations per substep")
    print(
        f"{'segments':>8}  {'forward [us]':>12}  {'gradient [us]':>13}  {'ratio':>5}"
        "   (per substep; the gradient includes the forward run)"
    )
    for n in sizes:
        forward, gradient = measure(n)
        print(f"{n:8d}  {forward:12.1f}  {gradient:13.1f}  {gradient / forward:5.2f}", flush=True)


if __name__ == "__main__":
    main([int(a) for a in sys.argv[1:]] or [10, 50, 200])
