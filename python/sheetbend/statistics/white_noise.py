"""How much of some residuals is white noise, by how they bend from frame to frame."""

from __future__ import annotations

import numpy as np

from ..arrays.timeseries import Array
from .covariance import Layout


def white_noise(residuals: Array, layout: Layout, recording: int) -> float:
    """Mean square of the white noise that would make the second differences of one recording's residuals, and no more
    than the given sigma, which is 1. A motion adds to it, so that it is no less than the noise's.

    Args:
        residuals: (rows,) of all recordings, weighted by sigma.
        layout: of these.
        recording: which one.
    """
    own = np.flatnonzero(layout.recording == recording)
    own = own[np.lexsort((layout.frame[own], layout.channel[own], layout.clocks[own]))]
    series = np.stack([layout.clocks[own], layout.channel[own]])
    next_to = (np.diff(series) == 0).all(axis=0) & (np.diff(layout.frame[own]) == 1)
    three, r = next_to[:-1] & next_to[1:], residuals[own]
    bends = (r[:-2] - 2 * r[1:-1] + r[2:])[three]
    return min(1.0, float(np.mean(bends**2)) / 6.0) if bends.size else 1.0
