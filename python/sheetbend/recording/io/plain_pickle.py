"""Pickles of arrays or lists of numbers, read without running anything that the file names.

A pickle is a program, and `pickle.load` calls whatever it names. Here a machine of its own walks the program: it knows
the instructions that arrays and lists of numbers need, a dict of them by name, and of names what NumPy writes into
pickles of its arrays (`pickled_arrays`). All else is refused by name. A program cannot ask for more than it is long:
lists go no deeper than arrays, lists that stand in another one stay as they are, and instructions are counted.
"""

from __future__ import annotations

import math
import pickletools
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import RecordingError
from ...files.door import check_room
from .pickled_arrays import KNOWN, Array, NoNumberError, Number

MOST_INSTRUCTIONS = 1_000_000
"""Of a pickle; a number in a list takes one, an array some 20."""
DEEPEST = 3
"""Levels of lists: frames, rows x, y and z, numbers."""

_ATOMS = frozenset(
    [
        "BINFLOAT",
        "FLOAT",
        "BININT",
        "BININT1",
        "BININT2",
        "INT",
        "LONG",
        "LONG1",
        "NEWTRUE",
        "NEWFALSE",
        "NONE",
        "UNICODE",
        "BINUNICODE",
        "SHORT_BINUNICODE",
        "BINUNICODE8",
        "BINBYTES",
        "SHORT_BINBYTES",
        "BINBYTES8",
        "BYTEARRAY8",
    ]
)
_CONSTANTS = {"NEWTRUE": True, "NEWFALSE": False, "NONE": None}
_LARGEST = 2**63  # of whole numbers
# What a stream of wrong bytes can raise, in the machine and in the stand-ins.
_DAMAGE = (AttributeError, LookupError, OverflowError, TypeError, ValueError)
_AGAIN = "export or copy the file again"


Content = NDArray[Any] | list[NDArray[Any]]


def arrays(path: Path, needed: Collection[str] = ()) -> Content | dict[str, Content]:
    """The array that the pickle at `path` holds, or its list (or tuple) of arrays, or of lists of rows of numbers, or a
    dict of these by name; of any protocol. An entry of a list that is None is an array without numbers, and a number
    that is None is NaN. What else stands in a dict is left out.

    Args:
        path: of the pickle.
        needed: names of what must be arrays if a dict has them, in lower case.

    Raises:
        RecordingError: the file is no pickle or a damaged one, names anything but NumPy's plain arrays (which is then
            named), holds anything but arrays or lists of them, or more than `MOST_INSTRUCTIONS`.
    """
    try:
        value = _Machine(path).run(path.read_bytes())
        return _by_name(path, value, needed) if isinstance(value, _Named) else _content(path, "the pickle", value)
    except NoNumberError as error:
        fix = "store plain numbers, such as float64"
        raise RecordingError(str(path), "holds an array that is not of real numbers", str(error), fix) from None
    except RecordingError:
        raise
    except _DAMAGE as error:
        raise RecordingError(str(path), "is not a pickle, or a damaged one", str(error), _AGAIN) from error


def _content(path: Path, what: str, value: object) -> Content:
    return _entries(path, value) if isinstance(value, _Items) else _values(path, what, value)


def _by_name(path: Path, named: _Named, needed: Collection[str]) -> dict[str, Content]:
    found: dict[str, Content] = {}
    for name, entry in named.entries.items():
        number = _number(entry)
        try:
            found[name] = _content(path, name, entry) if number is None else np.array(number)
        except (RecordingError, NoNumberError):
            if name.lower() in needed:
                raise  # others may be texts that describe the arrays
    return found


def _entries(path: Path, whole: _Items) -> list[NDArray[Any]]:
    found: dict[int, NDArray[Any]] = {}  # a list that is named again is converted once
    numbers = 0
    for i, entry in enumerate(whole):
        if id(entry) not in found:
            if isinstance(entry, _Items):
                numbers += sum(max(len(row), 1) if isinstance(row, _Items) else 1 for row in entry)
                check_room(path, f"{numbers} numbers up to entry {i}", 8 * numbers)
            found[id(entry)] = np.zeros(0) if entry is None else _values(path, f"entry {i}", entry)
    return [found[id(entry)] for entry in whole]


