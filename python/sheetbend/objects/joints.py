"""Joints between rigid bodies: ball, hinge, universal, slider, cylinder and fixed.

A joint is a few rigid constraints between points and directions of two bodies (`coincide`, `across`, `along` in
docs/constraints.md). The second body starts where the joint lets it be: the first body's state and the joint's own
coordinates make its state, so that any values of the quantities give a start that the joint allows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..errors import SceneError
from ..scene.body import Body
from .joint_limits import add_limits
from .joint_making import Joint, Making
from .joint_spring import Knots, add_friction, add_motor, add_servo, add_spring, hold_axis
from .pivot import SLIP_ANGLE


def ball(
    upper: Body | None, lower: Body, *, at: ArrayLike, name: str = "ball", compliance: float | None = None
) -> Joint:
    """Join two bodies at a point, about which they turn freely.

    Quantities: `<name>_upper_x`, ... and `<name>_lower_x`, ... m, the point in the two bodies' frames, and with a
    compliance `<name>_compliance` m/N. The lower body keeps its `<body>_turn_x`, ... and `<body>_spin_x`, ....

    Args:
        upper, lower: the bodies; None is the ground.
        at: (3,) m, the point in the world, as the bodies were given.
        compliance: m/N of a mount that gives way; rigid by default.

    Raises:
        SceneError: shapes, NaN, or bodies that are none or the same.
    """
    made = Making("ball", upper, lower, at, (1.0, 0.0, 0.0), name)
    made.hang()
    made.coincide(compliance)
    return made.joint()


def hinge(
    upper: Body | None,
    lower: Body,
    *,
    at: ArrayLike,
    axis: ArrayLike,
    name: str = "hinge",
    rate: float = 0.0,
    stiffness: float | None = None,
    rest: float = 0.0,
    viscosity: float | None = None,
    friction: float | None = None,
    slip_angle: float = SLIP_ANGLE,
    servo: Knots | None = None,
    torque: Knots | None = None,
    rotor: float | None = None,
    limits: ArrayLike | None = None,
    limit_stiffness: float | None = None,
    limit_damping: float | None = None,
    limit_depth: float | None = None,
    tilt_stiffness: float | None = None,
    tilt_damping: float | None = None,
) -> Joint:
    """Join two bodies by a hinge.

    Quantities: its place as of `ball`; `<name>_angle` rad and `<name>_rate` rad/s, the start of the lower body, which
    replace its own place, attitude, velocity and spin; with a spring `<name>_stiffness` N m/rad and `<name>_rest` rad;
    with viscosity `<name>_viscosity` N m s/rad; with dry friction `<name>_friction` N m; with limits
    `<name>_limit_low`, `<name>_limit_high` and `<name>_limit_depth` rad, `<name>_limit_stiffness` N m/rad, and
    `<name>_limit_damping` N m s/rad where given; of an axis that gives way `<name>_tilt_stiffness` N m/rad and
    `<name>_tilt_damping` N m s/rad where given. The angle counts from how the bodies were given.

    Args:
        upper, lower: the bodies; None is the ground.
        at: (3,) m, a point of the hinge in the world, as the bodies were given.
        axis: (3,) its direction in the world; the angle grows counterclockwise about it.
        rate: rad/s, of the angle at the start.
        stiffness: of a torsion spring, N m/rad.
        rest: rad, the angle at which it rests.
        viscosity: torque over the rate, N m s/rad.
        friction: dry friction, N m: Coulomb's torque, which does not depend on the rate. Where less would turn it, the
            hinge sticks. Take substeps h with h^2 friction/inertia well below the slip angle.
        slip_angle: rad, how far a hinge with dry friction gives elastically before it slides.
        servo: times (knots,) s and angles (knots,) rad. The hinge has this angle, or with a stiffness a spring that
            rests at it (`rest` is added).
        torque: times (knots,) s and torques (knots,) N m of a motor on the lower body, linear between and constant
            outside; up to 50 knots are the quantities `<name>_torque_0`, `_1`, and so on.
        rotor: kg m^2, the inertia of the motor seen from the joint, the quantity `<name>_rotor`. With a torque it is
            needed: a torque acts on the rotor, which turns with the joint.
        limits: (low, high) rad, between which the hinge turns freely. Beyond them a stop pushes back.
        limit_stiffness: of a stop, torque over angle, N m/rad. By default it would turn the lower body alone back
            within 20 ms. Take substeps of which at least ten fall into the time of a touch.
        limit_damping: of a stop, torque over rate, N m s/rad.
        limit_depth: rad beyond a limit, over which stiffness and damping grow from zero to these values; 0.02 by
            default.
        tilt_stiffness: N m/rad, torque over the angle by which the lower body's axis leans against the upper one's.
            The axis is rigid by default. One that gives way takes up part of an impact.
        tilt_damping: N m s/rad, torque over the rate of that angle.

    Raises:
        SceneError: shapes, NaN, negative numbers, limits that are no range, or bodies that are none or the same.
    """
    made = Making("hinge", upper, lower, at, axis, name)
    made.hang(turn=rate)
    made.coincide()
    hold_axis(made, tilt_stiffness, tilt_damping)
    if servo is not None:
        add_servo(made, servo, stiffness, rest, viscosity)
    else:
        add_spring(made, "rad", stiffness, rest, viscosity)
    add_friction(made, friction, slip_angle)
    add_motor(made, torque, rotor)
    add_limits(made, "rad", limits, limit_stiffness, limit_damping, limit_depth)
    return made.joint()


def universal(upper: Body | None, lower: Body, *, at: ArrayLike, axes: ArrayLike, name: str = "universal") -> Joint:
    """Join two bodies by a universal joint (Cardan): they meet in a point, and an axis of the one stays across an axis
    of the other.

    Quantities: its place as of `ball`. The lower body keeps its attitude and spin, which must suit the joint.

    Args:
        axes: (2, 3) directions in the world, across each other: the upper body's and the lower body's.

    Raises:
        SceneError: shapes, NaN, axes that are not across each other.
    """
    first, second = finite(f"{name}.axes", axes, (2, 3), SceneError)
    made = Making("universal", upper, lower, at, first, name, across=second)
    made.hang()
    made.coincide()
    made.across([(0, 1)])
    return made.joint()


def slider(
    upper: Body | None,
    lower: Body,
    *,
    at: ArrayLike,
    axis: ArrayLike,
    name: str = "slider",
    rate: float = 0.0,
    stiffness: float | None = None,
    rest: float = 0.0,
    viscosity: float | None = None,
    limits: ArrayLike | None = None,
    limit_stiffness: float | None = None,
    limit_damping: float | None = None,
    limit_depth: float | None = None,
) -> Joint:
    """Let one body slide along a line of the other without turning against it.

    Quantities: its place as of `ball`; `<name>_shift` m and `<name>_rate` m/s, the start of the lower body; with a
    spring `<name>_stiffness` N/m and `<name>_rest` m; with viscosity `<name>_viscosity` N s/m; with limits
    `<name>_limit_low`, `<name>_limit_high` and `<name>_limit_depth` m, `<name>_limit_stiffness` N/m, and
    `<name>_limit_damping` N s/m where given.

    Args:
        upper, lower: the bodies; None is the ground.
        at: (3,) m, a point of the lower body in the world that stays on the line.
        axis: (3,) the line's direction in the world.
        rate: m/s, at the start.
        stiffness: of a spring along the line, N/m.
        rest: m, the shift at which it rests. The shift counts from how the bodies were given.
        viscosity: force over the rate, N s/m.
        limits: (low, high) m, between which the body slides freely, counted from how the bodies were given.
        limit_stiffness, limit_damping, limit_depth: N/m, N s/m and m, as of `hinge`; the depth is 5 mm by default.

    Raises:
        SceneError: as `ball`.
    """
    made = Making("slider", upper, lower, at, axis, name)
    made.hang(shift=rate, fixed=True)
    made.along()
    made.across([(0, 1), (0, 2), (1, 2)])
    add_spring(made, "m", stiffness, rest, viscosity)
    add_limits(made, "m", limits, limit_stiffness, limit_damping, limit_depth)
    return made.joint()


def cylinder(
    upper: Body | None,
    lower: Body,
    *,
    at: ArrayLike,
    axis: ArrayLike,
    name: str = "cylinder",
    rate: float = 0.0,
    turn_rate: float = 0.0,
) -> Joint:
    """Let one body slide along a line of the other and turn about it.

    Quantities: its place as of `ball`; `<name>_shift` m, `<name>_shift_rate` m/s, `<name>_angle` rad and `<name>_rate`
    rad/s, the start of the lower body.

    Args:
        upper, lower: the bodies; None is the ground.
        at: (3,) m, a point of the lower body in the world that stays on the line.
        axis: (3,) the line's direction in the world.
        rate: m/s, along the line at the start.
        turn_rate: rad/s, about the line at the start.

    Raises:
        SceneError: as `ball`.
    """
    made = Making("cylinder", upper, lower, at, axis, name)
    made.hang(shift=rate, turn=turn_rate)
    made.along()
    made.across([(0, 1), (0, 2)])
    return made.joint()


def fixed(upper: Body | None, lower: Body, *, at: ArrayLike | None = None, name: str = "fixed") -> Joint:
    """Weld two bodies together, such as a payload to a gripper.

    Quantities: its place as of `ball`. The lower body starts where the upper one carries it.

    Args:
        upper, lower: the bodies; None is the ground.
        at: (3,) m, the point in the world where they are held together; the origin of the lower body's frame by
            default. Forces and torques of the joint refer to it.

    Raises:
        SceneError: as `ball`.
    """
    place = lower.pose(lower.scene.nodes)[0] if at is None and isinstance(lower, Body) else at
    made = Making("fixed", upper, lower, np.zeros(3) if place is None else place, (1.0, 0.0, 0.0), name)
    made.hang(fixed=True)
    made.coincide()
    made.across([(0, 1), (0, 2), (1, 2)])
    return made.joint()
