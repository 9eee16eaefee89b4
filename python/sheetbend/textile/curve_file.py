"""Curves from the files of testing machines."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..arrays.checks import check_kind
from ..arrays.types import Array
from ..errors import InputError, RecordingError
from ..files.door import reading
from ..files.names import checked_name
from .curve import TESTS, Curve
from .table_columns import Choice, Column, find_columns, in_order, needed_columns
from .table_text import TextTable, read_tables
from .units import unit

_DIMENSIONS = {
    "tension": (("length", "strain"), ("force", "force per width")),
    "shear": (("length", "angle"), ("force", "force per width")),
    "bending": (("curvature",), ("moment", "moment per width")),
}

_SIZE = re.compile(r"\W*([^\W\d]*)\W*?([\d.,]+)\W*([^\W\d]*)\W*")
_LONGEST = 60  # characters behind the words: more would be matched in ever more ways


def read_curves(
    path: str | Path,
    *,
    test: str = "tension",
    length: float | str | None = None,
    width: float | str | None = None,
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    decimal: str | None = None,
) -> tuple[Curve, ...]:
    """Read the curves of a testing machine's text export, in SI units.

    Delimiters (semicolons, tabs, commas, blanks), decimal points or commas, lines above the header, and units in the
    header or in a line of their own are found by themselves. Columns are known by their units (a load is what is in N,
    cN, gf, N/m, gf/cm; a deformation what is in mm or %), else by their names in some languages. Several repeats may
    stand below each other, each under a header, side by side as further pairs of columns, or in one table with a column
    that numbers them.

    Args:
        path: of the file.
        test: "tension" (strain, force per width), "shear" (angle, force per width) or "bending" (curvature, moment per
            width).
        length: between the jaws, m, or the words before it in the file's preamble ("Gauge length"), where it stands
            with its unit. Needed where the deformation is a length; shear's angle is atan(displacement/length).
        width: of the specimen, m, or the preamble's words. Needed where loads are not per width.
        columns: by role ("deformation", "load", "time", "repeat"), the column's name or its number from 1, where they
            are not found or several fit.
        units: by role, where the header has none: `{"load": "cN"}`.
        decimal: "." or ",", where the file leaves it open: whether a lone 1,040 is a thousand and forty.

    Raises:
        InputError: an argument that is unknown or missing.
        RecordingError: a file, line or column that cannot be read; it names them.
    """
    if test not in TESTS:
        raise InputError("test", "is unknown", test, f"use one of {', '.join(TESTS)}")
    for field, given in (("columns", columns), ("units", units)):
        check_kind(field, {} if given is None else given, Mapping, "give a mapping from roles")
    choice = Choice(dict(columns or {}), dict(units or {}))
    with reading(path):
        return _curves(Path(path), test, length, width, choice, decimal)


def _curves(
    path: Path, test: str, length: float | str | None, width: float | str | None, choice: Choice, decimal: str | None
) -> tuple[Curve, ...]:
    tables = read_tables(path, decimal)
    at, across = _size(path, tables, "length", length), _size(path, tables, "width", width)
    found = [arrays for table in tables for arrays in _repeats(table, test, choice, at, across)]
    name = checked_name(str(path), path.stem)
    names = [name] if len(found) == 1 else [f"{name} {k}" for k in range(1, len(found) + 1)]
    return tuple(Curve(name, test, *arrays, at, across) for name, arrays in zip(names, found, strict=True))


def _size(path: Path, tables: Sequence[TextTable], field: str, given: float | str | None) -> float | None:
    size = _length_in_preamble(path, tables, field, given) if isinstance(given, str) else given
    if size is not None and not (math.isfinite(size) and size > 0):
        raise InputError(field, "must be positive", given, "give m")
    return size


def _length_in_preamble(path: Path, tables: Sequence[TextTable], field: str, words: str) -> float:
    """m, what the preamble says behind some words: "Width;50;mm", "Width: 50 mm", "Width (mm) = 50"."""
    for table in tables:
        for line, cells in table.preamble:
            text = " ".join(cells)
            if not text.lower().startswith(words.lower()):
                continue
            behind = text[len(words) :]
            match = _SIZE.fullmatch(behind) if len(behind) <= _LONGEST else None
            told = [u for u in (unit(match[1]), unit(match[3])) if u and u.dimension == "length"] if match else []
            if match is None or not told:
                raise RecordingError(
                    f"{path}, line {line}",
                    f"holds no {field} with its unit",
                    text,
                    f"give the {field} itself, such as 20cm",
                )
            return table.number(line, 0, match[2]) * told[0].factor
    raise RecordingError(
        str(path),
        f"has no line above its tables that starts with {words!r}",
        field,
        f"give the {field} itself, such as 20cm",
    )


def _repeats(
    table: TextTable, test: str, choice: Choice, length: float | None, width: float | None
) -> Iterator[tuple[Array, Array, Array | None]]:
    """Deformation, load and time of each repeat of a table, in SI units."""
    deformations, loads = _DIMENSIONS[test]
    deformed = needed_columns(table, "deformation", deformations, choice)
    loaded = needed_columns(table, "load", loads, choice)
    timed = find_columns(table, "time", ("time",), choice)
    if len(deformed) != len(loaded):
        got = f"{len(deformed)} of deformation, {len(loaded)} of load"
        fix = "choose one of each by columns={...}"
        raise RecordingError(f"{table.path}, line {table.header_line}", "has columns that make no pairs", got, fix)
    counted = find_columns(table, "repeat", (), choice) if len(deformed) == 1 else []
    for k, (x, y) in enumerate(zip(deformed, loaded, strict=True)):
        deformation, lines = _deformation(x, deformations, test, length)
        load = _load(y, loads, width)
        if len(load) != len(deformation):
            beside = f"{len(deformation)} of the deformation"
            y.refuse(f"has not as many numbers as the {beside}", len(load), "complete the column", lines[-1])
        clock = timed[min(k, len(timed) - 1)] if timed else None
        time = None if clock is None else clock.numbers()[0][: len(load)] * clock.factor(("time",))
        number = counted[0].numbers()[0] if counted else np.zeros(len(load))
        for repeat in dict.fromkeys(number.tolist()):
            own = number == repeat
            if clock is not None and time is not None:
                in_order(clock, time[own], np.array(lines)[own])
            yield deformation[own], load[own], None if time is None else time[own]


def _deformation(column: Column, allowed: Sequence[str], test: str, length: float | None) -> tuple[Array, list[int]]:
    factor = column.factor(allowed)
    values, lines = column.numbers()
    if column.unit is None or column.unit.dimension != "length":
        return values * factor, lines
    if length is None:
        fix = "give the length between the jaws, such as 20cm, or the words before it in the file's first lines"
        raise InputError("length", "is missing, and the deformation is a length", column.unit.text, fix)
    share = values * factor / length
    return np.arctan(share) if test == "shear" else share, lines


def _load(column: Column, allowed: Sequence[str], width: float | None) -> Array:
    factor = column.factor(allowed)
    values, _ = column.numbers()
    if column.unit is None or column.unit.dimension.endswith("per width"):
        return values * factor
    if width is None:
        fix = "give the specimen's width, such as 5cm, or the words before it in the file's first lines"
        raise InputError("width", "is missing, and the load is not per width", column.unit.text, fix)
    return values * factor / width
