"""Changes of files, made by chance: bytes, members of archives, and values of trees (TOML, JSON)."""

from __future__ import annotations

import copy
import json
import random
import re
import sqlite3
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from contextlib import closing
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tomli_w

LARGEST = 2**16  # bytes of a mutated file


NUMBERS = [
    "-1", "0", "1", "2", "3", "255", "65535", "1000003", "2147483648", "-2147483649", "9223372036854775808", "1e18",
    "1e308", "1e309", "1e-308", "1e-400", "-0.0", "nan", "inf", "-inf", "0x10", "1_0", "1,5", ".5", "5.", "1e", "1e+",
    "\u0663", "\u00bd", "9" * 30, "9" * 5000, "0." + "0" * 400 + "1",
]  # fmt: skip
WORDS = [
    b"\x00", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\n", b"\r", b"\r\n", b"\t", b";", b",", b'"', b"'", b"\\",
    b"{", b"}", b"[", b"]", b"(", b")", b"/", b"../", b"#", b"=", b":", b".", b"..", b"\x1b[2J", b"[/red]",
    b"\xe2\x80\xae", b"\xc2\xb5", b"null", b"true", b"time", b"marker", b"x", b"_x", b"name", b"units", b"mm", b"e",
    b"-", b" ", b"K\x01", b"\x85", b"]\x94", b"\x7f\xff\xff\xff", b"\x80", b"\xff" * 8, b"\x00" * 8,
]  # fmt: skip
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def mutated(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    """One to four changes anywhere."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        content = rng.choice(CHANGES)(rng, content, others)[:LARGEST]
    return content


def _span(rng: random.Random, content: bytes) -> tuple[int, int]:
    first = rng.randrange(len(content) + 1)
    return first, min(len(content), first + min(int(rng.expovariate(1 / 30)) + 1, len(content)))


def _flip(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.randint(1, 8)):
        if changed:
            changed[rng.randrange(len(changed))] = rng.choice((rng.randrange(256), 0, 255, 127, 128))
    return bytes(changed)


def _cut(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def _drop(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    first, last = _span(rng, content)
    return content[:first] + content[last:]


def _insert(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(WORDS) * rng.choice((1, 1, 1, 2, 40, 3000)) + content[at:]


def _splice(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    other = rng.choice(others)
    (a, b), (c, d) = _span(rng, content), _span(rng, other)
    return content[:a] + other[c:d] + content[b:]


def _repeat(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    first, last = _span(rng, content)
    return content[:last] + content[first:last] * rng.choice((1, 2, 100, 5000)) + content[last:]


def _renumber(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    one = rng.choice(found)
    return content[: one.start()] + rng.choice(NUMBERS).encode() + content[one.end() :]


def _swap_lines(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    lines = content.split(b"\n")
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


CHANGES = (_flip, _cut, _drop, _insert, _splice, _repeat, _renumber, _renumber, _swap_lines)


def packed(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    """An archive changed outside or, put together again with right checksums, inside."""
    if rng.random() < 0.4:
        return mutated(rng, content, others)
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except (zipfile.BadZipFile, OSError):
        return mutated(rng, content, others)
    name = rng.choice(sorted(members))
    members[name] = mutated(rng, members[name], list(members.values()))
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, inside in members.items():
            archive.writestr(each, inside)
    return stream.getvalue()


def database(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    """An SQLite file changed in its bytes, in a value, or in its tables."""
    if rng.random() < 0.5:
        return mutated(rng, content, others)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "changed"
        path.write_bytes(content)
        with closing(sqlite3.connect(path, isolation_level=None)) as opened:
            tables = [name for (name,) in opened.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            table = rng.choice(tables)
            columns = [row[1] for row in opened.execute(f"PRAGMA table_info({table})")]
            column, kind = rng.choice(columns), rng.random()
            rows = opened.execute(f"SELECT rowid, {column} FROM {table}").fetchall()
            if kind < 0.8 and rows:
                row, value = rng.choice(rows)
                raw = value if isinstance(value, bytes) else str(value).encode()
                odd = (mutated(rng, raw, [raw]), raw[:-1], None, -1, 1e300, "x", b"")
                opened.execute(f"UPDATE OR IGNORE {table} SET {column} = ? WHERE rowid = ?", (rng.choice(odd), row))
            elif kind < 0.9:
                opened.execute(f"ALTER TABLE {table} RENAME COLUMN {column} TO other")
            else:
                opened.execute(f"ALTER TABLE {table} RENAME TO other")
                endless = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n)"
                picked = ", ".join(f"k AS {name}" for name in columns)
                opened.execute(f"CREATE VIEW {table} AS {endless} SELECT {picked} FROM n")
        return path.read_bytes()


ODD: tuple[Any, ...] = (
    None, True, False, -1, 0, 1, 2, 3, 7, 100, 10**5, 2**31, 2**63, 10**18, -(2**63), 1e-300, 1e-9, 0.5, 1e3, 1e9,
    1e300, float("nan"), float("inf"), "", "..", "a/b", "rope", "rope:0", "rope:999", "cloth:corners:0", "x", "\x1b",
    "nul", "a" * 300, [], [0], [1, 2, 3], [0.0, 0.0, 0.0], [[]], {}, {"a": 1}, {"name": "x"},
)  # fmt: skip


def tree(load: Callable[[bytes], Any], dump: Callable[[Any], bytes]) -> Callable[..., bytes]:
    """Changes the text, or a value of the tree that it holds."""

    def change(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
        if rng.random() < 0.4:
            return mutated(rng, content, others)
        whole = load(content)
        for _ in range(rng.randint(1, 3)):
            _graft(rng, whole, load(rng.choice(others)))
        try:
            return dump(whole)
        except (TypeError, ValueError):  # what TOML does not hold
            return mutated(rng, content, others)

    return change


def _graft(rng: random.Random, whole: Any, other: Any) -> None:
    """Replace, drop or add an entry somewhere in a tree, by an odd value or one of another tree."""
    inside = [part for part in _branches(whole) if part]
    if not inside:
        return
    part = rng.choice(inside)
    key = rng.choice(list(part) if isinstance(part, dict) else range(len(part)))
    value = copy.deepcopy(rng.choice(ODD)) if rng.random() < 0.7 else rng.choice(list(_branches(other)))
    kind = rng.random()
    if kind < 0.15:
        del part[key]
    elif kind < 0.3 and isinstance(part, dict):
        part[rng.choice(("name", "h", "file", "a", "", "\x1b", *part))] = value
    elif kind < 0.3:
        part.insert(key, value)
    else:
        part[key] = value


def _branches(part: Any) -> Iterator[Any]:
    if isinstance(part, dict | list):
        yield part
        for inside in part.values() if isinstance(part, dict) else part:
            yield from _branches(inside)


toml_tree = tree(lambda content: tomllib.loads(content.decode()), lambda whole: tomli_w.dumps(whole).encode())
json_tree = tree(json.loads, lambda whole: json.dumps(whole).encode())
