"""The files that a configuration names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

KEYS = ("file", "cloud", "driven_motion", "fabric_file")
"""Keys with the path of a file, in any table; `tools` of a recording has more, by the names of tools."""


def named_files(content: Any) -> Iterator[tuple[dict[str, Any], str]]:
    """Every table of a configuration, as plain data, with a key whose value is the path of a file, and this key."""
    if isinstance(content, list):
        for part in content:
            yield from named_files(part)
    elif isinstance(content, dict):
        for key, value in content.items():
            if key in KEYS and isinstance(value, str):
                yield content, key
            elif key == "tools" and isinstance(value, dict):
                yield from ((value, tool) for tool in value)
            else:
                yield from named_files(value)
