"""The order of files whose names hold numbers."""

from __future__ import annotations

import re
from pathlib import Path


def by_number(file: Path) -> list[tuple[int, str]]:
    """A key for sorting: digits as numbers (9 before 10), all else as text."""
    parts = re.findall(r"\d+|\D+", file.as_posix())
    return [(int(part), "") if part.isascii() and part.isdigit() else (-1, part) for part in parts]
