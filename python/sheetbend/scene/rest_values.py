"""The parameters inside the constraints of a group: what is given, or what the initial positions make of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays.checks import finite, per_item
from ..errors import SceneError

Array = NDArray[np.float64]
IN_A_PLANE = ("planar_bend", "hinge")
AS_GIVEN = ("strain", "exponential_strain", "sinh_strain", "spline_strain", "isometric_bending", "sheet_curvature")


def rest_values(
    name: str, kind: str, parameters: Sequence[str], x: Array, rest: ArrayLike | None, normal: ArrayLike | None
) -> Array:
    """Parameters (count, parameters) of a group's constraints.

    Args:
        name: of the group, for messages.
        parameters: names of the kind's parameters.
        x: (count, arity, 3) m, initial positions of the stencils.
        rest, normal: see `Scene.add_constraints`.

    Raises:
        SceneError: missing, misshaped or impossible values.
    """
    count, width = len(x), len(parameters)
    if rest is not None and not parameters:
        curved = "has none: use planar_bend with a plane normal, or a rod for a curve in space"
        raise SceneError(f"{name}.rest", curved if kind == "bend" else "has none", "rest", "leave it out")
    if kind in ("distance", "tether"):
        return _positive(name, "length", np.linalg.norm(x[:, 1] - x[:, 0], axis=1), rest)
    if kind == "area":
        return _positive(name, "area", np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2, rest)
    if kind in AS_GIVEN:
        if rest is None:
            raise SceneError(f"{name}.rest", "is missing", None, f"give (count, {width}): {', '.join(parameters)}")
        return np.array(finite(f"{name}.rest", rest, (count, width), SceneError))
    if kind in IN_A_PLANE:
        return _planar(name, count, rest, normal)
    if kind == "friction_hinge":
        return _planar(name, count, _yield_angles(name, count, rest), normal)
    values = np.zeros((count, width))
    offsets = parameters.index("rest_1") if "rest_1" in parameters else 0
    values[:, :offsets] = 1.0
    if rest is not None:
        values[:, offsets:] = finite(
            f"{name}.rest", np.reshape(rest, (count, -1)), (count, width - offsets), SceneError
        )
    return values


def _positive(name: str, what: str, initial: Array, rest: ArrayLike | None) -> Array:
    sizes = initial if rest is None else per_item(f"{name}.rest", rest, len(initial))
    if (sizes <= 0).any():
        bad = int(np.argmin(sizes))
        fix = "move the particles apart or give rest"
        raise SceneError(f"{name}.rest", f"{what} of constraint {bad} is not positive", float(sizes[bad]), fix)
    return np.array(sizes)[:, None]


def _yield_angles(name: str, count: int, rest: ArrayLike | None) -> Array:
    if rest is None:
        raise SceneError(f"{name}.rest", "is missing", None, "give (count,) rad, the angle at which the joint slides")
    angles = per_item(f"{name}.rest", rest, count)
    if (angles <= 0).any():
        raise SceneError(f"{name}.rest", "must be positive", float(angles.min()), "give rad, such as 0.001")
    return angles


def _planar(name: str, count: int, rest: ArrayLike | None, normal: ArrayLike | None) -> Array:
    if normal is None:
        fix = "give the unit normal of the plane, such as (0, 1, 0)"
        raise SceneError(f"{name}.normal", "is missing", None, fix)
    n = np.broadcast_to(finite(f"{name}.normal", normal, None, SceneError), (count, 3))
    size = np.linalg.norm(n, axis=1, keepdims=True)
    if (size == 0).any():
        fix = "give the normal of the plane"
        raise SceneError(f"{name}.normal", "has no length", n[int(np.argmin(size))].tolist(), fix)
    angle = np.zeros(count) if rest is None else per_item(f"{name}.rest", rest, count)
    return np.column_stack([n / size, angle])
