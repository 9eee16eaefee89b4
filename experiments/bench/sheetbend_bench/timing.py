"""Wall-clock times of repeated calls, and peak memory in a process of its own."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np
from sheetbend.errors import SheetbendError

BUDGET = 60.0  # s after which no further repeat starts

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Times:
    """Seconds of each repeat after the warm-up: on the wall's clock, and on the processor summed over threads."""

    seconds: tuple[float, ...]
    processor: tuple[float, ...]

    def figures(self, name: str, units: int) -> dict[str, float]:
        """ns per unit of work: median and fastest by the wall's clock, median on the processor. On a quiet machine and
        with one thread the first and the last agree; on a busy one the last is the better guess."""
        return {
            f"{name}_ns": 1e9 * float(np.median(self.seconds)) / units,
            f"{name}_ns_min": 1e9 * min(self.seconds) / units,
            f"{name}_cpu_ns": 1e9 * float(np.median(self.processor)) / units,
        }


def timed(work: Callable[[], T], repeats: int) -> tuple[Times, T]:
    """Times of `repeats` calls after one that does not count, with the last result; fewer calls, but at least one,
    where they take longer than a minute together."""
    result = work()
    seconds: list[float] = []
    processor: list[float] = []
    gc.collect()
    while len(seconds) < repeats and sum(seconds) < BUDGET:
        begin, busy = time.perf_counter(), time.process_time()
        result = work()
        seconds.append(time.perf_counter() - begin)
        processor.append(time.process_time() - busy)
    return Times(tuple(seconds), tuple(processor)), result


def in_fresh_process(work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T:
    """The result of a function of a module, called in a new process: nothing measured before is in its memory.

    Raises:
        SheetbendError: the process was ended from outside, as happens where memory runs out.
    """
    try:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            return pool.submit(work, *arguments, **named).result()
    except BrokenProcessPool as error:
        raise SheetbendError("the measuring process was ended from outside. Fix: free memory") from error


def peak_mb(work: Callable[[], object]) -> float:
    """What a call adds at its peak to the memory that the process holds before it, MB (1e6 bytes); Linux only."""
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew, proc(5)
    before = _high_water_mark()
    work()
    return (_high_water_mark() - before) / 1e6


def _high_water_mark() -> int:
    """Peak resident memory, bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    (line,) = (line for line in lines if line.startswith("VmHWM"))
    return 1024 * int(line.split()[1])
