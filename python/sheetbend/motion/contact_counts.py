"""What the contacts of a scene did in a simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np


class ContactMode(IntEnum):
    """What a particle does at a collider."""

    APART = 0
    STICKS = 1
    SLIDES = 2


@dataclass(frozen=True)
class ContactCounts:
    """What the particles of one contact did, over all substeps of a simulation.

    Of self-contact with friction it counts pairs in the place of particles.

    Attributes:
        most: how many of them touched at once, at most.
        began: how often one began to touch. Those that touch in the first substep have not begun to; bounces count.
        ended: how often one came off, bounces again.
        sliding_share: of what touched, particle by particle and substep by substep, how much slid; 0 where nothing
            touched.
        sticking_share: likewise, how much was held by friction.
        bdf1_share: of the scene's substeps, how many went with BDF1. With integrator "bdf2" that is the first one, and
            three from where a contact begins. BDF1 damps like zeta = omega h/2.
        deepest: m, how far inside the collider one was at any frame, counted from the contact's radius; of one that
            is held or driven nothing counts, as it touches nothing. None of self-contact.
    """

    most: int
    began: int
    ended: int
    sliding_share: float
    sticking_share: float
    bdf1_share: float
    deepest: float | None


def contact_modes(sizes: Mapping[str, int], modes: np.ndarray) -> dict[str, np.ndarray]:
    """By the contacts' names, with as many particles as `sizes` says, the part (frames, particles) of what the core
    tells of all of them one after the other, (frames, all particles)."""
    ends = np.cumsum(list(sizes.values()))
    return dict(zip(sizes, np.split(modes, ends[:-1], axis=1), strict=True)) if sizes else {}


def contact_counts(
    names: Sequence[str], counted: Sequence[Mapping[str, int]], bdf1_share: float, deepest: Mapping[str, float]
) -> dict[str, ContactCounts]:
    """By the contacts' names, from what the core has counted and how deep particles were."""
    counts = {}
    for name, c in zip(names, counted, strict=True):
        slid = c["sliding"] / max(c["touching"], 1)
        stuck = (c["touching"] - c["sliding"]) / max(c["touching"], 1)
        counts[name] = ContactCounts(c["most"], c["began"], c["ended"], slid, stuck, bdf1_share, deepest.get(name))
    return counts
