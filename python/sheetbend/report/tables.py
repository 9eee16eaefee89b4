"""Titled tables with notes, as plain text and for rich terminals: the parts that reports are made of."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..optional import require

WIDTH = 100
"""Columns of a report."""

_COLORS = {
    "identified": "green",
    "weak": "yellow",
    "one-sided": "yellow",
    "at a bound": "red",
    "at its floor": "red",
    "not identifiable": "red",
    "rough": "bold red",
    "no minimum": "bold red",
    "doubtful": "bold red",
}


@dataclass(frozen=True)
class Section:
    """A titled part of the report: a table, then notes (label, sentence)."""

    title: str
    headers: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    notes: tuple[tuple[str, str], ...] = ()


def plain_section(section: Section) -> list[str]:
    """The lines of a part: its title, its table, its notes wrapped at `WIDTH` columns."""
    lines = [section.title, "-" * len(section.title), *_table(section)]
    if section.rows and section.notes:
        lines.append("")
    return lines + _notes(section.notes)


def rich_section(section: Section) -> list[object]:
    """The section as rich renderables.

    Raises:
        MissingExtraError: rich is not installed.
    """
    text = require("rich.text", "cli").Text
    padding = require("rich.padding", "cli").Padding
    parts: list[object] = [text(section.title, style="bold")]
    if section.rows:
        parts.append(padding(_rich_table(section), (0, 0, 0, 2)))
    for label, sentence in section.notes:
        line = text.assemble((f"{label}: " if label else "", "cyan"), sentence)
        parts.append(padding(line, (0, 0, 0, 2)))
    return parts


def wide(lines: Sequence[tuple[str, ...]]) -> bool:
    """Whether a table of these lines, its headers first, is wider than a report."""
    return sum(2 + max(map(len, column)) for column in zip(*lines, strict=True)) > WIDTH


def _table(section: Section) -> list[str]:
    if not section.rows:
        return []
    left = flush_left(section)
    lines = (section.headers, *section.rows)
    widths = [max(len(line[column]) for line in lines) for column in range(len(section.headers))]
    aligned = [
        "  ".join(
            cell.ljust(size) if flush else cell.rjust(size)
            for cell, size, flush in zip(line, widths, left, strict=True)
        )
        for line in lines
    ]
    return [f"  {line}".rstrip() for line in aligned]


def flush_left(section: Section) -> list[bool]:
    """Whether each column is flush left, as words are; numbers are flush right."""
    words = {
        "parameter",
        "with",
        "recording",
        "unit",
        "verdict",
        "step",
        "kept",
        "rope",
        "given",
        "change",
        "fit",
        "key",
    }
    words |= {"number", "test", "along"}  # of fabrics
    return [header in words for header in section.headers]


def _notes(notes: Iterable[tuple[str, str]]) -> list[str]:
    lines: list[str] = []
    for label, sentence in notes:
        text = f"{label}: {sentence}" if label else sentence
        lines += textwrap.wrap(
            text,
            WIDTH,
            initial_indent="  ",
            subsequent_indent="    ",
            break_on_hyphens=False,
            break_long_words=False,
        )
    return lines


def _rich_table(section: Section) -> object:
    box = require("rich.box", "cli")
    table = require("rich.table", "cli").Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, header_style="dim")
    text = require("rich.text", "cli").Text
    for header, flush in zip(section.headers, flush_left(section), strict=True):
        table.add_column(header, justify="left" if flush else "right", no_wrap=header != "verdict")
    for row in section.rows:
        table.add_row(*(text(cell, style=_COLORS.get(cell, "")) for cell in row))
    return table
