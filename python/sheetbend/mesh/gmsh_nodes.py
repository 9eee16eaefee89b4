"""The largest number of a node in a Gmsh file, before meshio makes a table of that length.

Numbers of nodes may have gaps, so a damaged file of a kilobyte may name node 4,000,000,000, for which meshio takes
32 GB. Section 9.1 of Gmsh's manual (MSH file format) and its appendix on version 2 describe the section of nodes.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import MeshError
from ..files.door import EXPANSION, ROOM
from ..files.memory import in_words

_HEAD = re.compile(rb"\$MeshFormat\s+([0-9.]+)\s+([01])")
_NODES = re.compile(rb"\$Nodes[ \t\r]*\n")
_NODE = np.dtype([("number", "<i4"), ("x", "<f8", (3,))])  # of versions before 4.1
_DIGITS = 18  # no number of a node is longer


def check_nodes(path: Path) -> None:
    """Refuse a file whose nodes have numbers, or are as many, that their table would not fit the file.

    Raises:
        MeshError: the table would take more than `ROOM`, and more than `EXPANSION` times the size of the file.
    """
    content = path.read_bytes()
    largest = _largest(content)
    if 8 * largest > max(ROOM, EXPANSION * len(content)):
        fix = "number the nodes of the mesh anew, or export it again if the file is damaged"
        raise MeshError(f"{path}: nodes", f"have numbers whose table takes {in_words(8 * largest)}", largest, fix)


def _largest(content: bytes) -> int:
    head, section = _HEAD.search(content), _NODES.search(content)
    if head is None or section is None:
        return 0
    at = section.end()
    if head[2] == b"0":
        end = content.find(b"$EndNodes", at)
        firsts = (
            line.split(None, 1)[0] for line in content[at : end if end > 0 else None].splitlines() if line.strip()
        )
        return max((int(first[:_DIGITS]) for first in firsts if first.isdigit()), default=0)
    if head[1].startswith(b"2"):
        count = content[at : content.find(b"\n", at)]
        return int(count[:_DIGITS]) if count.strip().isdigit() else 0
    return _in_blocks(content, at, in_records=head[1].startswith(b"4.0"))


def _in_blocks(content: bytes, at: int, in_records: bool) -> int:
    """Of a binary file of version 4: the head of the section, then blocks of nodes with a head each."""
    blocks = _numbers(content, at, "<u8", 1)
    at += 8 * (2 if in_records else 4)
    largest = 0
    for _ in range(min(blocks, len(content))):
        count = _numbers(content, at + 12, "<u8", 1)
        at += 20
        if at + 8 * count > len(content):
            break
        largest = max(largest, _numbers(content, at, _NODE if in_records else "<u8", count))
        at += count * (_NODE.itemsize if in_records else 32)
    return largest


def _numbers(content: bytes, at: int, of: str | np.dtype, count: int) -> int:
    """The largest of some numbers from a place on, as far as the file goes."""
    kind = np.dtype(of)
    there = max(0, min(count, (len(content) - at) // kind.itemsize))
    found = np.frombuffer(content, kind, there, min(at, len(content)))
    return int((found["number"] if kind.names else found).max(initial=0))
