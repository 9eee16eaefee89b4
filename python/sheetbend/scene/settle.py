"""Particles that start inside a collider, moved to its surface before the motion begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .scene_data import SceneData

Array = np.ndarray
ROUNDS = 50  # of moves out of all colliders in turn, which may overlap
NONE = 1e-12  # m, an overlap that counts as none


@dataclass(frozen=True)
class SettledStart:
    """What the particles of one contact moved by.

    Attributes:
        particles: how many of them.
        farthest: m.
    """

    particles: int
    farthest: float


def settled(scene: SceneData, core: Any, inputs: Array, first: int) -> tuple[Array, dict[str, SettledStart]]:
    """How far particles must move along the normals to be outside the colliders of all contacts that settle.

    Args:
        inputs: at the values of the scene; first: where its positions begin.

    Returns:
        (nodes, 3) m, and by contact what moved. Held and driven particles stay where they are.
    """
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
                positions[contact.particles] += depth[:, None] * found[:, 1:]
                deepest = max(deepest, float(depth.max(initial=0.0)))
        if deepest <= NONE:
            break
    moved = positions - before
    distance = np.linalg.norm(moved, axis=1)
    told = {}
    for contact in scene.contacts.contacts:
        own = distance[contact.particles]
        if contact.name in scene.contacts.settling and own.max(initial=0.0) > NONE:
            told[contact.name] = SettledStart(int((own > NONE).sum()), float(own.max()))
    return moved, told
