"""Variances that follow from products of what the frames add to an estimate, a few frames apart (Newey & West 1987,
Econometrica 55, 703; 1994, Review of Economic Studies 61, 631)."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array


def newey_west(scores: list[Array]) -> Array:
    """(p,) variances by Bartlett-weighted lagged products, with the lag of Newey and West (1994).

    Args:
        scores: of each recording (frames, p), what each frame adds to the estimate.
    """
    frames = sum(len(part) for part in scores)
    longest = max(len(part) for part in scores) - 1
    pilot = min(int(4 * (frames / 100) ** (2 / 9)), longest)

    def product(lag: int) -> Array:
        parts = [(part[: max(len(part) - lag, 0)] * part[lag:]).sum(0) for part in scores]
        return np.asarray(np.sum(parts, axis=0))

    lagged = [product(lag) for lag in range(pilot + 1)]
    level = np.abs(lagged[0] + 2 * sum(lagged[1:]))
    slope = 2 * sum(lag * lagged[lag] for lag in range(1, pilot + 1)) if pilot else np.zeros_like(level)
    level = np.maximum(level, 1e-12 * lagged[0])
    bend = np.divide(slope, level, out=np.zeros_like(slope), where=level > 0)  # zero: no residual where it acts
    bandwidth = 1.1447 * (bend**2 * frames) ** (1 / 3)
    lags = np.minimum(bandwidth.astype(int), longest // 4)
    total = lagged[0].copy()
    for lag in range(1, int(lags.max()) + 1):
        total += 2 * np.maximum(1 - lag / (lags + 1), 0.0) * product(lag)
    return np.maximum(total, 0.0)
