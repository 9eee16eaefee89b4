"""Checks of arrays that come from users: clear errors instead of broadcasting surprises."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, SceneError

MOST = float(np.finfo(float).max)
"""The largest number that is finite."""
MOST_WHOLE = 2**31 - 1
"""The largest whole number that the core takes."""


def numbers(field: str, values: ArrayLike, error: type[InputError], copy: bool = False) -> np.ndarray:
    """values as float64, of any shape; NaN and infinity may be among them. A float64 array is not copied unless asked.

    Raises:
        InputError: of the class `error`, for texts, truth values, complex numbers, ragged rows, a tensor that has a
            gradient, and numbers too large for a float.
    """
    try:
        array = np.array(values) if copy else np.asarray(values)
        if array.dtype.kind not in "iufO":
            raise TypeError(f"{array.dtype} is not a type of real numbers")
        return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError, RuntimeError) as problem:
        raise error(field, "is not an array of numbers", type(values).__name__, "give numbers") from problem


def finite(field: str, values: ArrayLike, shape: tuple[int, ...] | None, error: type[InputError]) -> np.ndarray:
    """values as float64 of the given shape, without NaN or infinity."""
    array = numbers(field, values, error, copy=True)
    if shape is not None and array.shape != shape:
        raise error(field, "has the wrong shape", array.shape, f"give {shape}")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(np.atleast_1d(array)))[0].tolist()
        raise error(
            field,
            f"is not finite at index {where}",
            float(array.ravel()[~np.isfinite(array.ravel())][0]),
            "give finite numbers",
        )
    return array


def check_increasing(field: str, times: np.ndarray) -> None:
    """Knot times (knots,): at least one, and each later than the one before."""
    if len(times) == 0 or (np.diff(times) <= 0).any():
        raise SceneError(field, "must increase", times[:5].tolist(), "sort the knots and drop repeated ones")


def is_number(value: object) -> bool:
    """Whether a value is a finite real number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    known = float(value) if isinstance(value, np.floating) else value  # as a float32, MOST would be infinite
    return bool(-MOST <= known <= MOST)


def is_bound(value: object) -> bool:
    """Whether a value is a real number or infinite, an open end."""
    return is_number(value) or (isinstance(value, float) and value in (-np.inf, np.inf))


def is_several(value: object) -> bool:
    """Whether a value holds others that can be taken one by one: a list, a generator, an array with axes; no text."""
    return isinstance(value, Iterable) and not isinstance(value, str) and getattr(value, "ndim", 1) != 0


def is_list(value: object) -> bool:
    """Whether a value is a list, a tuple or the like, or an array with axes; no text."""
    return isinstance(value, Sequence | np.ndarray) and is_several(value)


def check_label(field: str, name: object) -> None:
    """Refuse what cannot be the name of a part of a scene.

    Raises:
        SceneError: it is no text, or an empty one.
    """
    if not isinstance(name, str) or not name.strip():
        raise SceneError(field, "must be a text", name, "give a name, such as 'rope'")


def check_count(field: str, value: object, least: int, most: int, error: type[InputError] = SceneError) -> None:
    """Refuse what is no whole number in a range, such as a number of things, a seed or the number of a frame.

    Args:
        most: from `MOST_WHOLE` on it is not told, except of a value beyond it.

    Raises:
        InputError: of the class `error`.
    """
    span = f"give one from {least} to {most}"
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        fix = span if most < MOST_WHOLE else f"give one from {least} on"
        raise error(field, f"must be a whole number, at least {least}", value, fix)
    if value > most:
        raise error(field, f"must be at most {most}", value, span)


def check_kind(field: str, value: object, kind: type, fix: str, error: type[InputError] = InputError) -> None:
    """Refuse an argument of another class.

    Raises:
        InputError: of the class `error`.
    """
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise error(field, f"must be {article} {kind.__name__}", value, fix)


def check_each(field: str, values: object, kind: type, fix: str, error: type[InputError] = InputError) -> None:
    """Refuse what is no list of at least one of a class.

    Raises:
        InputError: of the class `error`.
    """
    if not is_list(values) or not len(values) or not all(isinstance(one, kind) for one in values):  # type: ignore
        raise error(field, f"must hold at least one {kind.__name__}, and nothing else", values, fix)


