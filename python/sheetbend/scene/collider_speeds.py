"""Speeds of colliders: one that moves farther in a substep than it is thick may pass particles unseen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .colliders import Collider
from .contacts import Contacts

CUBIC = 1.5  # the largest speed of a cubic that rests at two knots, over its mean speed between them


@dataclass(frozen=True)
class Fastest:
    """The largest speed of a collider's surface.

    Attributes:
        name: of the collider.
        speed: m/s.
        reach: m, from the middle of the collider to where particles touch it: a particle that is passed by more than
            this in a substep may come out on the other side.
    """

    name: str
    speed: float
    reach: float


def fastest(contacts: Contacts, radii: np.ndarray) -> tuple[Fastest, ...]:
    """The largest speed of every collider that moves and can pass through particles, which a half space cannot.

    Args:
        radii: (contacts,) m.
    """
    found = []
    for place, (name, collider) in enumerate(contacts.colliders.items()):
        own = [radius for c, radius in zip(contacts.contacts, radii, strict=True) if c.collider == place]
        if collider.shape == "plane" or collider.motion is None or len(collider.motion.times) < 2 or not own:
            continue
        found.append(Fastest(name, _speed(collider), collider.half_thickness + min(own)))
    return tuple(found)


def _speed(collider: Collider) -> float:
    """m/s, an upper bound of the speed of any point of the surface, its rotation included."""
    motion = collider.poses
    steps = np.diff(motion.times)
    along = np.linalg.norm(np.diff(motion.positions, axis=0), axis=1)
    turned = np.linalg.norm(np.diff(motion.rotations, axis=0), axis=1) * collider.extent
    factor = CUBIC if motion.interpolation == "cubic" else 1.0
    return factor * float(((along + turned) / steps).max())