def _values(path: Path, what: str, value: object) -> NDArray[Any]:
    if isinstance(value, Array) and value.values is not None:
        return value.values
    if isinstance(value, Array):
        raise RecordingError(f"{path}: {what}", "is an array without numbers", "nothing", _AGAIN)
    if isinstance(value, _Items):
        rows = [[_number(n) for n in row] if isinstance(row, _Items) else _number(row) for row in value]
        ragged = len({len(row) if isinstance(row, list) else -1 for row in rows}) > 1
        if not ragged and not any(n is None for row in rows for n in (row if isinstance(row, list) else [row])):
            return np.array(rows, dtype=np.float64)
    fix = "store one array, or a list of arrays or of rows of numbers"
    raise RecordingError(f"{path}: {what}", "must be a NumPy array of numbers", _kind(value), fix)


def _number(value: object) -> float | None:
    if isinstance(value, Array) and value.values is not None and value.values.shape == ():
        return float(value.values)
    if value is None:
        return math.nan
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _kind(value: object) -> str:
    names = {_Items: "list", _Named: "dict"}
    return names.get(type(value), type(value).__name__.lower())


class _Items(list[Any]):
    """A list or a tuple of the program. Once it stands in another one it is closed, so that none holds itself."""

    __slots__ = ("closed", "depth")

    def __init__(self, items: Iterable[Any] = ()) -> None:
        super().__init__()
        self.depth, self.closed = 1, False
        self.take(items)

    def take(self, items: Iterable[Any]) -> None:
        """Append items."""
        for item in items:
            if isinstance(item, _Items):
                item.closed = True
                self.depth = max(self.depth, item.depth + 1)
            self.append(item)
        if self.closed:
            raise ValueError("a list that grows after it was put into another one")
        if self.depth > DEEPEST:
            raise ValueError(
                f"lists in more than {DEEPEST} levels: a file holds one recording, frames of rows of numbers"
            )


class _Named:
    """A dict of the program, by names."""

    __slots__ = ("entries",)

    def __init__(self, pairs: Iterable[Any] = ()) -> None:
        self.entries: dict[str, Any] = {}
        self.take(pairs)

    def take(self, pairs: Iterable[Any]) -> None:
        """Set entries: names and values in turn."""
        items = list(pairs)
        for name, value in zip(items[::2], items[1::2], strict=True):
            if not isinstance(name, str):
                raise TypeError(f"a dict with a {_kind(name)} as a key, where a name belongs")
            if isinstance(value, _Items):
                value.closed = True
            self.entries[name] = value


