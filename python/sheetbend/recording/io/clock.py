"""The time column of a text file: what it is called, and its unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from ...arrays.types import Array
from .cells import Row, number, refuse

_WORDS = "times?|time[ _]?stamps?|t|zeit|temps|tiempo|tempo|tijd|czas|время|时间|時間"
_UNITS = "s|sec|seconds|sekunden|ms|msec|milliseconds|millisekunden|us|µs|ns"
_NAME = re.compile(rf"(%time)|(?:{_WORDS})[\s_/,]*(?:in\s+)?[(\[]?\s*({_UNITS})?\s*[)\]]?", re.IGNORECASE)
_LONGEST = 40  # characters: blanks of a longer one would be matched in ever more ways
PER_SECOND = {"ms": 10**3, "us": 10**6, "ns": 10**9}
"""Parts of a second, by the unit that counts them."""
_LATEST = 1e11  # s: later than any clock that counts seconds
_SHORTEST = 1e-7  # s between two frames, which no camera reaches
_FEW = 10  # rows from which on this is judged


def unit(name: str) -> str | None:
    """ "s", "ms", "us" or "ns", of a column called `t`, `time`, `time_ns`, `Time (s)`, `timestamp_ms` or so; None where
    the name is not that of a time. ROS's `%time` is in ns."""
    match = _NAME.fullmatch(name) if len(name) <= _LONGEST else None
    if match is None:
        return None
    told = "ns" if match[1] else (match[2] or "s").lower()
    told = "ms" if told.startswith(("msec", "milli")) else "us" if told in ("µs", "μs") else told  # micro sign, mu
    return told if told in PER_SECOND else "s"


def times(path: Path, rows: Sequence[Row], unit: str) -> Array:
    """(rows,) s, of the first cells. Those of finer units count from the earliest, so that stamps keep their digits.

    Raises:
        RecordingError: a cell is no number, or its seconds are no time, or frames are too near for the unit.
    """
    if unit == "s":
        found = np.array([number(path, line, cells[0]) for line, cells in rows])
        for (line, cells), time in zip(rows, found.tolist(), strict=True):
            if abs(time) > _LATEST:
                fix = "name the column time_ns, time_us or time_ms"
                refuse(path, line, "has a time that cannot be in s", cells[0], fix)
        return found
    exact = [_exact(path, line, cells[0]) for line, cells in rows]
    first = min((time for time in exact if time is not None), default=Decimal(0))
    found = np.array([np.nan if t is None else float((t - first) / PER_SECOND[unit]) for t in exact])
    apart = np.abs(np.diff(found))
    if len(found) >= _FEW and 0.0 < np.nanmedian(apart) < _SHORTEST:
        fix = "name the column after the unit that it counts: time, time_ms, time_us or time_ns"
        refuse(
            path,
            rows[1][0],
            f"has a time in {unit}, {np.nanmedian(apart):.2g} s after the row before",
            rows[1][1][0],
            fix,
        )
    return found


def _exact(path: Path, line: int, cell: str) -> Decimal | None:
    if np.isnan(number(path, line, cell)):
        return None
    try:
        return Decimal(cell)
    except InvalidOperation:  # what Python's float reads beyond it
        return Decimal(float(cell))
