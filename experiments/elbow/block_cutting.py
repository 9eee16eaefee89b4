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
    corners = SIDES / 2 * np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
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
    frames = matrices_of(turns)
    kept, numbers, flights = [], [], [0]
    whole, tosses, flown = [], [0], []
    for number, (first, last) in zip(source["toss"], pairwise(source["starts"]), strict=True):
        part = free(x[first:last], frames[first:last], angles[first:last])
        whole.append(np.arange(first + part.start, last))
        tosses.append(tosses[-1] + len(whole[-1]))
        flown.append(part.stop - part.start)
        if flown[-1] >= FEWEST:
            kept.append(np.arange(first + part.start, first + part.stop))
            numbers.append(number)
            flights.append(flights[-1] + len(kept[-1]))
    which, every = (np.concatenate([np.zeros(0, dtype=int), *parts]) for parts in (kept, whole))
    turning = np.concatenate([np.unwrap(angles[own]) for own in whole])
    return (
        {
            "starts": np.array(flights),
            "toss": np.array(numbers),
            "positions": x[which],
            "quaternions": turns[which],
            "angles": angles[which],
        },
        {
            "starts": np.array(tosses),
            "toss": source["toss"],
            "free": np.array(flown),
            "positions": x[every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
            "angles": turning.astype(np.float32),
        },
    )
