"""Markers in a recording that tell nothing of what moves in it: reflections, marks of the room, and copies.

What holds an object is near it, or keeps its distance from the nearest marker on it. A mark of the room does neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays.types import Array
from ..recording.recording import Recording
from .text import joined

RARE = 0.2  # of the frames in which the best one is seen: a marker seen in fewer is a reflection, or a stray
RESTLESS, WILD = 10.0, 0.1  # noise of a reflection: times that of the others, and of the size of what they show
WHITE = 0.5  # of its spread, the noise of a marker that goes from anywhere to anywhere
FAR = 3.0  # times the distance between neighbors: markers of one object, and of what holds it, are nearer
OUTSIDE = 0.5  # of the size of what moves: how far a mark of the room is from it
KEEPS = 0.2  # of the distance between neighbors, and of their motion: by so much that of a holder changes at most (sd)
FEWEST = 3  # markers of which one can be a stranger


class Strangers(NamedTuple):
    """Numbers of markers that are left out, and a sentence about them."""

    markers: tuple[int, ...]
    said: str


def rare(recording: Recording) -> Strangers | None:
    """Markers that are hardly ever seen."""
    often = recording.mask.mean(axis=0)
    found = np.flatnonzero(often < RARE * often.max())
    return _strangers(recording, found, "seen in less than a fifth of the frames, and left out")


def twice(recording: Recording) -> Strangers | None:
    """Markers at the place of an earlier one in every frame, as a tool and the end of a rope that is welded to it in a
    simulator."""
    first: dict[bytes, int] = {}
    places = [recording.positions[:, k].tobytes() for k in range(len(recording.markers))]
    found = [k for k, place in enumerate(places) if first.setdefault(place, k) != k]
    return _strangers(recording, found, "at the place of another marker in every frame, and left out")


def restless(recording: Recording, noise: Array) -> Strangers | None:
    """Markers that are somewhere else in every frame.

    Args:
        noise: (markers,) m, that of each.
    """
    x, count = recording.positions, len(noise)
    if count < FEWEST or not np.isfinite(noise).any():
        return None
    found, spread = list[int](), np.sqrt(np.nanvar(x, axis=0).mean(axis=1))
    for k in np.flatnonzero((noise > RESTLESS * np.nanmedian(noise)) & (noise > WHITE * spread)):
        others = np.delete(x, k, axis=1)
        size = np.linalg.norm(np.subtract(*np.nanquantile(others, [0.99, 0.01], axis=(0, 1))))
        found += [int(k)] if noise[k] > WILD * size else []
    return _strangers(recording, found, "somewhere else in every frame, as reflections are, and left out")


def of_the_room(recording: Recording, still: Array, distance: Array, noise: Array) -> Strangers | None:
    """Markers that stay in place, far from what moves, and that hold nothing.

    Args:
        still: (markers,) whether each stays in place.
        distance: (frames, markers, markers) m.
        noise: (markers,) m, that of each, or not a number.
    """
    moving, resting = np.flatnonzero(~still), np.flatnonzero(still)
    if len(still) < FEWEST or not len(moving) or not len(resting):
        return None
    mean, own = np.nanmean(distance, axis=0), np.nan_to_num(noise) ** 2
    varies = np.sqrt(np.maximum(np.nanvar(distance, axis=0) - own[:, None] - own, 0.0))
    moved = np.sqrt(np.nanvar(recording.positions, axis=0).sum(axis=1))
    among = mean[np.ix_(moving, moving)] + np.where(np.eye(len(moving), dtype=bool), np.inf, 0.0)
    alone = len(moving) == 1  # as the end of a pendulum
    spacing = float(mean[np.ix_(moving, resting)].min() if alone else np.median(among.min(axis=1)))
    nearest = moving[np.argmin(mean[np.ix_(resting, moving)], axis=1)]
    away = mean[resting, nearest]
    holds = (away <= FAR * spacing) | (varies[resting, nearest] <= KEEPS * np.minimum(moved[nearest], spacing))
    holds &= away <= FAR * max(float(away[holds].min(initial=np.inf)), spacing)
    between = mean[np.ix_(resting, resting)]
    while (more := ~holds & (between[:, holds].min(axis=1, initial=np.inf) <= FAR * spacing)).any():
        holds |= more  # the line goes on where it hangs still
    object_ = np.concatenate([moving, resting[holds]])
    size = float(mean[np.ix_(object_, object_)].max())
    return _strangers(
        recording, resting[~holds & (away > OUTSIDE * size)], "in one place, far from what moves, and left out"
    )


def _strangers(recording: Recording, found: Array | list[int], how: str) -> Strangers | None:
    if not len(found):
        return None
    names = [recording.markers[k] for k in found]
    return Strangers(tuple(int(k) for k in found), f"{joined(names)} {'is' if len(names) == 1 else 'are'} {how}")
