"""What moves a hinge or a slider or resists it: a spring and viscosity; and of a hinge dry friction, a servo, the
torque of a motor over time, and how stiffly it holds its axis.

Of a slider, spring and viscosity are the constraint `along` in its axis. Of a hinge, they, servo and motor are the
constraint `joint_angle`, whose dial is the x of a hidden node: pinned at zero for a spring, driven for a servo. The
dial of a motor is free: the rotor, an axis with inertia and no weight, which turns with the joint and on which the
torque acts. That of dry friction (`joint_friction`) is the angle at which the hinge sticks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite, is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import Expression, expressions
from ..quantities.quantities import Term
from .joint_limits import PER, RATE, SIZE
from .joint_making import Making
from .pivot import add_slip_angle, check_friction

Knots = tuple[ArrayLike, ArrayLike]  # times (knots,) s and values (knots,)
MOST_NAMED = 50  # knots of a torque that are quantities


def add_spring(made: Making, unit: str, stiffness: float | None, rest: float, viscosity: float | None) -> None:
    """A spring, viscosity, or both: against a hinge's angle ("rad") or a slider's shift ("m")."""
    if stiffness is None and is_number(rest) and rest != 0.0:
        fix = "add a stiffness, or leave rest out"
        raise SceneError(f"{made.name}.rest", "is that of a spring, and there is none", rest, fix)
    if stiffness is None and viscosity is None:
        return
    if unit == "rad":
        dial = made.scene.add_hidden(np.zeros((1, 3)), 1.0, pinned=True)
        _angle(made, "spring", int(dial[0]), stiffness, rest, viscosity)
    else:
        _resist(made, "along", "spring", *made.along_row(0), unit, stiffness, rest, viscosity)


def add_servo(made: Making, knots: Knots, stiffness: float | None, rest: float, viscosity: float | None) -> None:
    """A dial that is driven, which the joint follows at once, or as a spring does."""
    t, angles = _knots(f"{made.name}.servo", knots)
    dial = made.scene.add_hidden([[float(angles[0]), 0.0, 0.0]], 1.0)
    made.scene.drive(dial, t, angles[:, None, None] * np.eye(3)[0])
    if stiffness is None and (rest or viscosity is not None):
        fix = "give a stiffness too, or put the rest angle into the servo's"
        raise SceneError(f"{made.name}.servo", "is stiff, and has no rest angle or viscosity", (rest, viscosity), fix)
    _angle(made, "servo", int(dial[0]), stiffness, rest, viscosity)


def add_motor(made: Making, torque: Knots | None, rotor: float | None) -> None:
    """A rotor that turns with the joint, and the torque that acts on it."""
    if torque is None and rotor is None:
        return
    if not (is_number(rotor) and rotor > 0):  # type: ignore[operator]
        fix = "give the rotor's inertia in kg m^2, as the joint feels it; small beside the arm's"
        raise SceneError(f"{made.name}.rotor", "must be positive", rotor, fix)
    scene, name = made.scene, made.name
    dial = scene.add_rotor(name)
    scene.add_quantity(f"{name}_rotor", float(rotor), "kg m^2")  # type: ignore[arg-type]
    scene.add_terms([Term("mass", dial, 1.0, ((f"{name}_rotor", "identity"),))])
    _start(made, "position", dial, "angle")
    _start(made, "velocity", dial, "rate")
    _angle(made, "motor", dial, None, 0.0, None)
    if torque is None:
        return
    t, values = _knots(f"{name}.torque", torque)
    torques = expressions(values[:, None, None] * np.eye(3)[0])
    if len(t) <= MOST_NAMED:
        size = float(abs(values).max()) or 1.0
        for k, value in enumerate(values):
            quantity = scene.add_quantity(f"{name}_torque_{k}", float(value), "N m", positive=False, scale=size)
            torques[k, 0, 0] = Expression.of(quantity)
    scene.forces.push([dial], torques, t)


def add_friction(made: Making, friction: float | None, slip_angle: float) -> None:
    """Dry friction: a spring that slides, and sticks at the angle at the start."""
    if friction is None:
        return
    check_friction(made.name, friction, slip_angle)
    (stuck,) = made.scene.add_hidden(np.zeros((1, 3)), 1.0, pinned=True)
    _start(made, "position", int(stuck), "angle")
    weights, nodes = _turn(made, int(stuck))
    slip = add_slip_angle(made.scene, made.name, slip_angle)
    group = made.constrain("joint_friction", "dry", nodes, [[*weights, Expression.of(slip)]], np.ones(1))
    made.name_stiffness(group, f"{made.name}_friction", friction, "N m", at=slip)


def hold_axis(made: Making, stiffness: float | None, damping: float | None) -> None:
    """Keep the lower body's axis of a hinge along the upper one's: rigidly, or with a stiffness against tilts about
    both directions across it."""
    if stiffness is None and damping is not None:
        fix = "add tilt_stiffness, or leave tilt_damping out"
        raise SceneError(f"{made.name}.tilt_damping", "acts where the axis gives way, and it is rigid", damping, fix)
    _check(f"{made.name}.tilt_stiffness", stiffness, f"{made.name}.tilt_damping", damping)
    pairs = [(0, 1), (0, 2)]
    if stiffness is None:
        made.across(pairs)
        return
    group = made.across(pairs, np.ones(2), None if damping is None else np.zeros(2))
    made.name_stiffness(group, f"{made.name}_tilt_stiffness", stiffness, "N m/rad")
    if damping is not None:
        made.name_damping(group, f"{made.name}_tilt_damping", damping, "N m s/rad")


def _turn(made: Making, dial: int) -> tuple[list[Expression | float], list[list[int]]]:
    """What the angle of a hinge from a dial is made of: the weights of its directions, and the stencil."""
    (_, *a), (_, *b) = made.nodes
    return [*made.direction(0, 1), *made.direction(0, 2), *made.direction(1, 1)], [[*a, *b, dial]]


def _start(made: Making, array: str, dial: int, label: str) -> None:
    """Let a dial start with the joint's own angle or rate, where it has one."""
    if (quantity := f"{made.name}_{label}") in made.scene.quantities:
        made.scene.add_terms([Term(array, 3 * dial, 1.0, ((quantity, "identity"),))])


