"""Markers that tracking confuses: they exchange their labels, or are seen elsewhere for some frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import timeseries
from ..arrays.types import Array
from .exchanged import put_back_neighbors
from .leaps import SUDDEN, elsewhere, least_leap

BEFORE = 5  # frames from which the place of a marker is extrapolated
FORGOTTEN = 0.1  # s, for which a lost marker is extrapolated at most
CLOSER = 0.25  # of how far a marker is off its extrapolated place: how far it is at most from that whose label it has
NOISY = 8.0  # times the noise: how far a marker with another's label is at least off its extrapolated place
FEWEST = 10  # frames of a recording that is mended, and markers of one whose points may have no names
MANY = 200  # frames in which points without names are looked for
ANYWHERE = 0.3  # of the distance to others: how far points without names go from frame to frame at least


def shuffled(positions: Array) -> bool:
    """Whether markers (frames, markers, 3) are points without names: from frame to frame each goes about as far as it
    is from any other."""
    x = positions[:MANY]
    if len(x) < 3 or x.shape[1] < FEWEST:
        return False
    step = np.linalg.norm(np.diff(x, axis=0), axis=2)
    others = np.linalg.norm(x - np.roll(x, x.shape[1] // 2, axis=1), axis=2)
    known = np.isfinite(step).any() and np.isfinite(others).any()
    return bool(known and np.nanmedian(step) > ANYWHERE * np.nanmedian(others))


def relabeled(t: Array, positions: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Positions (frames, markers, 3) m with exchanged labels put back as they were in the first frames, and with NaN
    where a marker is elsewhere; and a sentence on each exchange and each such marker."""
    if len(t) < FEWEST:
        return positions, []
    x, said = put_back(t, positions, names)
    x, exchanged = put_back_neighbors(t, x, names)
    said += exchanged
    near, far = np.nanquantile(x, [0.01, 0.99], axis=(0, 1))  # reflections may be far away
    extent = float(np.linalg.norm(far - near))
    least = least_leap(t, extent)
    for k, name in enumerate(names):
        stray = elsewhere(t, x[:, k], least)
        if stray.any():
            x[stray, k] = np.nan
            first, last = t[np.flatnonzero(stray)[[0, -1]]]
            said.append(
                f"{name} is elsewhere in {stray.sum()} frames from {first:.4g} to {last:.4g} s: it is not used there"
            )
    return x, said


def put_back(t: Array, positions: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Positions (frames, markers, 3) m, and a sentence on every frame from which on labels are exchanged.

    The places of markers are extrapolated from the frames before. Where several markers are far from theirs, and each
    is at that of another one of them, they have exchanged their labels.
    """
    if len(t) < 3:  # nothing can turn suddenly
        return positions.copy(), []
    x, noise = positions.copy(), timeseries.noise(t, positions)
    floor = NOISY * float(np.nanmedian(noise)) if np.isfinite(noise).any() else 0.0
    said, step = [], float(np.median(np.diff(t)))
    for f in _sudden(t, x, floor):
        ahead, gap = _extrapolated(t, x, f)
        off = np.linalg.norm(x[f] - ahead, axis=1)
        gone = np.flatnonzero(off > np.maximum(floor, SUDDEN * step * gap))  # none that is lost
        if len(gone) < 2:
            continue
        to = np.linalg.norm(x[f, gone][:, None] - ahead[gone], axis=2)
        label, count = to.argmin(axis=1), np.arange(len(gone))
        moved, kept = np.zeros(len(gone), dtype=bool), to.min(axis=1) < CLOSER * off[gone]
        while (moved != kept).any():  # until they exchange labels among themselves
            moved = kept
            kept = moved & np.isin(label, count[moved]) & np.isin(count, label[moved])
        if moved.any():
            x[f:, gone[label[moved]]] = x[f:, gone[moved]].copy()
            said.append(f"{_joined([names[k] for k in gone[moved]])} exchange their labels at {t[f]:.4g} s: put back")
    return x, said


def _sudden(t: Array, x: Array, floor: float) -> list[int]:
    """Frames in which two markers or more turn at once, or come back."""
    turn = np.linalg.norm(np.diff(x, 2, axis=0), axis=2)
    least = np.maximum(floor, SUDDEN * np.minimum(np.diff(t)[1:], np.diff(t)[:-1]) ** 2)
    seen = np.isfinite(x[2:, :, 0])
    return [int(f) + 2 for f in np.flatnonzero((seen & ~(turn <= least[:, None])).sum(axis=1) > 1)]


def _extrapolated(t: Array, x: Array, f: int) -> tuple[Array, Array]:
    """(markers, 3) m, the places in frame f that are extrapolated from the frames before, NaN where these do not show a
    marker; and (markers,) s since each was seen."""
    ahead, gap = np.full(x.shape[1:], np.nan), np.full(x.shape[1], np.inf)
    first = max(0, int(np.searchsorted(t, t[f] - FORGOTTEN)) - BEFORE)
    seen = np.isfinite(x[first:f, :, 0])
    for k in np.flatnonzero(np.isfinite(x[f, :, 0]) & (seen.sum(axis=0) > 1)):
        own = first + np.flatnonzero(seen[:, k])[-BEFORE:]
        gap[k] = t[f] - t[own[-1]]
        if gap[k] <= FORGOTTEN:
            speed = np.median(np.diff(x[own, k], axis=0) / np.diff(t[own])[:, None], axis=0)
            ahead[k] = x[own[-1], k] + gap[k] * speed
    return ahead, gap


def _joined(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]])
