"""W2's cloth at other sizes: cost per projection as the particles outgrow the caches.

Each cloth runs in a process of its own, for so many of W2's substeps that all have about the same number of
projections.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from sheetbend.version import __version__

from .machine import isa, machine
from .measurement import LANES
from .problem import Problem
from .reference import largest_error
from .timing import in_fresh_process, peak_mb, timed
from .workloads import WORKLOADS, Workload

SIDES = (21, 90, 121, 257, 512, 1000)  # 441 particles to 1,000,000
PARTICLE_SUBSTEPS = 2_000_000
MIN_SUBSTEPS = 8
CHECKED = (21, 20)  # side and substeps of the cloth whose gradient is compared with complex step


def rung(side: int, substeps: int) -> Workload:
    """W2 with side x side particles for a single frame of so many substeps, which are as long as W2's."""
    w2 = WORKLOADS["W2"]
    rate = w2.frame_rate * w2.substeps / substeps
    return replace(w2, name="ladder", rows=side, columns=side, frames=1, substeps=substeps, frame_rate=rate)


def measure_ladder(
    threads: int = 1,
    repeats: int = 5,
    sides: Sequence[int] = SIDES,
    particle_substeps: int = PARTICLE_SUBSTEPS,
    progress: Callable[[dict[str, Any]], None] = lambda row: None,
) -> dict[str, Any]:
    """One row per size, and the largest one's figures as those of the workload; `progress` gets each row."""
    rows: list[dict[str, Any]] = []
    for side in sides:
        w = rung(side, max(MIN_SUBSTEPS, particle_substeps // side**2))
        rows.append(in_fresh_process(climb, w, threads, repeats))
        progress(rows[-1])
    checked = Problem(rung(*CHECKED), threads)
    return {
        "workload": "ladder",
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        **rows[-1],
        "rows": rows,
        "gradient_error": largest_error(checked, checked.gradient()),
        "gradient_error_bound": checked.workload.bound,
        "sheetbend": __version__,
        "machine": machine(),
    }


def climb(w: Workload, threads: int, repeats: int) -> dict[str, Any]:
    """One row; for a process of its own."""
    problem = Problem(w, threads)
    peak = peak_mb(problem.gradient)
    forward, _ = timed(problem.forward, repeats)
    gradient, _ = timed(problem.gradient, repeats)
    return {
        "particles": w.particles,
        "substeps": w.substeps,
        "iterations": w.iterations,
        "colors": problem.colors,
        "projections": problem.projections,
        **forward.figures("forward", problem.projections),
        **gradient.figures("gradient", problem.projections),
        "repeats": len(gradient.seconds),
        "peak_mb": peak,
    }