class _Machine:
    """The stack, the marks in it, and what the program put aside under numbers."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.stack: list[Any] = []
        self.marks: list[int] = []
        self.memo: dict[int, Any] = {}

    def run(self, content: bytes) -> Any:
        """What the program leaves on the stack."""
        end = 0
        for count, (instruction, argument, position) in enumerate(pickletools.genops(content)):
            if count >= MOST_INSTRUCTIONS:
                fix = "store arrays instead of lists of numbers"
                problem = f"holds a pickle of more than {MOST_INSTRUCTIONS:,} instructions"
                raise RecordingError(str(self.path), problem, f"{len(content)} bytes", fix)
            self.step(instruction.name, argument, len(content))
            end = (position or 0) + 1
        if end < len(content):
            fix = "store everything in one list and pickle that once"
            raise RecordingError(
                str(self.path), "goes on after the end of its pickle", f"{len(content) - end} bytes", fix
            )
        (value,) = self.stack
        return value

    def step(self, name: str, argument: Any, size: int) -> None:
        """Do an instruction of a program of `size` bytes."""
        if name in _ATOMS:
            value = _CONSTANTS.get(name, argument)
            if isinstance(value, int) and abs(value) > _LARGEST:
                raise ValueError("a whole number of more than 64 bits")
            self.stack.append(value)
            return
        match name:
            case "MEMOIZE":
                self.memo[len(self.memo)] = self.stack[-1]
            case "PUT" | "BINPUT" | "LONG_BINPUT":
                if argument >= size:
                    raise ValueError(f"memo index {argument} in {size} bytes")
                self.memo[argument] = self.stack[-1]
            case "GET" | "BINGET" | "LONG_BINGET":
                self.stack.append(self.memo[argument])
            case "MARK":
                self.marks.append(len(self.stack))
            case "EMPTY_LIST" | "EMPTY_TUPLE":
                self.stack.append(_Items())
            case "LIST" | "TUPLE":
                self.stack.append(_Items(self.to_mark()))
            case "TUPLE1" | "TUPLE2" | "TUPLE3":
                self.stack.append(_Items(self.last(int(name[-1]))))
            case "APPEND":
                (item,) = self.last(1)
                self.grow([item])
            case "APPENDS":
                self.grow(self.to_mark())
            case "EMPTY_DICT":
                self.stack.append(_Named())
            case "DICT":
                self.stack.append(_Named(self.to_mark()))
            case "SETITEM":
                self.grow(self.last(2), _Named)
            case "SETITEMS":
                self.grow(self.to_mark(), _Named)
            case "GLOBAL":
                self.stack.append(self.named(argument.replace(" ", ".", 1)))
            case "INST":
                self.named(argument.replace(" ", ".", 1))
                self.refuse(name, argument)
            case "STACK_GLOBAL":
                module, attribute = self.last(2)
                self.stack.append(self.named(f"{module}.{attribute}"))
            case "REDUCE":
                function, arguments = self.last(2)
                if not (function in KNOWN.values() and isinstance(arguments, _Items)):
                    raise TypeError(f"a call of a {_kind(function)}")
                self.stack.append(function(*arguments))
            case "BUILD":
                (state,) = self.last(1)
                if not isinstance(self.stack[-1], Array | Number):
                    raise TypeError(f"a state of a {_kind(self.stack[-1])}")
                self.stack[-1].set_state(state)
            case "PROTO":
                if argument > 5:
                    raise ValueError(f"protocol {argument}")
            case "FRAME" | "STOP":
                pass
            case _:
                self.refuse(name, argument)

    def to_mark(self) -> list[Any]:
        """Take everything above the last mark off the stack."""
        at = self.marks.pop()
        items = self.stack[at:]
        del self.stack[at:]
        return items

    def last(self, count: int) -> list[Any]:
        """Take so many from the top of the stack."""
        if len(self.stack) < count + (self.marks[-1] if self.marks else 0):
            raise IndexError("an instruction without what it works on")
        items = self.stack[-count:]
        del self.stack[-count:]
        return items

    def grow(self, items: list[Any], what: type[_Items | _Named] = _Items) -> None:
        if not isinstance(self.stack[-1], what):
            raise TypeError(f"items of a {_kind(self.stack[-1])}")
        self.stack[-1].take(items)

    def named(self, name: str) -> Callable[..., Any]:
        """The stand-in for a global of the file."""
        found = KNOWN.get(name.replace("numpy._core.", "numpy.core.", 1))
        if found is None:
            fix = "pickle NumPy arrays of numbers alone; if you trust the file, open it yourself and save it as NPZ"
            raise RecordingError(str(self.path), "asks for more than NumPy arrays, and was not opened", name, fix)
        return found

    def refuse(self, name: str, argument: Any) -> None:
        words = f"extension code {argument}, whose meaning is not in the file" if name.startswith("EXT") else name
        fix = "pickle NumPy arrays of numbers alone, or export the file again if it is damaged"
        problem = "is not a pickle of arrays, or a damaged one, and was not opened"
        raise RecordingError(str(self.path), problem, words, fix)
