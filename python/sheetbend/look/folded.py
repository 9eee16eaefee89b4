"""Sheets that are the two sides of one cloth, which lies over something between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from .cloth_held import row_of
from .seen import Seen
from .sheet import spacing

NEAR = 3.0  # spacings between the upper rows of both, at most
VARIES = 0.1  # of this distance: its standard deviation over time at most
PARALLEL = 0.9  # cosine of the angle between both rows, at least


def folded(s: Seen, cloths: Sequence[tuple[list[int], Array]]) -> list[tuple[int, int]]:
    """Pairs of sheets whose upper rows face each other at one height and keep their distance, while what hangs from
    them is on either side: no marker shows how the fabric runs from one row to the other.

    Args:
        cloths: of each its markers, and where they lie on it, (markers, 2) m, with y upward.
    """
    return [
        (i, j) for i, one in enumerate(cloths) for j, other in enumerate(cloths[i + 1 :], i + 1) if _face(s, one, other)
    ]


def _face(s: Seen, one: tuple[list[int], Array], other: tuple[list[int], Array]) -> bool:
    x = s.recording.positions
    up = -s.gravity / np.linalg.norm(s.gravity)
    apart = max(spacing(s.apart[np.ix_(own, own)]) for own, _ in (one, other))
    rows = [[own[k] for k in row_of(flat, "top", apart)] for own, flat in (one, other)]
    if min(len(row) for row in rows) < 2:
        return False
    ends = [np.nanmean(x[:, row[-1]] - x[:, row[0]], axis=0) for row in rows]
    a, b = (end / np.linalg.norm(end) for end in ends)
    centers = [np.nanmean(x[:, row], axis=1) for row in rows]
    between = centers[1] - centers[0]
    distance = np.linalg.norm(between, axis=1)
    across = np.nanmean(between, axis=0)
    if abs(a @ b) < PARALLEL or abs(across @ a) > 0.5 * min(np.linalg.norm(end) for end in ends):
        return False
    gap = float(np.nanmean(distance))
    if gap > NEAR * apart or np.nanstd(distance) > VARIES * gap or abs(across @ up) > 0.5 * gap:
        return False
    below = [
        np.nanmean(x[:, own], axis=(0, 1)) - np.nanmean(center, axis=0)
        for (own, _), center in zip((one, other), centers, strict=True)
    ]
    return bool(below[0] @ across < 0 < below[1] @ across)
