"""Plain data from files back into dataclasses: every field checked against its annotation."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, NoReturn, TypeVar

from ..errors import InputError
from .names import steering

T = TypeVar("T")


def as_dataclass(kind: type[T], data: object, where: str) -> T:
    """An instance of a dataclass from a mapping by field.

    Args:
        where: the path of the data in its file, for errors; "" for all of it.

    Raises:
        InputError: a field is missing, unknown, or of another type; it names its path.
    """
    given = mapping(data, where)
    hints = typing.get_type_hints(kind)
    fields = {field.name: field for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    for name in given:
        if name not in fields:
            fix = f"leave it out; there are: {', '.join(fields)}"
            raise InputError(_joined(where, name), "is not a field that this version knows", name, fix)
    for name, field in fields.items():
        needed = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if needed and name not in given:
            raise InputError(_joined(where, name), "is missing", sorted(given), f"add {name}")
    return kind(**{name: as_type(hints[name], value, _joined(where, name)) for name, value in given.items()})


def as_type(wanted: Any, value: object, where: str) -> Any:
    """A value of the type of an annotation: None, numbers, texts, unions, and tuples, mappings and dataclasses of them.

    None where a number belongs is one that JSON cannot hold: NaN.

    Raises:
        InputError: it is of another type; it names its path.
    """
    origin, inner = typing.get_origin(wanted), typing.get_args(wanted)
    if origin in (types.UnionType, typing.Union):
        (only,) = (part for part in inner if part is not type(None))
        return None if value is None else as_type(only, value, where)
    if origin is tuple:
        parts = listed(value, where)
        if inner[-1] is not Ellipsis and len(parts) != len(inner):
            _refuse(where, f"must have {len(inner)} entries", value)
        return tuple(as_type(inner[0], part, f"{where}[{i}]") for i, part in enumerate(parts))
    if origin is not None and issubclass(origin, Mapping):
        return {name: as_type(inner[1], part, f"{where}.{name}") for name, part in mapping(value, where).items()}
    if dataclasses.is_dataclass(wanted):
        kind = typing.cast(type[Any], wanted)
        return value if isinstance(value, kind) else as_dataclass(kind, value, where)
    if wanted is float:
        return _number(value, where)
    if type(value) is not wanted:
        _refuse(where, f"must be {_WORDS[wanted]}", value)
    if isinstance(value, str) and steering(value, "\n\t"):
        _refuse(where, "holds a control character", value)
    return value


def mapping(value: object, where: str) -> Mapping[str, Any]:
    """A value that must be an object of JSON."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        _refuse(where, "must be an object", value)
    return value


def listed(value: object, where: str) -> list[Any] | tuple[Any, ...]:
    """A value that must be a list."""
    if not isinstance(value, list | tuple):
        _refuse(where, "must be a list", value)
    return value


def _number(value: object, where: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        _refuse(where, "must be a number", value)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        _refuse(where, "must be a finite number", "a number beyond 1.8e308")
    return number


def _joined(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


_WORDS = {int: "a whole number", bool: "true or false", str: "a text"}


def _refuse(where: str, problem: str, got: object) -> NoReturn:
    raise InputError(where, problem, got, "give a file that FitResult.save wrote, unchanged")
