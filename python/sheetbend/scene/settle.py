"""Particles and bodies that start inside a collider, moved to its surface before the motion begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from .contacts import Contact
from .scene_data import SceneData

ROUNDS = 50  # of moves out of all colliders in turn, which may overlap
NONE = 1e-12  # m, an overlap that counts as none


@dataclass(frozen=True)
class SettledStart:
    """What the particles or the body of one contact moved by.

    Attributes:
        particles: how many of them; 1 of a body, whose center of mass moves and takes all points along.
        farthest: m.
    """

    particles: int
    farthest: float


def settled(scene: SceneData, core: Any, inputs: Array, first: int) -> tuple[Array, dict[str, SettledStart]]:
    """How far particles must move along the normals to be outside the colliders of all contacts that settle. A body
    moves as a whole and does not turn: along the normal at its deepest point, until no point is inside.

    Args:
        inputs: at the values of the scene; first: where its positions begin.

    Returns:
        (nodes, 3) m, and by contact what moved. Held and driven particles stay where they are.

    Raises:
        SceneError: a body that is joined to something, which would have to move too.
    """
    for contact in scene.contacts.contacts:
        if contact.of_body and contact.name in scene.contacts.settling:
            _expect_loose(scene, contact)
    at = inputs.copy()
    positions = at[first : first + 3 * scene.node_count].reshape(-1, 3)
    before = positions.copy()
    held = np.zeros(scene.node_count, dtype=bool)
    held[scene.held] = True
    for _ in range(ROUNDS):
        deepest = 0.0
        for k, contact in enumerate(scene.contacts.contacts):
            if contact.name in scene.contacts.settling:
                found = core.contact_gaps(at, 0.0, k)
                depth = np.where(held[contact.particles], 0.0, np.maximum(0.0, -found[:, 0]))
                moving = [int(depth.argmax())] if contact.of_body else slice(None)
                positions[contact.particles[moving]] += depth[moving, None] * found[moving, 1:]
                deepest = max(deepest, float(depth.max(initial=0.0)))
        if deepest <= NONE:
            break
    moved = positions - before
    distance = np.linalg.norm(moved, axis=1)
    told = {}
    for contact in scene.contacts.contacts:
        own = distance[np.unique(contact.particles)]
        if contact.name in scene.contacts.settling and own.max(initial=0.0) > NONE:
            told[contact.name] = SettledStart(int((own > NONE).sum()), float(own.max()))
    return moved, told


def _expect_loose(scene: SceneData, contact: Contact) -> None:
    nodes = np.unique(contact.nodes)
    for group in scene.groups:
        if group.kind != "rigid" and np.isin(group.particles, nodes).any():
            (body,) = (name for name, b in scene.bodies.items() if b.particles[0] == contact.particles[0])
            problem = f"moves bodies that are joined to nothing: '{body}' is held by '{group.name}'"
            fix = "let the body start outside, or leave settle out"
            raise SceneError(f"{contact.name}.contact.settle", problem, True, fix)
