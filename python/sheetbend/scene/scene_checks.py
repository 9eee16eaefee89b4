"""What a whole scene must have before it is simulated."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from .scene_data import SceneData


def validate(scene: SceneData) -> None:
    """Refuse a scene that cannot be simulated; see `Scene.freeze`."""
    if scene.node_count == 0:
        raise SceneError(scene.name, "has no particles", 0, "add particles or a rope")
    free = scene.free_nodes
    if len(free) == 0:
        raise SceneError(
            scene.name,
            "has nothing that can move: every particle is pinned or driven",
            scene.node_count,
            "release at least one",
        )
    heavy = scene.base_arrays()["mass"] > 0
    for t in scene.terms:
        if t.array == "mass":
            heavy[t.index] = True
    light = free[~heavy[free]]
    if light.size:
        names = ", ".join(scene.node_in_words(place) for place in light[:5])
        raise SceneError("mass", "is zero for free particles", names, "give them a mass, or pin them")
    if scene.groups:
        touching = [c.particles for c in scene.contacts.contacts]
        if scene.contacts.balls is not None:
            touching.append(scene.contacts.balls.particles)
        used = np.zeros(scene.node_count, dtype=bool)
        for particles in (*(g.particles for g in scene.groups), *scene.volumes.triangles.values(), *touching):
            used[particles] = True
        used[scene.body_nodes] = True
        loose = free[~used[free]]
        if loose.size:
            fix = "constrain them, pin them or leave them out"
            names = ", ".join(scene.node_in_words(place) for place in loose[:5])
            raise SceneError("particles", "are connected to nothing", names, fix)
    if scene.air.blowing is not None:
        scene.air.expect_blown(scene.has_drag)
    held = scene.pinned & set(scene.boundary.driven)
    if held:
        raise SceneError("drive.particles", "are pinned too", sorted(held), "either pin or drive a particle")