def _check(field: str, stiffness: float | None, loss_field: str, loss: float | None) -> None:
    """Refuse a stiffness that is not positive, and a loss that is negative."""
    if stiffness is not None and not (is_number(stiffness) and stiffness > 0.0):
        raise SceneError(field, "must be positive", stiffness, "give a positive number, or leave it out")
    if loss is not None and not (is_number(loss) and loss >= 0.0):
        raise SceneError(loss_field, "must not be negative", loss, "give zero or more, or leave it out")


def _angle(made: Making, label: str, dial: int, stiffness: float | None, rest: float, viscosity: float | None) -> None:
    """A group `joint_angle` from a dial."""
    weights, nodes = _turn(made, dial)
    _resist(made, "joint_angle", label, nodes, weights, "rad", stiffness, rest, viscosity)


def _resist(
    made: Making,
    kind: str,
    label: str,
    nodes: list[list[int]],
    weights: list[Expression | float],
    unit: str,
    stiffness: float | None,
    rest: float,
    viscosity: float | None,
) -> None:
    """A group of one constraint, whose numbers are quantities where they are given. It is rigid without them."""
    scene, name = made.scene, made.name
    _check(f"{name}.stiffness", stiffness, f"{name}.viscosity", viscosity)
    if not is_number(rest):
        raise SceneError(f"{name}.rest", "must be a finite number", rest, f"give {unit}")
    zero: Expression | float = 0.0
    if stiffness is not None:
        zero = Expression.of(scene.add_quantity(f"{name}_rest", rest, unit, positive=False, scale=SIZE[unit]))
    one, none = np.ones(1), np.zeros(1)
    damped = none if viscosity is not None else None
    if stiffness is None and viscosity is not None:
        group = made.constrain(kind, label, nodes, [[*weights, zero]], viscosity=none)
    else:
        compliance = None if stiffness is None else one
        group = made.constrain(kind, label, nodes, [[*weights, zero]], compliance, damped)
    if stiffness is not None:
        made.name_stiffness(group, f"{name}_stiffness", stiffness, PER[unit])
    if viscosity is not None:
        made.name_damping(group, f"{name}_viscosity", viscosity, RATE[unit])


def _knots(field: str, knots: Knots) -> tuple[Array, Array]:
    if not isinstance(knots, tuple | list) or len(knots) != 2:
        raise SceneError(field, "must be a pair", knots, "give (times, values), both (knots,)")
    t = finite(f"{field}.times", knots[0], None, SceneError).ravel()
    check_increasing(f"{field}.times", t)
    return t, finite(field, knots[1], (len(t),), SceneError)
