"""Pickles of NumPy arrays of numbers, read without running anything that the file names.

A pickle is a program, and `pickle.load` calls whatever it names. Here a file may name only what NumPy writes into
pickles of its arrays, and not even that is called: stand-ins keep the number type, the shape and the bytes, and check
them. All else is refused by name. A file can still be made to ask for much memory, as any compressed file can.
"""

from __future__ import annotations

import io
import math
import pickle
import pickletools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError

_NUMBERS = ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")
# What a stream of wrong bytes can raise, in the unpickler and in the stand-ins.
_DAMAGE = (
    pickle.UnpicklingError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OverflowError,
    TypeError,
    ValueError,
)
_AGAIN = "export or copy the file again"


def arrays(path: Path) -> NDArray[Any] | list[NDArray[Any]]:
    """The array that the pickle at `path` holds, or its list (or tuple) of arrays; of any protocol.

    Raises:
        RecordingError: the file is no pickle or a damaged one, names anything but NumPy's plain arrays (which is then
            named), or holds anything but one array or a list of them.
    """
    content = path.read_bytes()
    _check_instructions(path, content)
    try:
        value = _Unpickler(path, content).load()
    except RecordingError:
        raise
    except _DAMAGE as error:
        raise RecordingError(str(path), "is a damaged pickle", str(error), _AGAIN) from error
    if isinstance(value, list | tuple):
        return [_values(path, f"entry {i}", entry) for i, entry in enumerate(value)]
    return _values(path, "the pickle", value)


def _values(path: Path, what: str, value: object) -> NDArray[Any]:
    if not isinstance(value, _Array):
        fix = "store one array, or a list of arrays"
        raise RecordingError(f"{path}: {what}", "must be a NumPy array of numbers", type(value).__name__, fix)
    if value.values is None:
        raise RecordingError(f"{path}: {what}", "is an array without numbers", "nothing", _AGAIN)
    return value.values


def _check_instructions(path: Path, content: bytes) -> None:
    """Walk the stream without executing it, so that the unpickler sees only whole instructions.

    The unpickler reserves memory for sizes and memo indices as they stand; one changed byte can ask for gigabytes.
    """
    end = 0
    try:
        for instruction, argument, position in pickletools.genops(content):
            if instruction.name in ("PUT", "BINPUT", "LONG_BINPUT") and int(argument or 0) >= len(content):
                raise ValueError(f"memo index {argument} in {len(content)} bytes")
            if instruction.name.startswith("EXT"):
                raise ValueError(f"extension code {argument}, whose meaning is not in the file")
            end = (position or 0) + 1
    except (ValueError, OverflowError) as error:
        raise RecordingError(str(path), "is no pickle, or a damaged one", str(error), _AGAIN) from error
    if end < len(content):
        fix = "store everything in one list and pickle that once"
        raise RecordingError(str(path), "goes on after the end of its pickle", f"{len(content) - end} bytes", fix)


class _Array:
    """In place of numpy.ndarray; empty until its state or its buffer comes."""

    __slots__ = ("values",)

    def __init__(self) -> None:
        self.values: NDArray[Any] | None = None

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        _, shape, number, by_columns, data = state
        self.fill(data, number, shape, "F" if by_columns else "C")

    def fill(self, data: bytes | bytearray, number: _Number, shape: tuple[int, ...], order: str) -> None:
        if not isinstance(data, bytes | bytearray) or not isinstance(number, _Number) or order not in ("C", "F"):
            raise TypeError(f"an array of {type(number).__name__} from {type(data).__name__} in order {order!r}")
        if any(size < 0 for size in shape) or math.prod(shape) * number.dtype.itemsize != len(data):
            raise ValueError(f"an array of shape {shape}, {number.dtype}, from {len(data)} bytes")
        flat = np.frombuffer(data, number.dtype) if data else np.zeros(0, number.dtype)
        self.values = flat.reshape(shape, order="F" if order == "F" else "C")


class _Number:
    """In place of numpy.dtype: the type of a plain number."""

    __slots__ = ("dtype",)

    def __init__(self, code: str) -> None:
        self.dtype = np.dtype(code)

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        order = state[1]
        if order not in ("<", ">", "|", "="):
            raise ValueError(f"numbers in the byte order {order!r}")
        self.dtype = self.dtype.newbyteorder(order)


class _Unpickler(pickle.Unpickler):
    """Finds the stand-ins and nothing else.

    Not to be replaced by NumPy's own functions: those trust what they are given, and return memory never written to or
    arrays of objects.
    """

    def __init__(self, path: Path, content: bytes) -> None:
        super().__init__(io.BytesIO(content))
        self.path = path

    def find_class(self, module: str, name: str) -> Any:
        """The stand-in for a global of the file; NumPy 2 moved numpy.core to numpy._core."""
        known = {
            "numpy.ndarray": _Array,
            "numpy.dtype": self._number,
            "numpy.core.multiarray._reconstruct": self._reconstruct,
            "numpy.core.multiarray.scalar": self._scalar,
            "numpy.core.numeric._frombuffer": self._from_buffer,
            "_codecs.encode": self._bytes,
        }
        wanted = f"{module}.{name}"
        found = known.get(wanted.replace("numpy._core.", "numpy.core.", 1))
        if found is None:
            fix = "pickle NumPy arrays of numbers alone; if you trust the file, open it yourself and save it as NPZ"
            raise RecordingError(str(self.path), "asks for more than NumPy arrays, and was not opened", wanted, fix)
        return found

    def _number(self, code: str, align: bool = False, copy: bool = True) -> _Number:
        if code not in _NUMBERS:
            fix = "store plain numbers, such as float64"
            raise RecordingError(str(self.path), "holds an array that is not of real numbers", code, fix)
        return _Number(code)

    def _reconstruct(self, kind: object, shape: object, code: object) -> _Array:
        return _Array()  # NumPy writes the shape (0,) here and sets the state afterwards

    def _scalar(self, number: _Number, data: bytes) -> _Array:
        array = _Array()
        array.fill(data, number, (), "C")
        return array

    def _from_buffer(
        self, data: bytes, number: _Number, shape: tuple[int, ...], order: str, axes: tuple[int, ...] | None = None
    ) -> _Array:
        array = _Array()
        array.fill(data, number, shape, "C" if order == "K" else order)
        if order == "K" and array.values is not None:
            array.values = array.values.transpose(axes)
        return array

    def _bytes(self, text: str, encoding: str) -> bytes:
        """Bytes as protocols 0 to 2 write them."""
        if encoding != "latin1":
            raise ValueError(f"bytes in the encoding {encoding!r}")
        return text.encode("latin1")
