"""The direct solver on a rope, from 20 to 20,000 segments, and on many short ropes at once.

Stiff ropes with bending and its damping, pinned at one end, BDF2 with two Newton iterations per substep. A unit of
work is one segment in one substep. The loss is the sum of the last coordinates, so its gradient is one call of the
adjoint.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .. import __version__
from ..rope import rope
from ..solver import Solver
from .machine import isa, machine
from .measurement import LANES
from .timing import in_fresh_process, peak_mb, timed
from .workloads import Array

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


class Ropes:
    """`count` equal ropes, ready to run."""

    def __init__(self, length: Length, threads: int, count: int = 1) -> None:
        scene = rope(1.0, length.segments, density=0.05, EA=1e4, EI=1e-3, bend_damping=0.01, pinned=[0])
        self.inputs = np.tile(scene.compiled.inputs(), (count, 1))
        self.core = Solver(h=H, threads=threads).core(scene.compiled)
        self.steps = [length.substeps]
        self._bar = np.ones((count, 1, scene.compiled.core.dofs))

    def forward(self) -> None:
        """One rope."""
        self.core.states(self.inputs[0], self.steps, 0.0)

    def gradient(self) -> Array:
        """One rope: (inputs,)."""
        _, tape = self.core.record(self.inputs[0], self.steps, 0.0)
        return self.core.vjp(self.inputs[0], tape, self.steps, self._bar[0], 0.0)

    def all_forward(self) -> None:
        """All ropes in one call."""
        self.core.simulate_batch(self.inputs, self.steps, 0.0)

    def all_gradients(self) -> None:
        """All ropes in one call."""
        self.core.vjp_batch(self.inputs, self.steps, self._bar, 0.0)

    def singly(self, work: Callable[[], object]) -> None:
        """The same work once per rope, one after the other."""
        for _ in self.inputs:
            work()


def lengths(work: int = WORK) -> list[Length]:
    """The ropes, at least three substeps each."""
    return [Length(n, max(3, work // n)) for n in SEGMENTS]


def measure_chain(threads: int = 1, repeats: int = 5, work: int = WORK) -> dict[str, Any]:
    """Rows of ns per segment and substep, and the batch against one rope at a time."""
    rows = [_row(length, threads, repeats) for length in lengths(work)]
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
        "peak_mb": in_fresh_process(_peak_mb, lengths(work)[-1], threads),
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_error() -> float:
    """Of the adjoint on a short rope, along a fixed random direction of all inputs, relative to complex step."""
    ropes = Ropes(Length(*CHECKED), 1)
    direction = np.random.default_rng(5).standard_normal(ropes.inputs.shape[1]) * np.abs(ropes.inputs[0])
    wanted = ropes.core.complex_step(ropes.inputs[0], direction, ropes.steps, 0.0).sum()
    return float(abs(np.vdot(ropes.gradient(), direction) / wanted - 1))


def _row(length: Length, threads: int, repeats: int) -> dict[str, float]:
    ropes = Ropes(length, threads)
    forward, _ = timed(ropes.forward, repeats)
    gradient, _ = timed(ropes.gradient, repeats)
    return {
        "segments": length.segments,
        "substeps": length.substeps,
        **forward.figures("forward", length.work),
        **gradient.figures("gradient", length.work),
    }


def _batch(threads: int, repeats: int, substeps: int) -> dict[str, float]:
    """The gradient of a batch is one call that includes its forward run, as it does for one rope."""
    count, segments = BATCH
    length = Length(segments, substeps)
    ropes = Ropes(length, threads, count)
    work = count * length.work
    found: dict[str, float] = {"ropes": count, "segments": segments, "substeps": substeps}
    for name, together, alone in (
        ("forward", ropes.all_forward, ropes.forward),
        ("gradient", ropes.all_gradients, ropes.gradient),
    ):
        batched, _ = timed(together, repeats)
        singly, _ = timed(partial(ropes.singly, alone), repeats)
        found |= batched.figures(name, work) | singly.figures(f"{name}_singly", work)
        found[f"{name}_speedup"] = found[f"{name}_singly_ns"] / found[f"{name}_ns"]
    return found


def _peak_mb(length: Length, threads: int) -> float:
    return peak_mb(Ropes(length, threads).gradient)
