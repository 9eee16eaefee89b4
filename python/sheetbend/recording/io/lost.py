"""Markers that a file holds at exactly (0, 0, 0) where they were lost, as some motion capture systems write them."""

from __future__ import annotations

import numpy as np

from ...arrays.types import Array

FRAMES = 20  # at least: fewer do not tell
FAR = 0.1  # of the extent of all markers: how far a marker stays from the origin that is never there


def without_zeros(positions: Array) -> Array:
    """Positions (frames, markers, 3) with NaN for markers at exactly zero that otherwise stay far from there."""
    zero = (positions == 0.0).all(axis=2)
    if len(positions) < FRAMES or not zero.any():
        return positions
    elsewhere = np.where(zero[..., None], np.nan, positions)
    seen = np.isfinite(elsewhere[..., 0])
    if not seen.any():
        return positions
    extent = np.linalg.norm(np.nanmax(elsewhere, axis=(0, 1)) - np.nanmin(elsewhere, axis=(0, 1)))
    nearest = np.where(seen, np.linalg.norm(elsewhere, axis=2), np.inf).min(axis=0)
    lost = zero & seen.any(axis=0) & (nearest > FAR * extent)
    return np.where(lost[..., None], np.nan, positions)
