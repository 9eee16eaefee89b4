"""What the contacts of a scene did in a simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np


class ContactMode(IntEnum):
    """Whether a particle is apart from a collider, sticks to it or slides on it."""

    APART = 0
    STICKS = 1
    SLIDES = 2


@dataclass(frozen=True)
class ContactCounts:
    """How often the particles of one contact touched, slid and stuck, over all substeps of a simulation.

    For self-contact with friction, pairs of pieces are counted instead of particles. Of balls that hit each other only
    `began` and `ended` are counted, once for each impact.

    Attributes:
        most: the largest number of particles that touched in one substep.
        began: how often a particle began to touch, bounces included; particles that touch in the first substep are not
            counted.
        ended: how often a particle came off, bounces included.
        sliding_share: of all particles that touched, summed over the substeps, the share that slid; 0 if none touched.
        sticking_share: likewise, the share that friction held.
        bdf1_share: the share of the scene's substeps that used BDF1. With the integrator "bdf2" these are the first
            substep and three from the start of each contact. BDF1 damps like zeta = omega h/2.
        deepest: m, the largest depth of a particle in the collider at any frame, relative to the contact's radius.
            Particles that are held or driven have no contact and are left out. None for self-contact and balls.
    """

    most: int
    began: int
    ended: int
    sliding_share: float
    sticking_share: float
    bdf1_share: float
    deepest: float | None


def contact_modes(sizes: Mapping[str, int], modes: np.ndarray) -> dict[str, np.ndarray]:
    """The modes of each contact, (frames, particles), by its name.

    Args:
        sizes: number of particles of each contact, by its name.
        modes: (frames, all particles) from the core, those of one contact after those of another.
    """
    ends = np.cumsum(list(sizes.values()))
    return dict(zip(sizes, np.split(modes, ends[:-1], axis=1), strict=True)) if sizes else {}


def contact_counts(
    names: Sequence[str], counted: Sequence[Mapping[str, int]], bdf1_share: float, deepest: Mapping[str, float]
) -> dict[str, ContactCounts]:
    """The counts of each contact by its name, from those of the core and the depths by name, m."""
    counts = {}
    for name, c in zip(names, counted, strict=True):
        slid = c["sliding"] / max(c["touching"], 1)
        stuck = (c["touching"] - c["sliding"]) / max(c["touching"], 1)
        counts[name] = ContactCounts(c["most"], c["began"], c["ended"], slid, stuck, bdf1_share, deepest.get(name))
    return counts
