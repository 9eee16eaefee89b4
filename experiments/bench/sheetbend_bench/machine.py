"""What the figures were taken on."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import Any

from sheetbend import _core

LEVELS = {
    "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    "x86-64-v3": {"popcnt", "avx2", "bmi1", "bmi2", "fma"},
}
"""Instruction sets that the kernels are compiled for, widest first, and the processor flags that each adds."""


def machine() -> dict[str, Any]:
    """Processor, caches and memory as Linux tells them; what it does not tell is None or empty."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return {
        "processor": _cpuinfo("model name") or platform.processor() or platform.machine(),
        "family": _cpuinfo("cpu family"),
        "model": _cpuinfo("model"),
        "cores": len(os.sched_getaffinity(0)),
        "isa": widest_isa(),
        "caches": caches(),
        "memory_gb": round(memory / 1e9, 1),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
    }


def isa() -> str:
    """The instruction set of the kernels: what SHEETBEND_ISA names, or the widest that the processor has."""
    return _core.instruction_set()


def widest_isa() -> str:
    """The widest instruction set of ours that the processor has."""
    has = set((_cpuinfo("flags") or "").split())
    names = list(LEVELS)
    for k, name in enumerate(names):
        if all(LEVELS[wanted] <= has for wanted in names[k:]):
            return name
    return "portable"


def caches() -> dict[str, int]:
    """Data caches of the first core, largest level last: name -> bytes."""
    found: dict[str, int] = {}
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        if (index / "type").read_text().strip() == "Instruction":
            continue
        size = (index / "size").read_text().strip()
        found["L" + (index / "level").read_text().strip()] = int(size.rstrip("K")) * 1024
    return found


def _cpuinfo(key: str) -> str | None:
    path = Path("/proc/cpuinfo")
    for line in path.read_text().splitlines() if path.exists() else []:
        name, _, value = line.partition(":")
        if name.strip() == key:
            return value.strip()
    return None
