"""Which columns of a testing machine's table are deformation, load, time and number of the repeat."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from ..arrays.types import Array
from ..errors import InputError, RecordingError
from .table_text import TextTable
from .units import EXAMPLES, Unit, unit

ROLES = ("deformation", "load", "time", "repeat")
# Stems by which a column is known, in lower case, where its unit does not tell.
_STEMS = {
    "deformation": r"ext|elong|displ|strain|stroke|crosshead|travel|dehn|weg|travers|verläng|winkel|angle|krümm|curv"
    r"|allong|dépl|depl|défor|defor|alarg|desplaz|allung|spost|corsa|伸|変位|ひずみ|角|曲率",
    "load": r"load|force|tension|moment|kraft|last|charge|effort|fuerza|carga|forza|carico|荷重|張力|力",
    "time": r"time|zeit|temps|tiempo|tempo|時間",
    "repeat": r"repeat|specimen|sample|probe|éprouv|eprouv|probeta|muestra|provino|campione|試料|試験片",
}


@dataclass(frozen=True)
class Choice:
    """What the user says of columns: by role their names or numbers from 1, and units.

    Raises:
        InputError: a role or a unit that is not known.
    """

    columns: Mapping[str, str | int]
    units: Mapping[str, str]

    def __post_init__(self) -> None:
        for field, given, roles in (("columns", self.columns, ROLES), ("units", self.units, ROLES[:3])):
            unknown = sorted(set(given) - set(roles))
            if unknown:
                raise InputError(field, "name no role", unknown, f"use {', '.join(roles)}")
        for role, text in self.units.items():
            if unit(text) is None:
                raise InputError(f"units[{role!r}]", "is not a known unit", text, f"use one like {EXAMPLES}")


@dataclass(frozen=True)
class Column:
    """A column with its role."""

    table: TextTable
    index: int
    role: str
    unit: Unit | None

    def numbers(self) -> tuple[Array, list[int]]:
        """The numbers of the column as they are in the file, and their lines."""
        return self.table.column(self.index)

    def factor(self, allowed: Sequence[str]) -> float:
        """SI units per unit of the column.

        Raises:
            RecordingError: its unit is missing, not known, or measures something else.
        """
        if self.unit is None:
            told = self.table.units[self.index]
            problem = f"has a unit that is not known, {told!r}" if told else "has no unit"
            self.refuse(problem, told, f"write one like {EXAMPLES}, or give units={{{self.role!r}: ...}}")
        if self.unit.dimension not in allowed:
            problem = f"is a {self.unit.dimension}, where the {self.role} must be a {' or a '.join(allowed)}"
            self.refuse(problem, self.unit.text, "choose another column, unit or test")
        return self.unit.factor

    def refuse(self, problem: str, got: object, fix: str, line: int | None = None) -> NoReturn:
        self.table.refuse(self.table.header_line if line is None else line, self.index, problem, got, fix)


def find_columns(table: TextTable, role: str, dimensions: Sequence[str], choice: Choice) -> list[Column]:
    """Columns that may have a role: the one that the user chose, else those with such a unit, else those with such a
    name and no unit. Several are repeats side by side.

    Raises:
        RecordingError: several columns that differ in more than a number.
    """
    own = unit(choice.units[role]) if role in choice.units else None
    if role in choice.columns:
        found = [_numbered(table, choice.columns[role])]
    else:
        taken = {_numbered(table, given) for other, given in choice.columns.items() if other != role}
        free = [k for k in range(len(table.names)) if k not in taken]
        known = {k: unit(table.units[k]) for k in free}
        found = [k for k, u in known.items() if u is not None and u.dimension in dimensions]
        named = [k for k in free if re.search(_STEMS[role], table.names[k].lower())]
        found = [k for k in found if k in named] or found or [k for k in named if known[k] is None]
    if len({(re.sub(r"\d+", "", table.names[k]).strip(" _-#."), table.units[k]) for k in found}) > 1:
        names = [table.names[k] for k in found]
        problem, fix = f"has several columns that could be the {role}", f"choose one by columns={{{role!r}: ...}}"
        raise RecordingError(f"{table.path}, line {table.header_line}", problem, names, fix)
    return [Column(table, k, role, own or unit(table.units[k])) for k in found]


def needed_columns(table: TextTable, role: str, dimensions: Sequence[str], choice: Choice) -> list[Column]:
    """The columns of a role, at least one.

    Raises:
        RecordingError: there is none, or one of several cannot be told.
    """
    found = find_columns(table, role, dimensions, choice)
    if not found:
        told = [f"{name} ({u})" if u else name for name, u in zip(table.names, table.units, strict=True)]
        fix = f"name it by columns={{{role!r}: ...}} and its unit by units={{{role!r}: ...}}"
        raise RecordingError(
            f"{table.path}, line {table.header_line}",
            f"has no column that could be the {role}, a {' or a '.join(dimensions)}",
            told,
            fix,
        )
    return found


def in_order(column: Column, times: Array, lines: np.ndarray) -> None:
    """Refuse times that go back."""
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        k = int(back[0]) + 1
        column.refuse("has a time before that of the row above", float(times[k]), "sort the rows", int(lines[k]))


def _numbered(table: TextTable, given: str | int) -> int:
    if isinstance(given, int) and 1 <= given <= len(table.names):
        return given - 1
    if given in table.names:
        return table.names.index(str(given))
    raise InputError(
        "columns", f"name no column of {table.path}", given, f"use one of {list(table.names)}, or its number"
    )
