"""What the peers' scripts share: the problem that sheetbend wrote, timing, and one line of JSON.

Run a script as: PYTHON with_TOOL.py PROBLEM.npz REPEATS
"""

from __future__ import annotations

import gc
import json
import resource
import sys
import time
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

BUDGET = 60.0  # s after which no further repeat starts, as in sheetbend_bench


def load() -> tuple[SimpleNamespace, int]:
    """The arrays of the problem (sheetbend_bench.problem.Problem.export tells what they are), and the repeats."""
    with np.load(sys.argv[1]) as saved:
        p = SimpleNamespace(**{name: saved[name] for name in saved.files})
    for name in ("columns", "frames", "substeps", "iterations"):
        setattr(p, name, int(getattr(p, name)))
    p.h = float(p.h)
    p.color_ranges = list(zip(p.first_of_color[:-1].tolist(), p.first_of_color[1:].tolist(), strict=True))
    return p, int(sys.argv[2])


def slots(p: SimpleNamespace) -> tuple[np.ndarray, np.ndarray]:
    """For tools whose reverse sees only what is not overwritten: each projection of a substep writes two new slots
    after the particles' own. Where it reads its particles (projections, 2), where each particle ends (particles,)."""
    n, m = len(p.start), len(p.rest)
    now, read = np.arange(n), np.empty((m * p.iterations, 2), dtype=int)
    for sweep in range(p.iterations):
        for a, b in p.color_ranges:  # within a color no particle comes twice
            ids = np.arange(a, b) + sweep * m
            read[ids] = now[p.links[a:b]]
            now[p.links[a:b]] = n + 2 * ids[:, None] + [0, 1]
    return read, now


def times(name: str, work: Callable[[], object], repeats: int) -> tuple[dict[str, object], object]:
    """Seconds of the first call (with its compilation) and of the others, by the wall's clock and on the processor; the
    last result."""
    begin = time.perf_counter()
    result = work()
    first = time.perf_counter() - begin
    seconds: list[float] = []
    processor: list[float] = []
    gc.collect()
    while len(seconds) < repeats and sum(seconds) < BUDGET:
        begin, busy = time.perf_counter(), time.process_time()
        result = work()
        seconds.append(time.perf_counter() - begin)
        processor.append(time.process_time() - busy)
    return {f"{name}_first_s": first, f"{name}_s": seconds, f"{name}_cpu_s": processor}, result


def run(tool: str, version: str, forward: Callable, gradient: Callable | None = None) -> None:
    """Times forward() -> losses (scenes,) and gradient() -> (losses, by parameters (scenes, 3), by start (scenes,
    particles, 3)), and prints them."""
    p, repeats = load()
    before = peak_mb()
    seconds, losses = times("forward", forward, repeats)
    told = {"tool": tool, "version": version, **seconds, "losses": np.asarray(losses, dtype=float).tolist()}
    if gradient is not None:
        seconds, (_, by_parameters, by_start) = times("gradient", gradient, repeats)
        along = np.tensordot(np.asarray(by_start, dtype=float), p.direction, axes=2)
        numbers = np.column_stack([np.asarray(by_parameters, dtype=float), along])
        told |= {**seconds, "numbers": numbers.tolist()}
    told["peak_mb"] = peak_mb() - before
    print(json.dumps(told), flush=True)


def peak_mb() -> float:
    """Peak memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
