"""The counts of a Gmsh file and the largest number of a node, before meshio makes tables as long as they say.

A damaged file of a kilobyte may name node 4,000,000,000, for which meshio takes 32 GB: numbers of nodes may have gaps.
One that says that it has more nodes than follow makes meshio take what its memory held before for their numbers.
Section 9.1 of Gmsh's manual (MSH file format) and its appendices on versions 2 and 4.0 describe what is walked here.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import MeshError
from ..files.door import EXPANSION, ROOM
from ..files.memory import in_words

_LONGEST = 80  # characters of the name of a section
_NODE = np.dtype([("number", "<i4"), ("x", "<f8", (3,))])  # of binary files before 4.1
_CORNERS = {
    1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10, 12: 27, 13: 18, 14: 14, 15: 1, 16: 8, 17: 20,
    18: 15, 19: 13,
}  # fmt: skip
"""Nodes of an element, by Gmsh's number of its kind: all of first and of second order."""


def check_counts(path: Path) -> None:
    """Refuse a file that holds less than its counts say, or whose nodes have numbers too large for a table.

    Raises:
        MeshError: a count is not what follows it, an element has an order above 2, or the table of the nodes would
            take more than `ROOM` and more than `EXPANSION` times the size of the file.
    """
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # older NumPy only warns of text that is no number
        version, text, size = _head(path, file)
        _skip_section(file, "MeshFormat")
        form = _Form(path, file, path.stat().st_size, version, text, size)
        for line in iter(file.readline, b""):
            name = line.decode(errors="replace").strip()
            if name and (name[0] != "$" or len(name) > _LONGEST):  # meshio colors names in quadratic time
                raise form.wrong("has something else where a section begins", repr(name[:_LONGEST]))
            if name:
                _check(form, name[1:].strip())
                _skip_section(file, name[1:].strip())


def _skip_section(file: BinaryIO, section: str) -> None:
    for line in file:
        if b"$End" in line and line.decode(errors="replace").strip() == f"$End{section}":
            return


def _check(form: _Form, section: str) -> None:
    if section == "Nodes":
        largest = form.largest_node()
        if 8 * largest > max(ROOM, EXPANSION * form.size):
            fix = "number the nodes of the mesh anew, or export it again if the file is damaged"
            words = f"have numbers whose table takes {in_words(8 * largest)}"
            raise MeshError(f"{form.path}: nodes", words, largest, fix)
    elif section == "Elements":
        form.check_elements()
    elif section in ("NodeData", "ElementData"):
        form.check_values()


def _head(path: Path, file: BinaryIO) -> tuple[str, bool, int]:
    """The version, whether all is text, and the bytes of a count in version 4.1."""
    line = file.readline().strip()
    while line == b"$Comments":
        while line and line.strip() != b"$EndComments":
            line = file.readline()
        line = file.readline().strip()
    words = file.readline().decode(errors="replace").split()
    if line != b"$MeshFormat" or len(words) < 3 or words[1] not in ("0", "1") or words[2] not in ("4", "8"):
        fix = "check that it is a Gmsh file, or export it again if it is damaged"
        raise MeshError(str(path), "does not begin as Gmsh files do", " ".join(words)[:80], fix)
    return words[0], words[1] == "0", int(words[2])


@dataclass(frozen=True)
class _Form:
    """A file that is open at a section, and how its version writes numbers."""

    path: Path
    file: BinaryIO
    size: int
    version: str
    text: bool
    bytes_of_count: int

    @property
    def old(self) -> bool:
        return self.version.split(".")[0] == "2"

    @property
    def records(self) -> bool:
        """Whether the number of a node stands beside its position."""
        return self.old or self.version == "4.0"

    @property
    def count(self) -> np.dtype:
        return np.dtype("<u8" if self.records else f"<u{self.bytes_of_count}")

    def numbers(self, kind: str | np.dtype, count: int) -> np.ndarray:
        """The numbers that follow, as many as the file says."""
        if 0 <= count <= self.size - self.file.tell():  # each takes a byte at least
            with contextlib.suppress(ValueError):  # of text that is no number
                found = np.fromfile(self.file, kind, count, sep=" " if self.text else "")
                if len(found) == count:
                    return found
        raise self.wrong("holds less than its counts say", f"{count} numbers")

    def line(self) -> int:
        """The count that the next line is."""
        words = self.file.readline(80)
        try:
            return int(words)
        except ValueError:
            raise self.wrong("has no count where one belongs", repr(words)) from None

    def wrong(self, words: str, given: object) -> MeshError:
        return MeshError(str(self.path), words, given, "export it again")

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Of version 4: the kind and the count of each block. The section begins with the sum of the counts.

        The kind is of elements; of nodes it says whether they have coordinates on curves and surfaces.
        """
        blocks, total = (int(n) for n in self.numbers(self.count, 2 if self.records else 4)[:2])
        if blocks > self.size:
            raise self.wrong("holds less than its counts say", f"{blocks} blocks")
        found = 0
        for _ in range(blocks):
            kind = int(self.numbers("<i4", 3)[2])
            count = int(self.numbers(self.count, 1)[0])
            yield kind, count
            found += count
        if found != total:
            raise self.wrong("does not hold as many nodes or elements as it says", f"{found} instead of {total}")

    def largest_node(self) -> int:
        blocks = iter([(0, self.line())]) if self.old else self.blocks()
        return max((self._largest_of(count, bool(kind)) for kind, count in blocks), default=0)

    def _largest_of(self, count: int, parameters: bool) -> int:
        if parameters:
            fix = "export it with Mesh.SaveParametric = 0"
            raise MeshError(str(self.path), "has nodes with coordinates on curves and surfaces", count, fix)
        if not self.records:
            found = self.numbers(self.count, count)
            self.numbers("<f8", 3 * count)
        elif self.text:
            found = self.numbers("<f8", 4 * count)[::4]
            if not (np.abs(found) < 2**63).all():
                raise self.wrong("has nodes without a number", "not a number, or too large")
        else:
            found = self.numbers(_NODE, count)["number"]
        return int(found.max(initial=0))

    def check_elements(self) -> None:
        if self.old:
            self._check_old_elements()
            return
        for kind, count in self.blocks():
            self.numbers("<i4" if self.records else self.count, count * (1 + self._corners(kind)))

    def _check_old_elements(self) -> None:
        """In text every element has a line of its own, and meshio makes nothing by their count."""
        total, found = self.line(), 0
        while not self.text and found < total:
            kind, count, tags = (int(n) for n in self.numbers("<i4", 3))
            if tags < 0:
                raise self.wrong("has elements with a negative count of tags", tags)
            self.numbers("<i4", count * (1 + tags + self._corners(kind)))
            found += count

    def _corners(self, kind: int) -> int:
        if kind not in _CORNERS:
            raise self.wrong("has elements of a kind that is not read", kind)
        return _CORNERS[kind]

    def check_values(self) -> None:
        """Values at nodes or elements, of which meshio counts to their number: words, numbers, and counts before."""
        for _ in range(2):
            for _ in range(min(self.line(), self.size)):
                self.file.readline()
        counts = [self.line() for _ in range(min(self.line(), self.size))]
        if any(count > self.size for count in counts[1:3]):
            raise self.wrong("holds less than its counts say", max(counts[1:3]))
