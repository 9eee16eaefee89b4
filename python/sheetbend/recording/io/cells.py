"""Cells of text files of recordings: lines, numbers, and refusals that name the line."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...arrays.types import Array
from ...errors import RecordingError
from .lost import without_zeros

_NOT_SEEN = {"na", "n/a", "null", "none"}  # as tables of other programs write a cell without a value, beside nan
_WIDE = (b"\xff\xfe", b"\xfe\xff")
"""How UTF-16 begins."""
_JUDGED = 4096  # bytes in which a file that is no text has a control character
Row = tuple[int, list[str]]  # line number in the file, from 1, and the cells


def lines(path: Path) -> list[tuple[int, str]]:
    """The lines of a text file with their numbers from 1: of UTF-8, UTF-16 with its mark, or Windows-1252, as
    spreadsheets write them.

    Raises:
        RecordingError: it is no text.
    """
    data = path.read_bytes()
    wide = data[:2] in _WIDE
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        if wide or any(byte < 32 and byte not in b"\t\n\r\f" for byte in data[:_JUDGED]):
            raise RecordingError(str(path), "is not UTF-8 text", str(error), "save it as a UTF-8 CSV") from error
        text = data.decode("cp1252", errors="replace")
    return list(enumerate(re.split("\r\n|\r|\n", text), start=1))


def split(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    """The stripped cells of a line."""
    try:
        (found,) = csv.reader([line], delimiter=delimiter, strict=True)
    except csv.Error as error:
        place = f"{path}, line {number}"
        raise RecordingError(place, f"is malformed, {error}", line, "mend its quotes") from error
    return [cell.strip() for cell in found]


def number(path: Path, line: int, cell: str) -> float:
    """A cell as a number; NaN where it is empty or says that there is none."""
    if not cell or cell.lower() in _NOT_SEEN:
        return np.nan
    try:
        found = float(cell.replace("_", "?"))  # Python would read 1_0 as ten
    except ValueError:
        fix = "write a point as decimal mark, and an empty cell or nan for a marker not seen"
        refuse(path, line, "holds a cell that is not a number", cell, fix)
    if np.isinf(found):
        refuse(path, line, "holds an infinite number; leave the cell empty for a marker not seen", cell)
    return found


def points_seen(
    path: Path, rows: Sequence[Row], names: Sequence[str], first: Sequence[int]
) -> tuple[Array, tuple[str, ...]]:
    """Points (rows, k, 3) whose x, y, z stand from columns `first` on, and their names, without those never seen."""
    x = without_zeros(
        np.array([[[number(path, row, cells[k + axis]) for axis in range(3)] for k in first] for row, cells in rows])
    )
    seen = np.any(np.isfinite(x[:, :, 0]), axis=0)
    return x[:, seen], tuple(names[k] for k, ever in zip(first, seen, strict=True) if ever)


def refuse(path: Path, line: int, problem: str, got: object, fix: str = "correct that line") -> NoReturn:
    raise RecordingError(f"{path}, line {line}", problem, got, fix)
