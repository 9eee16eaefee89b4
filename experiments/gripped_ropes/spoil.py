"""What is wrong with some training files of the nasty ropes: markers that are exchanged, seen elsewhere or frozen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from true_ropes import Array

FROM = 0.858  # of the frames: where markers are exchanged from the middle on, 429 of 500
JUMP = 1.5  # m, of a grip that is seen elsewhere: farther than the rope reaches
STRAY = np.array([0.36, 0.48, 0.64])  # the share of the frames at which it jumps for GLITCH of them, three times
GLITCH, FROZEN = 0.012, 0.15  # of the frames


def exchanged(positions: Array) -> Array:
    """The two markers of the last grip are exchanged in every frame."""
    spoiled = positions.copy()
    spoiled[:, [-2, -1]] = positions[:, [-1, -2]]
    return spoiled


def exchanged_midway(positions: Array) -> Array:
    """They are from a frame on: number 429 of 500."""
    first = round(FROM * len(positions))
    return np.concatenate([positions[:first], exchanged(positions[first:])])


def glitching(positions: Array) -> Array:
    """The first grip is seen elsewhere for some frames, three times: a simulation that follows it is flung about."""
    spoiled = positions.copy()
    width = max(1, round(GLITCH * len(positions)))
    for share, axis in zip(STRAY, range(3), strict=True):
        first = round(share * len(positions))
        spoiled[first : first + width, :2, axis] += JUMP
    return spoiled


def frozen(positions: Array) -> Array:
    """The tracking of the whole last grip stands still for a while, and then goes on where the markers really are."""
    spoiled = positions.copy()
    first, last = round(0.5 * len(positions)), round((0.5 + FROZEN) * len(positions))
    spoiled[first:last, -2:] = positions[first, -2:]
    return spoiled


SPOILED: dict[tuple[str, int], Callable[[Array], Array]] = {
    ("rope_1", 2): exchanged_midway,
    ("rope_1", 3): exchanged,
    ("rope_2", 1): glitching,
    ("rope_5", 2): frozen,
}
"""By rope and number of the training file."""
BELONGS = {("rope_4", 4): "rope_1"}
"""Training files that are recordings of another rope."""
