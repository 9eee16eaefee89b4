"""Ropes that lie on a floor or a table."""

from __future__ import annotations

import numpy as np

from .seen import Seen

BAND = 0.01  # of the length: how high above the lowest markers counts as lying, and six times the noise at least
SHARE = 0.6  # of all that is seen, so low
SLIDES = 3.0  # times this band: how far markers move along the floor


def lies(s: Seen, order: tuple[int, ...]) -> bool:
    """Whether most of a rope that moves stays at one height, as on a floor, and none of its ends stays in place."""
    if s.static or {order[0], order[-1]} & set(s.still):
        return False
    x = s.recording.positions[:, list(order)]
    up = -s.gravity / np.linalg.norm(s.gravity)
    height = x @ up
    band = max(6.0 * s.noise, BAND * float(s.apart[np.ix_(order, order)].max()))
    low = height < np.nanquantile(height, 0.05) + band
    level = x - height[..., None] * up
    moved = float(np.sqrt(np.nanmean(np.nanvar(level, axis=0).sum(axis=1))))
    return bool(low.sum() > SHARE * np.isfinite(height).sum() and moved > SLIDES * band)
