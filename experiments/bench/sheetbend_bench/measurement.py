"""Times, gradient error and memory of a workload."""

from __future__ import annotations

from typing import Any

from sheetbend.version import __version__

from .machine import isa, machine
from .problem import Problem
from .reference import largest_error
from .timing import in_fresh_process, peak_mb, timed
from .workloads import Workload

LANES = 8
"""Constraints of one color, or scenes of a batch, that go through a kernel at a time."""


def measure(w: Workload, threads: int = 1, repeats: int = 5) -> dict[str, Any]:
    """What a workload costs here, as plain values: times are ns per projection, the median of `repeats` runs after a
    warm-up; the gradient's include the value's."""
    problem = Problem(w, threads)
    forward, _ = timed(problem.forward, repeats)
    gradient, found = timed(problem.gradient, repeats)
    return {
        "workload": w.name,
        "frames": w.frames,
        "scenes": w.scenes,
        "particles": w.scenes * w.particles,
        "colors": problem.colors,
        "coloring": "the workload's",
        "projections": problem.projections,
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        **forward.figures("forward", problem.projections),
        **gradient.figures("gradient", problem.projections),
        "repeats": len(gradient.seconds),
        "loss": float(found.loss[0]),
        "gradient_error": largest_error(problem, found),
        "gradient_error_bound": w.bound,
        "peak_mb": in_fresh_process(gradient_peak_mb, w, threads),
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_peak_mb(w: Workload, threads: int) -> float:
    """Memory that one gradient adds to that of the compiled workload, MB."""
    return peak_mb(Problem(w, threads).gradient)
