"""Where tosses of two blocks on a hinge are cut.

A flight is the longest part of a toss in which nothing but gravity accelerates the center of mass: second differences
of the middle between the blocks are within 6 m/s^2 of gravity, and every corner is 16 mm or more above the table. A
toss begins with its flight; where that has fewer than five frames, with the five in which these differences are
smallest.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import sheetbend as sb
from blocks import RATE, SIDES, second_block
from sheetbend.arrays.rotations import matrices_of

Arrays = dict[str, np.ndarray]
ABOVE = 0.016  # m
FREE = 6.0  # m/s^2
GRAVITY = np.array([0.0, 0.0, -9.63])  # m/s^2, in the unit of the recording
FEWEST = 11  # frames of a flight
LEAST = 5  # of the beginning of a toss


def free(x: np.ndarray, frames: np.ndarray, angles: np.ndarray) -> slice:
    """The frames of one toss that are a flight."""
    corners = sb.box_corners(SIDES)
    centers, turned = second_block(x, frames, angles)
    both = [o[:, None] + np.einsum("fab,kb->fka", R, corners) for o, R in ((x, frames), (centers, turned))]
    low = np.concatenate(both, axis=1)[..., 2].min(axis=1) < ABOVE
    end = int(low.argmax()) if low.any() else len(x)
    pull = np.linalg.norm(np.diff((x + centers)[:end] / 2, 2, axis=0) * RATE**2 - GRAVITY, axis=1)
    edges = [-1, *np.flatnonzero(pull > FREE), len(pull)]
    first, last = max(pairwise(edges), key=lambda pair: pair[1] - pair[0])
    found = slice(first + 1, last + 2)  # a second difference takes a frame on either side
    if found.stop - found.start >= LEAST:
        return found
    quietest = int(np.convolve(pull**2, np.ones(LEAST - 2), "valid").argmin())
    return slice(quietest, quietest + LEAST)


def cut(source: Mapping[str, np.ndarray]) -> tuple[Arrays, Arrays]:
    """The free flights and the whole tosses of `elbow_tosses.npz`: what flights.npz and tosses.npz hold."""
    x, angles, turns = source["position"], source["angle"], source["quaternion"][:, [1, 2, 3, 0]]
    frames, ends = matrices_of(turns), list(pairwise(source["starts"]))
    parts = [free(x[a:b], frames[a:b], angles[a:b]) for a, b in ends]
    whole = [np.arange(a + part.start, b) for (a, b), part in zip(ends, parts, strict=True)]
    flown = np.array([part.stop - part.start for part in parts])
    kept = [own[:count] for own, count in zip(whole, flown, strict=True) if count >= FEWEST]
    which, every = (np.concatenate([np.zeros(0, dtype=int), *own]) for own in (kept, whole))
    turning = np.concatenate([np.unwrap(angles[own]) for own in whole])
    return (
        {
            "starts": np.cumsum([0, *map(len, kept)]),
            "toss": source["toss"][flown >= FEWEST],
            "positions": x[which],
            "quaternions": turns[which],
            "angles": angles[which],
        },
        {
            "starts": np.cumsum([0, *map(len, whole)]),
            "toss": source["toss"],
            "free": flown,
            "positions": x[every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
            "angles": turning.astype(np.float32),
        },
    )
