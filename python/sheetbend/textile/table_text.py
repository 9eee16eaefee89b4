"""Tables in the text files of testing machines: preamble, header, units and numbers, in whatever dialect.

Lines above a table are its preamble; the last of them that has as many cells as the numbers is its header, or the last
two where the lower one holds units alone. Another preamble below begins another table, which has the same header if it
brings none. Cells are separated by semicolons, tabs, commas or blanks; the decimal mark is a point or a comma, the same
everywhere in the file. Thousands may be grouped.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..errors import InputError, RecordingError
from ..files.door import bounded_bytes, check_file
from .units import unit

LARGEST = 2**25
"""Bytes of a file."""
_DELIMITERS = (";", "\t", ",", None)  # None: blanks
_NUMBER = {mark: re.compile(rf"[-+]?(\d+({mark}\d*)?|{mark}\d+)([eE][-+]?\d+)?") for mark in (r"\.", ",")}
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}([.,'\u2019 \u00a0\u202f])\d{3}(?:\1\d{3})*(?:([.,])\d+)?")
_MISSING = ("nan", "inf", "na", "n/a", "null", "none")
MOST_LINES = 500_000
"""Of a file."""
MOST_COLUMNS = 1000
"""Of a table."""
_LONGEST = 100  # characters of a column's name: longer ones would be matched in ever more ways
_HINT = "correct that cell, or leave out the line"

Line = tuple[int, list[str]]  # number in the file, from 1, and stripped cells


@dataclass(frozen=True)
class TextTable:
    """One table of a file: lines above it, names and units of its columns ("" where it has none), the line of the
    header, and the rows as they stand, each with its line in the file."""

    path: Path
    mark: str
    preamble: tuple[Line, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    header_line: int
    rows: tuple[Line, ...]

    def column(self, index: int) -> tuple[np.ndarray, list[int]]:
        """(n,) numbers of a column, counted from 0, and their lines; empty cells at its end are left out.

        Raises:
            RecordingError: a cell is empty above others, or no number; it names line and column.
        """
        cells = [(line, row[index]) for line, row in self.rows]
        while cells and not cells[-1][1]:
            cells.pop()
        return np.array([self.number(line, index, cell) for line, cell in cells]), [line for line, _ in cells]

    def number(self, line: int, index: int, cell: str) -> float:
        found = _number(cell, self.mark)
        if found is not None:
            return found
        other = "," if self.mark == "." else "."
        if _number(cell, other) is not None:
            told = f"has the decimal mark {other!r} where the file has {self.mark!r}"
            self.refuse(line, index, told, cell, "write one decimal mark throughout, or tell it by decimal=")
        self.refuse(line, index, "is empty above other numbers" if not cell else "is not a number", cell, _HINT)

    def refuse(self, line: int, index: int, problem: str, got: object, fix: str) -> NoReturn:
        name = self.names[index] or "no name"
        raise RecordingError(f"{self.path}, line {line}, column {index + 1} ({name})", problem, got, fix)


def read_tables(path: Path, decimal: str | None = None) -> list[TextTable]:
    """All tables of a file, at least one. UTF-8, UTF-16 with its mark, and Windows-1252 are read.

    Args:
        decimal: "." or ","; where left out it is found. It also tells a lone 1,040 from 1.040.

    Raises:
        RecordingError: it is no file, holds no table of two columns, or a row is cut off.
    """
    if decimal not in (None, ".", ","):
        raise InputError("decimal", "must be a decimal mark", decimal, "give '.' or ','")
    text = _text(path)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), start=1) if line.strip()]
    if len(lines) > MOST_LINES:
        fix = "cut it into pieces, or export fewer points per second"
        raise RecordingError(str(path), f"has more than {MOST_LINES:,} lines", len(lines), fix)
    split = {d: [(n, _cells(line, d)) for n, line in lines] for d in _DELIMITERS if d is None or d in text}
    if decimal is not None:
        split = {
            d: [(n, [_ungrouped(c, decimal, True) for c in cells]) for n, cells in own] for d, own in split.items()
        }
    marks = (".", ",") if decimal is None else (decimal,)
    fitting = {(d, m): sum(_is_row(cells, m) for _, cells in split[d]) for d in split for m in marks}
    delimiter, mark = max(fitting, key=fitting.__getitem__)
    if not fitting[delimiter, mark]:
        fix = "export the columns as text, or tell the decimal mark by decimal="
        raise RecordingError(str(path), "holds no table of numbers in two or more columns", f"{len(lines)} lines", fix)
    return _tables(path, split[delimiter], mark, delimiter)


_ZIP, _OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
"""How .xlsx and .ods, and .xls begin."""


def _text(path: Path) -> str:
    check_file(path)
    data = bounded_bytes(path, LARGEST)
    if data[: len(_ZIP)] == _ZIP or data[: len(_OLE)] == _OLE:
        fix = "save the sheet with the curves as CSV, any separator and decimal mark"
        raise RecordingError(str(path), "is a workbook of a spreadsheet, not text", path.name, fix)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _cells(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in cells] or [""]


def _number(cell: str, mark: str) -> float | None:
    pattern = _NUMBER[r"\." if mark == "." else ","]
    bare = _ungrouped(cell, mark)
    return float(bare.replace(",", ".")) if pattern.fullmatch(bare) else None


def _ungrouped(cell: str, mark: str, certain: bool = False) -> str:
    """A cell without the separators of its thousands, as in 1,040.5 or 1'040. Where it is not certain that the decimal
    mark is a comma, a lone 1.040 may be either and stays."""
    match = _GROUPED.fullmatch(cell)
    if match is None or match[1] == mark or match[2] not in (None, mark):
        return cell
    lone = not certain and match[1] in ".," and match[2] is None and cell.count(match[1]) == 1
    return cell if lone else cell.replace(match[1], "")


def _is_row(cells: Sequence[str], mark: str) -> bool:
    """Two numbers or more, and nothing else but empty cells."""
    filled = [cell for cell in cells if cell]
    return len(filled) > 1 and all(_number(cell, mark) is not None for cell in filled)


def _tables(path: Path, lines: Sequence[Line], mark: str, delimiter: str | None) -> list[TextTable]:
    found: list[TextTable] = []
    above: list[Line] = []
    rows: list[Line] = []
    for line, cells in lines:
        if _is_row(cells, mark) or (rows and _is_broken_row(cells)):
            rows.append((line, cells))
            continue
        if rows:
            found.append(_table(path, above, rows, mark, delimiter, found[-1] if found else None))
            above, rows = [], []
        above.append((line, cells))
    if rows:
        found.append(_table(path, above, rows, mark, delimiter, found[-1] if found else None))
    return found


def _is_broken_row(cells: Sequence[str]) -> bool:
    """Whether a line between rows starts as they do, or with what stands for a missing number: then it is wrong, and no
    preamble of a next table."""
    first = _first(cells)
    return len(cells) > 1 and (
        _starts_with_number(cells) or not re.search(r"[^\W\d_]", first) or first.lower() in _MISSING
    )


def _starts_with_number(cells: Sequence[str]) -> bool:
    return any(_number(_first(cells), mark) is not None for mark in (".", ","))


def _first(cells: Sequence[str]) -> str:
    return next((cell for cell in cells if cell), "")


def _table(
    path: Path, above: list[Line], rows: list[Line], mark: str, delimiter: str | None, before: TextTable | None
) -> TextTable:
    empty = min(_empty_at_end(cells) for _, cells in rows)  # delimiters that end every line
    rows = [(line, cells[: len(cells) - empty]) for line, cells in rows]
    above = [(line, cells[: len(cells) - min(empty, _empty_at_end(cells))]) for line, cells in above]
    width = len(rows[0][1])
    if width > MOST_COLUMNS:
        fix = "export fewer columns, or check the delimiter"
        raise RecordingError(f"{path}, line {rows[0][0]}", f"has more than {MOST_COLUMNS} columns", width, fix)
    first = len(above)
    while first and len(above[first - 1][1]) == width and _starts_with_number(above[first - 1][1]):
        first -= 1  # a first row that is wrong
    above, rows = above[:first], above[first:] + rows
    header = next((k for k in range(len(above) - 1, -1, -1)[:2] if _is_header(above[k][1], width)), None)
    if header is None:
        if above and delimiter == "," and width == 2 * len(above[-1][1]):
            fix = "export with ';' between columns, or '.' as decimal mark"
            got = ",".join(rows[0][1])
            raise RecordingError(f"{path}, line {rows[0][0]}", "has twice the cells of its header", got, fix)
        header, line, names, units = len(above), rows[0][0], [""] * width, [""] * width
        if before is not None and len(before.names) == width:
            names, units = list(before.names), list(before.units)
    else:
        line, names = above[header]
        units = [cell.strip("[]()") for cell in names]
        if header and _is_header(above[header - 1][1], width) and all(not u or unit(u) for u in units):
            header -= 1
            line, names = above[header]
        else:
            units = [""] * width
    for number, cells in rows:
        if len(cells) != width:
            place = f"{path}, line {number}"
            raise RecordingError(
                place, f"must have {width} cells, like the row of line {rows[0][0]}", len(cells), _HINT
            )
    parts = [(name, own) if own else _with_unit(name) for name, own in zip(names, units, strict=True)]
    columns = tuple(n for n, _ in parts), tuple(u for _, u in parts)
    return TextTable(path, mark, tuple(above[:header]), *columns, line, tuple(rows))


def _empty_at_end(cells: Sequence[str]) -> int:
    return next((k for k, cell in enumerate(reversed(cells)) if cell), len(cells))


def _is_header(cells: Sequence[str], width: int) -> bool:
    return len(cells) == width and any(cells) and all(_number(c, m) is None for c in cells for m in (".", ","))


def _with_unit(name: str) -> tuple[str, str]:
    """A header's name and unit: "Load (N)", "Kraft [cN]", "Weg in mm", "F / N", "force_N"."""
    if len(name) > _LONGEST:
        return name, ""
    bare = " ".join(name.split())  # so that blanks are matched in one way
    bracket = re.fullmatch(r"(.*?) ?[\[(]([^\])]*)[\])]", bare)
    if bracket:
        return bracket[1], bracket[2].strip()
    loose = re.fullmatch(r"(.*?)(?: in | ?/ ?| ?, ?| |_)([^\s_]+)", bare)
    return (loose[1], loose[2]) if loose and not loose[2].isdigit() and unit(loose[2]) else (name, "")