def given_by_name(field: str, given: Mapping[str, Any] | None) -> dict[str, Any]:
    """What was given by name; nothing for None.

    Raises:
        InputError: it is no mapping.
    """
    check_kind(field, {} if given is None else given, Mapping, "give a mapping from names, or leave it out")
    return dict(given or {})


def check_positive(name: str, required: Mapping[str, float], optional: Mapping[str, float | None]) -> None:
    """Numbers of a rod or a cloth, by argument; None leaves an optional one out."""
    for field, value in ({**required, **optional}).items():
        if not (is_number(value) and value > 0) and not (value is None and field in optional):  # type: ignore[operator]
            fix = "give a positive number" + (", or leave it out" if field in optional else "")
            raise SceneError(f"{name}.{field}", "must be positive", value, fix)


def points(field: str, values: ArrayLike) -> np.ndarray:
    """(n, 3) positions, n >= 1."""
    array = finite(field, values, None, SceneError)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise SceneError(field, "have the wrong shape", array.shape, "give (n, 3) with n at least 1")
    return array


def vectors(field: str, values: ArrayLike, error: type[InputError] = SceneError) -> np.ndarray:
    """(..., 3) finite numbers, such as points or directions."""
    array = finite(field, values, None, error)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise error(field, "has the wrong shape", array.shape, "give three numbers for each, (..., 3)")
    return array


def per_item(field: str, values: ArrayLike, count: int) -> np.ndarray:
    """One number for all or (count,), as a new array (count,)."""
    array = finite(field, values, None, SceneError)
    if array.ndim > 1 or (array.ndim == 1 and array.shape != (count,)):
        raise SceneError(field, "has the wrong shape", array.shape, f"give one number or ({count},)")
    return np.broadcast_to(array, (count,)).copy()


def indices(field: str, values: ArrayLike, count: int) -> list[int]:
    """Particle indices in range; negative ones count from the end."""
    found: list[int] = index_array(field, values, count).tolist()
    return found


def some_indices(field: str, values: ArrayLike, count: int) -> list[int]:
    """`indices`, of which there may be none."""
    if isinstance(values, np.ndarray):
        none = values.size == 0
    else:
        none = isinstance(values, Sequence | set) and len(values) == 0 and not isinstance(values, str)
    return [] if none else indices(field, values, count)


def index_array(field: str, values: ArrayLike, count: int) -> np.ndarray:
    """`indices` as one array."""
    return node_array(field, values, count, hidden=count) % count


def node_array(field: str, values: ArrayLike, particles: int, hidden: int = 0) -> np.ndarray:
    """Numbers of a scene's nodes as one array: particles from 0 on, and hidden nodes from -1 down where some may be."""
    array = whole(values)
    if array.size == 0:
        raise SceneError(field, "must be particle indices", values, "give whole numbers")
    bad = array[(array < -hidden) | (array >= particles)]
    if bad.size:
        raise SceneError(field, "name particles that do not exist", bad[:5].tolist(), f"use 0 to {particles - 1}")
    return array.ravel().astype(np.int64)


def whole(values: ArrayLike) -> np.ndarray:
    """values (n,) or more as a new array of whole numbers; an empty one where they are anything else."""
    try:
        array = np.atleast_1d(np.array(values))
    except (TypeError, ValueError, RuntimeError):  # rows of different lengths, a tensor that has a gradient
        array = np.zeros(0)
    return array if np.issubdtype(array.dtype, np.integer) else np.zeros(0, dtype=np.int64)


def triangle_array(field: str, values: ArrayLike, count: int) -> np.ndarray:
    """Triangles (n, 3) of three distinct particles each."""
    flat = node_array(field, values, count)
    if np.ndim(values) != 2 or np.shape(values)[1] != 3:
        raise SceneError(field, "have the wrong shape", np.shape(values), "give (count, 3) particles")
    corners = flat.reshape(-1, 3)
    twice = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    if twice.any():
        bad = corners[int(np.argmax(twice))].tolist()
        raise SceneError(field, "use a particle twice", bad, "give three distinct particles each")
    return corners
