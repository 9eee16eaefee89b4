"""Amounts of memory as people write them: "2 GB", "500 MiB", or a number of bytes."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

from ..errors import InputError

UNITS = {"B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
MOST = 2**62  # bytes
_BY_LOWER = {unit.lower(): size for unit, size in UNITS.items()}


def in_bytes(field: str, amount: object) -> int:
    """Bytes of an amount: a positive number of bytes, or a text of a number and a unit (`UNITS`).

    Raises:
        InputError: no amount.
    """
    size = math.nan
    if isinstance(amount, str):
        parts = re.fullmatch(r"\s*([0-9]*\.?[0-9]+)\s*([A-Za-z]+)\s*", amount)
        if parts is not None and parts[2].lower() in _BY_LOWER:
            size = float(parts[1]) * _BY_LOWER[parts[2].lower()]
    elif isinstance(amount, int | float) and not isinstance(amount, bool):
        size = float(amount) if amount < MOST else math.inf
    if not (math.isfinite(size) and size >= 1.0):
        fix = f'give bytes, or a text such as "2 GB"; units are {", ".join(UNITS)}'
        raise InputError(field, "is not an amount of memory", amount, fix)
    return int(size)


def free_memory() -> int:
    """Bytes that this process may still take: what the machine has available, less where a control group allows
    less."""
    free = [_available()]
    for folder in ("/sys/fs/cgroup", "/sys/fs/cgroup/memory"):
        for limit, used in (("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes")):
            try:
                most = int(Path(folder, limit).read_text())
                free.append(max(0, most - int(Path(folder, used).read_text())))
            except (OSError, ValueError):  # no such group, or "max"
                continue
    return min(free)


def expect_room(field: str, size: int, fix: str) -> None:
    """Refuse what does not fit in the free memory, before anything is allocated.

    Raises:
        InputError: `size` bytes are more than are free.
    """
    free = free_memory()
    if size > free:
        raise InputError(field, f"needs {in_words(size)} of memory, of which {in_words(free)} are free", size, fix)


def _available() -> int:
    """What the machine has available; where it does not tell, all of its memory."""
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError, IndexError):
        pass
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def in_words(size: int) -> str:
    """Bytes as a text in decimal units, to three digits: "1.46 GB"."""
    for unit in ("TB", "GB", "MB", "kB"):
        if size >= 0.9995 * UNITS[unit]:
            return f"{_three_digits(size / UNITS[unit])} {unit}"
    return f"{size} B"


def least_in_words(size: int) -> str:
    """A number of bytes in words, rounded up, so that the amount as written is enough."""
    unit = next((u for u in ("GB", "MB", "kB") if size >= UNITS[u]), "B")
    if unit == "B":
        return f"{size} B"
    digits = max(0, 2 - int(math.log10(size / UNITS[unit])))
    return f"{math.ceil(size / UNITS[unit] * 10**digits) / 10**digits:.{digits}f} {unit}"


def _three_digits(value: float) -> str:
    return f"{value:.{max(0, 2 - int(math.log10(max(value, 1.0))))}f}"
