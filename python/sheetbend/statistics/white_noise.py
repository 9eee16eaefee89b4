"""How much of some series is white noise, by how they bend from frame to frame."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from .layout import Layout


def white_variance(x: Array, which: Array | slice = slice(None)) -> float:
    """Variance of the white noise that would make the second differences of a series, summed over the last axis where
    there are axes; 0 without any. A motion adds to it, so that it is no less than the noise's.

    Args:
        x: (n,), (n, axes) or (n, series, axes), consecutive samples.
        which: of the n - 2 second differences count; of each series where there are several.
    """
    bends = (x[:-2] - 2 * x[1:-1] + x[2:])[which] ** 2
    return float(bends.sum() / len(bends)) / 6.0 if bends.size else 0.0


def white_noise(residuals: Array, layout: Layout, recording: int) -> float:
    """`white_variance` of one recording's residuals, and no more than the given sigma, which is 1.

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
    return min(1.0, white_variance(r, three)) if three.any() else 1.0
