"""A cloth as its markers show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cloth_held import Hold
from .robot import Riding
from .slung import Slack

Array = np.ndarray


@dataclass(frozen=True)
class Sheet:
    """A cloth as its markers show it.

    Attributes:
        name: of the cloth in the configuration.
        own: its markers.
        flat: (markers, 2) m, where they lie on the fabric.
        width, height: m.
        low: (2,) m, from the left and lower edge to the outer markers.
        origin, axes: (3,) m and (2, 3), where the fabric lies best.
        held: what holds it.
        slung: whether it lies between two sides that are held, its x axis from one to the other.
        starts_flat: whether it lies flat in the first frame: a shape through its noisy markers would have wrinkles.
        slack: what it is without tension, where its motion shows it.
        wind: (3,) m/s, a guess, where the cloth hangs askew and hardly moves; None elsewhere.
        ride: how its upper edge rides on a tool, or its upper row where nothing tells where that edge is.
    """

    name: str
    own: list[int]
    flat: Array
    width: float
    height: float
    low: Array
    origin: Array
    axes: Array
    held: list[Hold]
    slung: bool
    starts_flat: bool
    slack: Slack | None
    wind: Array | None
    ride: Riding | None = None
