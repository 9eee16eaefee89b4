"""Limits of a hinge's angle or of a slider's shift: stops that push back beyond them, and do nothing between them.

A stop is the constraint `angle_stop` or `slide_stop` (core/constraints/joint_stops.h). Its stiffness and its damping
grow from zero over a depth beyond the limit, so that a motion depends smoothly on where the limit is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, is_number
from ..errors import SceneError
from ..quantities.expression import Expression, numbers
from ..scene.body import Body
from .joint_making import Making

DURATION = 0.02
"""How long the lower body alone would touch a stop of the default stiffness without a depth, s."""
DEPTH = {"rad": 0.02, "m": 0.005}
"""How far beyond a limit a stop has its full stiffness unless told otherwise."""
PER = {"rad": "N m/rad", "m": "N/m"}
RATE = {"rad": "N m s/rad", "m": "N s/m"}
SIZE = {"rad": 0.1, "m": 0.01}
"""Sizes against which precision is judged."""


def add_limits(
    made: Making,
    unit: str,
    limits: ArrayLike | None,
    stiffness: float | None,
    damping: float | None,
    depth: float | None,
) -> None:
    """Stops at both ends of a joint's range.

    Args:
        unit: "rad" of a hinge's angle, "m" of a slider's shift.
        limits: (low, high), counted from how the bodies were given.
        stiffness: N m/rad or N/m; `default_stiffness` unless given.
        damping: N m s/rad or N s/m, or None.
        depth: beyond a limit, over which stiffness and damping grow to these values; DEPTH unless given.

    Raises:
        SceneError: limits that are no range or leave the start outside, negative numbers, or numbers of stops without
            limits.
    """
    name = made.name
    if limits is None:
        for label, value in (("stiffness", stiffness), ("damping", damping), ("depth", depth)):
            if value is not None:
                fix = f"add limits = (low, high), or leave limit_{label} out"
                raise SceneError(f"{name}.limit_{label}", "acts at limits, and there are none", value, fix)
        return
    ends = checked_limits(name, unit, limits)
    k = default_stiffness(made, unit) if stiffness is None else stiffness
    d = DEPTH[unit] if depth is None else depth
    _check(name, k, damping, d, unit)
    scene = made.scene
    low, high = (
        Expression.of(scene.add_quantity(f"{name}_limit_{label}", end, unit, positive=False, scale=SIZE[unit]))
        for label, end in zip(("low", "high"), ends, strict=True)
    )
    grown = Expression.of(scene.add_quantity(f"{name}_limit_depth", d, unit))
    kind, stencil, weights = _row(made, unit)
    damped = None if damping is None else np.zeros(1)
    group = made.constrain(
        kind, "stop", stencil, [[*weights, 0.5 * (low + high), 0.5 * (high - low), grown]], [1.0], damped
    )
    made.name_stiffness(group, f"{name}_limit_stiffness", k, PER[unit])
    if damping is not None:
        made.name_damping(group, f"{name}_limit_damping", damping, RATE[unit])


def checked_limits(name: str, unit: str, limits: ArrayLike) -> tuple[float, float]:
    """(low, high) of a joint that starts at 0.

    Raises:
        SceneError: as of `add_limits`.
    """
    low, high = (float(a) for a in finite(f"{name}.limits", limits, (2,), SceneError))
    if not low < high:
        fix = "give (low, high), the lower one first"
        raise SceneError(f"{name}.limits", "are not a range: the first must be below the second", (low, high), fix)
    if unit == "rad" and high - low >= 2.0 * math.pi:
        fix = "an angle is known up to a turn: give a narrower range, or leave the limits out"
        raise SceneError(f"{name}.limits", "allow a whole turn or more", (low, high), fix)
    beyond = max(low, -high)
    if beyond > 0.0:
        problem = f"do not include 0, where the joint starts: it lies {beyond:.6g} {unit} outside"
        fix = "limits count from how the bodies are given: give the bodies as they lie within the limits"
        raise SceneError(f"{name}.limits", problem, (low, high), fix)
    return low, high


def default_stiffness(made: Making, unit: str) -> float:
    """The stiffness with which the lower body alone would touch a linear stop for DURATION, half the period of its mass
    (or of its inertia about the joint's axis) on that spring. The upper body's where the lower one is held."""
    moved = made.upper if made.upper.role == "free" and made.lower.role != "free" else made.lower
    inertia = moved.inertia_of_nodes()[0] if unit == "m" else _inertia_about(made, moved)
    return float(inertia * (math.pi / DURATION) ** 2)


def _inertia_about(made: Making, body: Body) -> float:
    """kg m^2, of a body about the hinge's axis, as the scene was built."""
    side, nodes = int(body is made.lower), made.scene.nodes
    origin, frame = body.pose(nodes)
    arms = np.array(nodes[body.particles])
    arms[0] -= origin + frame @ numbers(made.places[side], body.values())
    axis = frame @ made.axes[side][0]
    return float(body.inertia_of_nodes() @ (np.cross(axis, arms) ** 2).sum(axis=1))


def _check(name: str, stiffness: float, damping: float | None, depth: float, unit: str) -> None:
    given = (("stiffness", stiffness, PER), ("depth", depth, {unit: unit}), ("damping", damping, RATE))
    for label, value, units in given:
        if value is None:
            continue
        zero = label == "damping"
        if not is_number(value) or value < 0.0 or (value == 0.0 and not zero):
            problem = "must be zero or more" if zero else "must be positive"
            raise SceneError(f"{name}.limit_{label}", problem, value, f"give it in {units[unit]}, or leave it out")


def _row(made: Making, unit: str) -> tuple[str, list[list[int]], list[Expression | float]]:
    """Kind, stencil and weights of a stop."""
    if unit == "rad":
        (_, *a), (_, *b) = made.nodes
        return "angle_stop", [[*a, *b]], [*made.direction(0, 1), *made.direction(0, 2), *made.direction(1, 1)]
    return "slide_stop", *made.along_row(0)
