"""The header of a table that a spreadsheet wrote: a title may stand above it, and it may take two or three rows.

    Test 7: cable in a vise;;;;;;            not read
    ;tip;;;weight;;                          names of markers, each above its x, y and z
    Time;X;Y;Z;X;Y;Z                         the header
    ms;mm;mm;mm;mm;mm;mm                     units

The header is the first row that begins with the name of a time and has numbers below it, or below a row of units. A row
directly above another one that begins so is none, such as the time of day.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from ...files.units import METERS
from . import clock, columns
from .cells import Row

MOST = 30
"""Rows above the header."""
_NUMBER = re.compile(r'["\s]*[-+]?[.,]?\d')  # a line that begins with one
_BARE = re.compile(r"[\[(]?\s*([^\s\[\]()]*)\s*[\])]?")
_TIMES = {"s", *clock.PER_SECOND}


def first(rows: Sequence[tuple[int, str]], begins: Callable[[str], bool]) -> int:
    """Which of the lines is the header; the first one where none is.

    Args:
        rows: numbers and texts of lines.
        begins: whether a line begins as a header does.
    """
    for k, (_, line) in enumerate(rows[:MOST]):
        below = [text for _, text in rows[k + 1 : k + 3]]
        if below and begins(below[0]):  # such as the time of day above the header
            continue
        if begins(line) and any(map(_NUMBER.match, below)):
            return k
    return 0


def whole(above: Row | None, rows: list[Row]) -> list[Row]:
    """The rows with one header, that has the markers' names of the row above it and the units of the row
    below. Units that contradict it are left below, where they are no numbers."""
    (line, header), *below = rows
    if above is not None:
        header = _with_names(above[1], header)
    if below:
        units = _units(below[0][1])
        if units is not None and len(units) == len(header) and all(map(_agree, header, units)):
            header = [_with_unit(name, own) for name, own in zip(header, units, strict=True)]
            below = below[1:]
    return [(line, header), *below]


def _with_names(above: list[str], header: list[str]) -> list[str]:
    """A header of times and bare axes, with the names that stand above every first axis."""
    axes = [columns.without_unit(name)[0].lower() for name in header[1:]]
    markers = range(1, len(header), 3)
    if len(header) < 4 or axes != list(columns.AXES) * len(markers) or len(above) != len(header):
        return header
    names = [above[k] for k in markers]
    if not all(names) or any(above[k + i] not in ("", above[k]) for k in markers for i in (1, 2)):
        return header
    return [header[0], *(f"{names[k // 3]} {name}" for k, name in enumerate(header[1:]))]


def _unit_above(name: str, own: str) -> str | None:
    """The unit that the name of a column has, above the one that stands below it."""
    if clock.unit(name) is not None and clock.unit(f"{name} [{own}]") is None:
        return clock.unit(name)
    return columns.without_unit(name)[1]


def _agree(name: str, own: str) -> bool:
    """Whether the name of a column has no unit, or that which stands below it."""
    return not own or _unit_above(name, own) in (None, own)


def _with_unit(name: str, own: str) -> str:
    """The name of a column with its unit, unless it has one."""
    return name if not own or _unit_above(name, own) is not None else f"{name} [{own}]"


def _units(cells: list[str]) -> list[str] | None:
    """Units of a row that holds nothing else; None of another row."""
    bare = [match[1].lower() if (match := _BARE.fullmatch(cell)) else "?" for cell in cells]
    places = bare[1:]
    return bare if bare[0] in _TIMES | {""} and any(places) and set(places) <= {"", *METERS} else None
