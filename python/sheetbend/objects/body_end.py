"""Ends of ropes and rods that are fixed to a rigid body: a cable in its plug, a flag's cord on its pole."""

from __future__ import annotations

import numpy as np

from ..quantities.expression import expressions
from ..scene.body import BodyPoint
from ..scene.scene import Array, Scene
from .grip import any_across
from .joint_making import constrain, ground

STUB = 1.0
"""Length of the link on a body that carries a cable's direction, over that of the cable's links. Only its direction
matters. But it ends in a light particle that rigid rows hold, and a short one makes the bent joint beside it stiff:
with 0.01, and 40 links of 12.5 mm, double precision lost these rows."""


def hold_place(scene: Scene, point: BodyPoint, particle: int, name: str, reach: float = 0.0) -> None:
    """Keep a particle on a body: at a point, or `reach` m from it along the point's direction."""
    place = point.place if point.along is None else point.place + reach * point.along
    body = point.body
    p, *axes = body.particles.tolist()
    constrain(scene, "coincide_particle", name, [[p, particle, *axes]], body.coordinates(place)[None])


def hold_direction(scene: Scene, point: BodyPoint, node: int, across: Array, name: str) -> None:
    """Keep a node that is a direction (a director, a normal) across directions (k, 3) of a body's frame.

    The constraint takes three axes of a second body: the node is the first, two axes of the ground stand for the
    others, with no weight.
    """
    body, fill = point.body, ground(scene).particles[2:].tolist()
    weights = [[*body.directions(expressions(way)), 1.0, 0.0, 0.0] for way in across]
    stencil = [[*body.particles[1:].tolist(), node, *fill]] * len(across)
    constrain(scene, "across", name, stencil, expressions(weights))


def frame_at(point: BodyPoint) -> tuple[Array, Array]:
    """A rod's first and second frame axis (3,) at a point with a direction, in the body's frame."""
    assert point.along is not None
    first = any_across(point.along)
    return first, np.cross(point.along, first)
