"""Whether a rope in a recording stretches, as one of rubber does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays.types import Array
from .seen import Seen

STRETCHES = 0.02  # of its length: a rope that stretches gets longer by more; others stay within a third of it
STRAIGHT, FEWEST = 0.5, 5  # rad between neighbors at most, and markers: otherwise the line through them misses bends
BY_NOISE = 5.0  # times the noise of a marker: by so much the length of a line through markers changes
USUAL = (0.05, 0.95)  # quantiles between which a length changes


class Stretch(NamedTuple):
    """How a rope stretches.

    Attributes:
        shortest: m, through its markers where it is shortest.
        by: relative to it, how much longer it gets.
        arcs: (markers,) m along it where it is shortest, from the first marker.
    """

    shortest: float
    by: float
    arcs: Array


def stretching(s: Seen, order: tuple[int, ...]) -> Stretch | None:
    """How a rope that moves stretches, by frames in which it is almost straight; None where it hardly does."""
    if s.static or len(order) < FEWEST:
        return None
    x = s.recording.positions[:, list(order)]
    x = x[np.isfinite(x).all(axis=(1, 2))]
    if not len(x) or np.ptp(x, axis=(0, 1)).min() == 0.0:  # one camera sees no depth
        return None
    parts = arcs_between(x)[turns_between(x).max(axis=1) < STRAIGHT]
    if not len(parts):
        return None
    length = parts.sum(axis=1)
    low, high = (float(v) for v in np.quantile(length, USUAL))
    if high / low - 1.0 <= STRETCHES + BY_NOISE * s.noise / low:
        return None
    arcs = np.concatenate([[0.0], np.cumsum(np.median(parts[length <= low], axis=0))])
    return Stretch(float(arcs[-1]), high / low - 1.0, arcs)


def arcs_between(x: Array) -> Array:
    """(frames, markers - 1) m, along a rope from each of its markers (frames, markers, 3) to the next: an arc of length
    l that turns by theta is longer than its chord by l theta^2/24."""
    chords = np.linalg.norm(np.diff(x, axis=1), axis=2)
    turns = turns_between(x) ** 2
    inner = np.concatenate([turns[:, :1], 0.5 * (turns[:, 1:] + turns[:, :-1]), turns[:, -1:]], axis=1)
    return np.asarray(chords * (1.0 + inner / 24.0))


def turns_between(x: Array) -> Array:
    """(frames, markers - 2) rad, by which a line through markers (frames, markers, 3) turns at each inner one."""
    links = np.diff(x, axis=1)
    ways = links / np.linalg.norm(links, axis=2, keepdims=True)
    return np.asarray(np.arccos(np.clip((ways[:, 1:] * ways[:, :-1]).sum(axis=2), -1.0, 1.0)))
