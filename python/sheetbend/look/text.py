"""TOML text with comments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

WIDTH = 110
LARGE = 100.0  # from which on four decimals are finer than six digits


def value(given: Any) -> str:
    """A value as TOML; floats rounded to six digits, or to four decimals where that is finer, as times of a clock that
    began long ago need it."""
    if isinstance(given, bool):
        return "true" if given else "false"
    if isinstance(given, str):
        return '"' + given.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(given, int | np.integer):
        return str(int(given))
    if isinstance(given, float | np.floating):
        number = float(given)
        text = f"{number:.6g}" if abs(number) < LARGE else repr(round(number, 4))
        return text if any(c in text for c in ".en") else f"{text}.0"
    if isinstance(given, Mapping):
        return "{ " + ", ".join(f"{key(k)} = {value(v)}" for k, v in given.items()) + " }"
    return "[" + ", ".join(value(v) for v in given) + "]"


def key(name: str) -> str:
    """A bare key where it can be one, else quoted."""
    return name if name and all(c.isascii() and (c.isalnum() or c in "_-") for c in name) else value(name)


def table(header: str, entries: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> list[str]:
    """Lines of a table: entries that are None are left out, notes stand behind or above their key."""
    lines = ["", header]
    for name, given in entries.items():
        if given is None:
            continue
        if isinstance(given, list) and given and all(isinstance(v, Mapping) for v in given):
            lines += [f"{key(name)} = [", *(f"  {value(v)}," for v in given), "]"]
            continue
        line, note = f"{key(name)} = {value(given)}", (notes or {}).get(name, "")
        if note and len(line) + len(note) + 4 > WIDTH:
            lines += [*comment(note), line]
        else:
            lines.append(f"{line}  # {note}" if note else line)
    return lines


def comment(text: str) -> list[str]:
    """A comment, wrapped."""
    lines, line = [], "#"
    for word in text.split():
        if len(line) + 1 + len(word) > WIDTH and line != "#":
            lines.append(line)
            line = "#"
        line += f" {word}"
    return [*lines, line]


def joined(names: Iterable[str], most: int = 8) -> str:
    """Names for a sentence; of many the first ones and their number."""
    every = list(names)
    return ", ".join(every) if len(every) <= most else f"{', '.join(every[:3])}, ... {every[-1]} ({len(every)})"
