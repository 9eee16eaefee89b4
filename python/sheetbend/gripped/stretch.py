"""The part of a recording that can be used where its grips are lost for a while."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..arrays import timeseries
from ..recording.recording import Recording
from .motion import BRIDGED

LEAST = 1.5  # s: shorter parts show little of a motion


def longest_stretch(recording: Recording, inner: tuple[int, int]) -> slice | None:
    """The longest part in which no gap of a gripped marker, and none of the times, is too long to bridge; it begins and
    ends where all of them are seen, and begins with half of the free markers. None where that is too short, or all.

    Args:
        inner: numbers of the two inner gripped markers.
    """
    times, seen = recording.times, recording.mask
    gap = max(timeseries.default_max_gap(times), BRIDGED) * (1.0 + 1e-9)
    gripped = sorted(recording.clamped)
    whole = np.asarray(seen[:, gripped].all(axis=1))
    begins = whole & (2 * seen[:, inner[0] + 1 : inner[1]].sum(axis=1) >= inner[1] - inner[0] - 1)
    broken = np.zeros(len(times), dtype=bool)  # between this frame and the one before
    for k in gripped:
        for before, after in pairwise(np.flatnonzero(seen[:, k]).tolist()):
            if times[after] - times[before] > gap:
                broken[before + 1 : after + 1] = True
    best, most = slice(0, len(times)), 0.0
    for a, b in pairwise([0, *np.flatnonzero(broken).tolist(), len(times)]):
        first, last = np.flatnonzero(begins[a:b]), np.flatnonzero(whole[a:b])
        if len(first) and (lasts := float(times[a + last[-1]] - times[a + first[0]])) > most:
            best, most = slice(a + int(first[0]), a + int(last[-1]) + 1), lasts
    return None if most < LEAST or best == slice(0, len(times)) else best
