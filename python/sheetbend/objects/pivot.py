"""What slows an arm down: viscous and dry friction in its pivot, and the drag of the air.

On a fixed pivot the torque against the motion is

    friction sign(rate) + viscosity rate + drag |rate| rate.

Swings shrink linearly in time from the first (by 4 friction/stiffness per period, stiffness the restoring torque over
the angle), exponentially from the second, and as 1/(t + const) from the third; a recording tells them apart where the
amplitude falls by a good part. Dry friction is elastic up to a small slip angle and constant beyond
(core/constraints/dry_friction.h), so that the joint can come to rest off its balance, as real ones do.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import is_number
from ..errors import SceneError
from ..quantities.quantities import ZERO_OR_MORE, Term
from ..scene.scene import Scene
from .arm_data import Arm

SLIP_ANGLE = 1e-3
"""How far a joint with dry friction gives before it slides unless told otherwise, rad."""


def add_resistance(
    scene: Scene,
    arm: Arm,
    carrier: Arm | None,
    *,
    viscosity: float | None,
    friction: float | None,
    slip_angle: float,
    drag: float | None,
) -> None:
    """Add what resists an arm's turning against the arm that carries it, or against a fixed direction.

    Raises:
        SceneError: friction or slip angle that are not positive, or a negative drag.
    """
    if viscosity is not None or friction is not None:
        before = carrier.pivot if carrier else _fixed_above(scene, arm)
        if viscosity is not None:
            _viscous(scene, arm, before, viscosity)
        if friction is not None:
            _dry(scene, arm, carrier, before, friction, slip_angle)
    if drag is not None:
        _air(scene, arm, drag)


def _fixed_above(scene: Scene, arm: Arm) -> int:
    """A fixed, hidden node straight above the pivot, from which the hinge counts its angle."""
    return int(scene.add_hidden([np.add(arm.root, (0.0, 0.0, 1.0))], 0.0, pinned=True)[0])


def _viscous(scene: Scene, arm: Arm, before: int, viscosity: float) -> None:
    stencil = (before, arm.pivot, arm.end)
    scene.add_constraints("hinge", [stencil], name=f"{arm.name}_hinge", viscosity=viscosity, normal=(0.0, 1.0, 0.0))


def _dry(scene: Scene, arm: Arm, carrier: Arm | None, before: int, friction: float, slip_angle: float) -> None:
    """A hinge that sticks at the initial angle between the two arms; about -y that angle grows as the arm's does."""
    check_friction(arm.name, friction, slip_angle)
    (stuck,) = scene.add_hidden(np.zeros((1, 3)), 1.0, pinned=True)
    angles = [(1.0, arm)] if carrier is None else [(1.0, arm), (-1.0, carrier)]
    scene.add_terms([Term("position", 3 * int(stuck), sign, ((f"{a.name}_angle", "identity"),)) for sign, a in angles])
    quantity, group = scene.add_quantity(f"{arm.name}_friction", friction, "N m"), f"{arm.name}_friction_hinge"
    slip = (add_slip_angle(scene, arm.name, slip_angle), "identity")
    scene.add_constraints(
        "friction_hinge",
        [(before, arm.pivot, arm.end, stuck)],
        name=group,
        compliance=np.ones(1),
        rest=[slip_angle],
        normal=(0.0, -1.0, 0.0),
    )
    places = scene.places_of_group(group)
    places.group.compliance[:] = places.group.rest[:, -1] = 0.0  # terms make both
    at, rest = places.first, int(places.rest[0, -1])
    scene.add_terms([Term("compliance", at, 1.0, (slip, (quantity, "inverse"))), Term("rest", rest, 1.0, (slip,))])


def add_slip_angle(scene: Scene, name: str, slip_angle: float) -> str:
    """Make a quantity of the slip angle. Hardly anyone measures it, so a fit that takes it as given says what twice the
    angle would move."""
    return scene.add_quantity(f"{name}_slip_angle", slip_angle, "rad", unsure=1.0)


def check_friction(name: str, friction: float, slip_angle: float) -> None:
    """Refuse a dry friction or a slip angle that is not positive."""
    for field, value in (("friction", friction), ("slip_angle", slip_angle)):
        if not (is_number(value) and math.isfinite(value) and value > 0.0):
            raise SceneError(f"{name}.{field}", "must be positive", value, "give a positive number, or leave it out")


def _air(scene: Scene, arm: Arm, drag: float) -> None:
    """Quadratic drag on the arm's end: on a fixed pivot its torque is `drag` times the square of the rate."""
    per_length = (f"{arm.name}_length", "inverse")
    add_air_drag(scene, arm.end, arm.name, drag, "N m s^2/rad^2", (per_length, per_length, per_length))


def add_air_drag(
    scene: Scene, nodes: ArrayLike, name: str, drag: float, unit: str, factors: tuple[tuple[str, str], ...] = ()
) -> None:
    """Add quadratic drag on each of the nodes, the quantity `<name>_drag` in its own unit; factors of others make it
    N s^2/m^2.

    Raises:
        SceneError: a negative drag, or a name that is taken.
    """
    if not (is_number(drag) and math.isfinite(drag) and drag >= 0.0):
        raise SceneError(f"{name}.drag", "must be zero or more", drag, f"give a number in {unit}")
    scene.has_drag = True
    limits = None if drag > 0.0 else ZERO_OR_MORE
    quantity = scene.add_quantity(f"{name}_drag", drag, unit, positive=drag > 0.0, limits=limits)
    scene.add_terms([Term("drag_quadratic", np.ravel(nodes), 1.0, ((quantity, "identity"), *factors))])
