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
        static: whether it hangs at rest in all frames.
        slung: whether it lies between two sides that are held, its x axis from one to the other.
        starts_flat: whether it lies flat in the first frame: a shape through its noisy markers would have wrinkles.
        slack: what it is without tension, where its motion shows it.
        wind: (3,) m/s, a guess, where the cloth hangs askew and hardly moves; None elsewhere.
        margin: m, on the left, right, lower and upper side, by which it goes on beyond that, as was measured.
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
    static: bool
    slung: bool
    starts_flat: bool
    slack: Slack | None
    wind: Array | None
    margin: tuple[float, ...] | None = None
    ride: Riding | None = None

    @property
    def tension(self) -> tuple[str, ...]:
        """Its stiffnesses in tension that its recording shows. Kept at a guess they draw the others off: the wind of
        experiments/cloth_in_wind from 3 to 9 mm, and a cloth in two clips falls by 5 mm in its first 50 ms."""
        at_corners = not self.static and any(hold.corners for hold in self.held)
        return ("warp",) if self.slung else ("warp", "shear") if self.wind is not None or at_corners else ()

    @property
    def sizes(self) -> tuple[str, ...]:
        """Those of the flat fabric that its tension depends on: of what the markers show it is stretched there."""
        return ("warp_size", "weft_size")[: len(self.tension)]
