"""JSON from files that anybody may have written: small, not nested deeply, and finite where that is wanted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError
from .door import bounded_bytes, reading

LARGEST = 2**25
"""Bytes of a JSON file."""
DEEPEST = 50
"""Levels of lists and objects in it."""


def json_content(path: Path, error: type[InputError], finite: bool = False) -> Any:
    """The content of a JSON file.

    Args:
        finite: refuse NaN and Infinity, which Python writes and JSON does not know.

    Raises:
        InputError: of the class `error`: it cannot be read, is no JSON, or is too large or nested too deeply.
    """
    with reading(path, error):
        text = bounded_bytes(path, LARGEST, error).decode("utf-8-sig")
        try:
            content = json.loads(text, parse_constant=_refuse if finite else None)
        except ValueError as problem:
            raise error(str(path), "is malformed JSON", str(problem), "mend it, or move it away") from problem
        check_depth(path, content, error)
    return content


def check_depth(path: Path, content: Any, error: type[InputError]) -> None:
    """Refuse lists and tables in more than `DEEPEST` levels, which no file of ours needs and recursion cannot walk.

    Raises:
        InputError: of the class `error`.
    """
    level = [content]
    for _ in range(DEEPEST + 1):
        level = [
            part
            for whole in level
            if isinstance(whole, dict | list)
            for part in (whole.values() if isinstance(whole, dict) else whole)
            if isinstance(part, dict | list)
        ]
        if not level:
            return
    raise error(str(path), "is nested too deeply", f"more than {DEEPEST} levels", "write it without so many brackets")


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a JSON number")
