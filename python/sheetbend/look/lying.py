"""Ropes that lie on a floor or a table."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays.types import Array
from .falls import falls
from .held import BEYOND, gripping, parts
from .line import plane
from .seen import Seen

BAND = 0.01  # of the length: how high above the lowest markers counts as lying, and six times the noise at least
SHARE = 0.6  # of all that is seen, so low
SLIDES = 3.0  # times this band: how far markers move along the floor
RADIUS = 0.005  # m, taken as the rope's


class Table(NamedTuple):
    """What a rope lies on.

    Attributes:
        seen: the recording, with the axis that is up.
        up: (3,) unit vector.
        height: m along it, of the markers that lie.
    """

    seen: Seen
    up: Array
    height: float

    @property
    def point(self) -> list[float]:
        """m, on its surface, a radius below the markers that lie."""
        return [float(v) for v in (self.height - RADIUS) * self.up + 0.0]


def table_under(s: Seen, order: tuple[int, ...]) -> Table | None:
    """What a rope that moves lies on, where most of it stays at one height, and none of its ends stays in place. Where
    nobody tells which way is up, this may be across the plane that it moves in, as a camera from above shows it."""
    if s.static or {order[0], order[-1]} & set(s.still):
        return None
    return _table(s, order) or _table(_from_above(s, order), order)


def _table(s: Seen, order: tuple[int, ...]) -> Table | None:
    x = s.recording.positions[:, list(order)]
    up = 0.0 - s.gravity / np.linalg.norm(s.gravity)
    height = x @ up
    band = max(6.0 * s.noise, BAND * float(s.apart[np.ix_(order, order)].max()))
    low = height < np.nanquantile(height, 0.05) + band
    level = x - height[..., None] * up
    moved = float(np.sqrt(np.nanmean(np.nanvar(level, axis=0).sum(axis=1))))
    lies = low.sum() > SHARE * np.isfinite(height).sum() and moved > SLIDES * band
    return Table(s, up, float(np.median(height[low]))) if lies else None


def _from_above(s: Seen, order: tuple[int, ...]) -> Seen:
    """The same seen from above, where nothing tells which way is up and the rope moves in one plane without falling.
    One whose two ends are held, or a stiff one that swings in a clamp, does not fall in the air either."""
    x = s.recording.positions[:, list(order)]
    normal = plane(x, float(s.apart[np.ix_(order, order)].max()))
    if s.up_by != "guess" or normal is None or 1.0 not in normal or normal[s.up]:
        return s
    both_held = len(parts(s)[0]) == 2 or {order[0], order[-1]} <= gripping(s)
    spread = [float(np.nanvar(x[:, end], axis=0).sum()) for end in (0, -1)]
    clamped = min(spread) < BEYOND**2 * max(spread)
    return s if both_held or clamped or falls(s, order) else replace(s, up=normal.index(1.0))
