"""The direct solver on a rope, from 20 to 20,000 segments, and on many short ropes at once.

Stiff ropes with bending and its damping, pinned at one end, BDF2 with two Newton iterations per substep. A unit of
work is one segment in one substep. The loss is the sum of the last coordinates, so its gradient is one call of the
adjoint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sheetbend.motion.solver import Solver
from sheetbend.objects.rope import rope
from sheetbend.version import __version__

from .machine import isa, machine
from .measurement import LANES
from .ropes import Ropes
from .timing import in_fresh_process, peak_mb, timed

SEGMENTS = (20, 50, 200, 1000, 5000, 20000)
WORK = 60_000  # segments times substeps of one run
H = 1 / 600  # s
BATCH = (64, 50)  # ropes, segments
BATCH_SUBSTEPS = 120
CHECKED = (50, 60)  # segments and substeps of the rope whose gradient is compared with a complex step
BOUND = 1e-9


@dataclass(frozen=True)
class Length:
    """A rope of so many segments for so many substeps."""

    segments: int
    substeps: int

    @property
    def work(self) -> int:
        return self.segments * self.substeps


def chains(length: Length, threads: int, count: int = 1) -> Ropes:
    """`count` equal ropes."""
    scene = rope(1.0, length.segments, density=0.05, EA=1e4, EI=1e-3, bend_damping=0.01, pinned=[0]).compiled
    return Ropes(scene, np.tile(scene.inputs(), (count, 1)), Solver(h=H, threads=threads), length.substeps)


def lengths(work: int = WORK, segments: Sequence[int] = SEGMENTS) -> list[Length]:
    """The ropes, at least three substeps each."""
    return [Length(n, max(3, work // n)) for n in segments]


def measure_chain(
    threads: int = 1, repeats: int = 5, work: int = WORK, segments: Sequence[int] = SEGMENTS
) -> dict[str, Any]:
    """Rows of ns per segment and substep, and the batch against one rope at a time."""
    ropes = lengths(work, segments)
    rows = [_row(length, threads, repeats) for length in ropes]
    longest = rows[-1]
    return {
        "workload": "chain",
        "particles": longest["segments"] + 1,
        "projections": longest["segments"] * longest["substeps"],
        **longest,
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        "repeats": repeats,
        "rows": rows,
        "batch": _batch(threads, repeats, max(2, BATCH_SUBSTEPS * work // WORK)),
        "gradient_error": gradient_error(),
        "gradient_error_bound": BOUND,
        "peak_mb": in_fresh_process(_peak_mb, ropes[-1], threads),
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_error() -> float:
    """Of the adjoint on a short rope, relative to complex step."""
    return chains(Length(*CHECKED), 1).gradient_error()


def _row(length: Length, threads: int, repeats: int) -> dict[str, float]:
    ropes = chains(length, threads)
    forward, _ = timed(ropes.forward, repeats)
    gradient, _ = timed(ropes.gradient, repeats)
    return {
        "segments": length.segments,
        "substeps": length.substeps,
        **forward.figures("forward", length.work),
        **gradient.figures("gradient", length.work),
    }


def _batch(threads: int, repeats: int, substeps: int) -> dict[str, float]:
    count, segments = BATCH
    length = Length(segments, substeps)
    figures = chains(length, threads, count).batch_figures(repeats, count * length.work)
    found = {"ropes": count, "segments": segments, "substeps": substeps, **figures}
    for name in ("forward", "gradient"):
        found[f"{name}_speedup"] = found[f"{name}_singly_ns"] / found[f"{name}_ns"]
    return found


def _peak_mb(length: Length, threads: int) -> float:
    return peak_mb(chains(length, threads).gradient)
