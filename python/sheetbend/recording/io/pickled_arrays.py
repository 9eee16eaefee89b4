"""What pickles of NumPy arrays name, as stand-ins that keep numbers and call nothing: arrays, types of numbers, and the
functions that NumPy puts them together with."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBERS = ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8")
_MOST_AXES = 32


class Array:
    """Stands for numpy.ndarray in a pickle; empty until its state or its buffer comes."""

    __slots__ = ("values",)

    def __init__(self) -> None:
        self.values: NDArray[Any] | None = None

    def set_state(self, state: object) -> None:
        """As NumPy's: (version, shape, type of numbers, whether by columns, bytes)."""
        _, shape, number, by_columns, data = _parts(state)
        self.fill(data, number, shape, "F" if by_columns else "C")

    def fill(self, data: object, number: object, shape: object, order: object) -> None:
        """Take numbers from bytes, as many as the shape says."""
        if not isinstance(data, bytes | bytearray) or not isinstance(number, Number) or order not in ("C", "F"):
            raise TypeError(f"an array of {_kind(number)} from {_kind(data)} in order {order!r}")
        sizes = tuple(_parts(shape))
        if len(sizes) > _MOST_AXES or any(type(size) is not int or size < 0 for size in sizes):
            raise ValueError(f"an array of shape {sizes[:_MOST_AXES]}")
        if math.prod(sizes) * number.dtype.itemsize != len(data):
            raise ValueError(f"an array of shape {sizes}, {number.dtype}, from {len(data)} bytes")
        flat = np.frombuffer(data, number.dtype) if data else np.zeros(0, number.dtype)
        self.values = flat.reshape(sizes, order="F" if order == "F" else "C")


class Number:
    """Stands for numpy.dtype in a pickle: the type of a plain number."""

    __slots__ = ("dtype",)

    def __init__(self, code: str) -> None:
        self.dtype = np.dtype(code)

    def set_state(self, state: object) -> None:
        """As NumPy's: the byte order is all that counts."""
        order = _parts(state)[1]
        if order not in ("<", ">", "|", "="):
            raise ValueError(f"numbers in the byte order {order!r}")
        self.dtype = self.dtype.newbyteorder(order)


class NoNumberError(Exception):
    """An array is of anything but real numbers; its argument is the code of their type."""


def _number(code: str, align: bool = False, copy: bool = True) -> Number:
    if code not in _NUMBERS:
        raise NoNumberError(code)
    return Number(code)


def _reconstruct(kind: object, shape: object, code: object) -> Array:
    return Array()  # NumPy writes the shape (0,) here and sets the state afterwards


def _scalar(number: object, data: object) -> Array:
    array = Array()
    array.fill(data, number, (), "C")
    return array


def _from_buffer(data: object, number: object, shape: object, order: object, axes: object = None) -> Array:
    array = Array()
    array.fill(data, number, shape, "C" if order == "K" and axes is not None else order)
    if order == "K" and array.values is not None:
        array.values = array.values.transpose(tuple(_parts(axes)))
    return array


def _bytes(text: str, encoding: str) -> bytes:
    """Bytes as protocols 0 to 2 write them."""
    if encoding != "latin1":
        raise ValueError(f"bytes in the encoding {encoding!r}")
    return text.encode("latin1")


def _class(*arguments: object) -> None:
    raise TypeError("an array that is made in no way that NumPy writes")


KNOWN: dict[str, Callable[..., Any]] = {
    "numpy.ndarray": _class,
    "numpy.dtype": _number,
    "numpy.core.multiarray._reconstruct": _reconstruct,
    "numpy.core.multiarray.scalar": _scalar,
    "numpy.core.numeric._frombuffer": _from_buffer,
    "_codecs.encode": _bytes,
}
"""By the names that NumPy 1 writes; in NumPy 2 numpy.core is numpy._core."""


def _parts(value: object) -> list[Any] | tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise TypeError(f"a {_kind(value)} where a tuple belongs")
    return value


def _kind(value: object) -> str:
    return "list" if isinstance(value, list) else type(value).__name__
