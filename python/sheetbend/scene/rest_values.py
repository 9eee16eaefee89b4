"""The parameters inside the constraints of a group: what is given, or what the initial positions make of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.kinds import KINDS, parameters_in_rest, range_in_words


def rest_values(name: str, kind: str, x: Array, rest: ArrayLike | None, normal: ArrayLike | None) -> Array:
    """Parameters (count, parameters) of a group's constraints, each as its kind says (`sheetbend.KINDS`).

    Args:
        name: of the group, for messages.
        x: (count, arity, 3) m, initial positions of the stencils.
        rest, normal: see `Scene.add_constraints`.

    Raises:
        SceneError: missing, superfluous, misshaped or impossible values.
    """
    parameters = KINDS[kind]["parameters"]
    values = _core.rest_values(kind, x)
    place = {parameter: k for k, parameter in enumerate(parameters)}
    directions = [k for parameter, k in place.items() if parameters[parameter]["source"] == "normal"]
    if directions:
        values[:, directions] = _unit_normals(name, len(x), normal)
    elif normal is not None:
        raise SceneError(f"{name}.normal", f"means nothing to {kind}", None, "leave it out")

    own = parameters_in_rest(kind)
    columns = [place[parameter] for parameter in own]
    if rest is not None:
        values[:, columns] = _columns(name, kind, own, len(x), rest)
    elif any(p["source"] == "given" for p in own.values()):
        raise SceneError(f"{name}.rest", "is missing", None, _wanted(own, len(x)))
    for parameter, k in zip(own, columns, strict=True):
        _check_range(name, parameter, parameters[parameter], values[:, k])
    return values


def _columns(name: str, kind: str, own: Mapping[str, Mapping[str, Any]], count: int, rest: ArrayLike) -> Array:
    """`rest` as (count, parameters that it holds); one parameter may come as a number or as (count,)."""
    if not own:
        hint = KINDS[kind]["instead_of_rest"]
        raise SceneError(f"{name}.rest", "has none" + (f": {hint}" if hint else ""), "rest", "leave it out")
    array, shape = finite(f"{name}.rest", rest, None, SceneError), (count, len(own))
    if len(own) == 1 and array.shape in ((), (count,)):
        return np.broadcast_to(array, (count,))[:, None]
    if array.shape != shape:
        raise SceneError(f"{name}.rest", "has the wrong shape", array.shape, _wanted(own, count))
    return array


def _wanted(own: Mapping[str, Mapping[str, Any]], count: int) -> str:
    shape = f"({count},)" if len(own) == 1 else f"({count}, {len(own)})"
    return f"give {shape}: " + ", ".join(f"{p} {about['unit']}".strip() for p, about in own.items())


def _check_range(name: str, parameter: str, about: Mapping[str, Any], values: Array) -> None:
    outside = ~((values >= about["least"]) & (values <= about["most"]))
    if not outside.any():
        return
    bad = int(np.argmax(outside))
    fix = "give such values in rest"
    if about["source"] == "measured":
        fix = "move the particles apart or give rest"
    problem = f"{parameter} of constraint {bad} must be {range_in_words(about)}"
    raise SceneError(f"{name}.rest", problem, float(values[bad]), fix)


def _unit_normals(name: str, count: int, normal: ArrayLike | None) -> Array:
    if normal is None:
        fix = "give the unit normal of the plane, such as (0, 1, 0)"
        raise SceneError(f"{name}.normal", "is missing", None, fix)
    given = finite(f"{name}.normal", normal, None, SceneError)
    if given.shape not in ((3,), (count, 3)):
        raise SceneError(f"{name}.normal", "has the wrong shape", given.shape, f"give (3,) or ({count}, 3)")
    n = np.broadcast_to(given, (count, 3))
    size = np.linalg.norm(n, axis=1, keepdims=True)
    if (size == 0).any():
        fix = "give the normal of the plane"
        raise SceneError(f"{name}.normal", "has no length", n[int(np.argmin(size))].tolist(), fix)
    return np.asarray(n / size)
