"""What is fixed to a rigid body: a cable in its plug, a flag on its pole, a face of a solid on a plate."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import expressions
from ..scene.body import Body, BodyPoint
from ..scene.scene import Scene
from .grip import any_across
from .joint_making import constrain, ground

STUB = 1.0
"""Length of the link on a body that carries a cable's direction, over that of the cable's links. Only its direction
matters. But it ends in a light particle that rigid rows hold, and a short one makes the bent joint beside it stiff:
with 0.01, and 40 links of 12.5 mm, double precision lost these rows."""


def attach(body: Body, particles: ArrayLike, *, name: str | None = None) -> str:
    """Fix particles to a body where they are, such as the edge of a cloth to a pole.

    They start on the body, with its velocity, for all values of the quantities of its start, or of the correction of
    the poses that it rides on. They have their own mass. They cannot be pinned or driven afterwards.

    Args:
        body: what `Scene.add_body` returned.
        particles: their numbers, such as `cloth.particles[cloth.mesh.sets["left"]]`.
        name: of the group of constraints, by which a motion has their forces; `<body>_attached` by default.

    Returns:
        The name of the group.

    Raises:
        SceneError: no body, no such particles, some twice, pinned or driven ones, or ones that are attached already.
    """
    if not isinstance(body, Body):
        raise SceneError("attach.body", "is not a body", body, "give what Scene.add_body returned")
    scene: Scene = body.scene  # type: ignore[assignment]  # the one that bodies are made in
    where, group = "attach.particles", f"{body.name}_attached" if name is None else name
    check_label("attach.name", group)
    own = scene.node_array(where, particles).tolist()
    taken = {p for b in scene.bodies.values() for p in (*b.particles.tolist(), *b.attached)}
    bad = sorted(p for p, count in Counter(own).items() if count > 1 or p in taken or p in scene.held)
    if bad:
        fix = "give free particles, each once, that are part of no body and attached to none"
        raise SceneError(where, "cannot fix these particles", bad, fix)
    body.carrying()  # now, for its terms
    origin, frame = body.pose(scene.nodes)
    places = (scene.nodes[own] - origin) @ frame
    p, *axes = body.particles.tolist()
    weights = np.stack([body.coordinates(expressions(x)) for x in places])
    constrain(scene, "coincide_particle", group, [[p, one, *axes] for one in own], weights)
    body.attached |= dict(zip(own, places, strict=True))
    return group


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
