"""Grips that roll about the rope as they lean, which markers on the rope do not show.

Two markers on a gripped piece tell its direction. The frame there is carried by the shortest rotation from the nominal
direction (`Grip.from_markers`). A robot's wrist may roll by more than that: one that keeps an axis level does, and so
does one whose arm turns as it reaches aside. The further roll is a smooth function of where the grip points. Here it is
one of second order in the lean (u, v), the components of the direction along the two axes of the nominal frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.types import Array
from ..objects.grip import Grip, any_across
from ..objects.grip_freedom import add_motion, axes_of
from ..objects.rod import Rod
from ..objects.rod_end import spread_turn
from ..scene.scene import Scene
from .motion import GrippedMotion

# Of u, v, u^2, u v and v^2: of the angle's tangent, as no roll is near 90 degrees.
ORDERS = ("1", "2", "11", "12", "22")


def lean(direction: Array, nominal: Array) -> Array:
    """(5, knots): u, v, u^2, u v and v^2 of directions (knots, 3)."""
    across = any_across(nominal)
    u, v = direction @ across, direction @ np.cross(nominal, across)
    return np.stack([u, v, u * u, u * v, v * v])


def add_rolls(scene: Scene, rod: Rod, grips: tuple[Grip, Grip], nominal: tuple[Array, Array], roll: str | None) -> None:
    """Add the quantities `<rod>_start_roll_<order>` and `<rod>_end_roll_<order>`, rad.

    Args:
        grips: at the start and at the end.
        nominal: their directions (3,) from which frames are carried.
        roll: the quantity of the twist built in at the end grip; None = there is none.
    """
    ahead = np.linspace(0.0, 1.0, len(rod.directors))
    inner = rod.directors[1:-1]
    for label, k, near, own in (("start", 0, 1.0 - ahead, None), ("end", -1, ahead, roll)):
        grip, held = grips[k], int(rod.directors[k])
        first, second, _ = axes_of(grip)
        for order, size in zip(ORDERS, lean(grip.direction, nominal[k]), strict=True):
            turn = scene.add_quantity(f"{rod.name}_{label}_roll_{order}", 0.0, "rad", positive=False, scale=0.3)
            by = size[:, None]
            if own is None:
                add_motion(scene, grip, held, by * second, {turn: "identity"})
            else:
                add_motion(scene, grip, held, by * second, {turn: "identity", own: "cos"})
                add_motion(scene, grip, held, -by * first, {turn: "identity", own: "sin"})
            spread_turn(scene, turn, size[0] * near[1:-1], inner, roll, ahead[1:-1])


def rolls_said(
    name: str, motions: Sequence[GrippedMotion], nominal: tuple[Array, Array], values: Mapping[str, float]
) -> str:
    """A sentence on how far the grips of a rope roll in recordings, at fitted values."""
    most = []
    for k, label in enumerate(("start", "end")):
        by = np.array([values[f"{name}_{label}_roll_{order}"] for order in ORDERS])
        angles = [np.arctan(by @ lean(m.directions(bool(k)), nominal[k])) for m in motions]
        most.append(float(np.degrees(max(np.ptp(a) for a in angles))))
    return (
        f"the grips are taken to roll about the rope as they lean, by up to {most[0]:.2g} and {most[1]:.2g} degrees in "
        "a recording; two markers in a grip do not show a roll, so that it is a guess from how the rope moves"
    )
