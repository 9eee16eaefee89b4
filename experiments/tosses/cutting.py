"""Where tosses of a cube are cut.

A flight ends with the last frame in which every corner is 4 mm or more above the table. It begins when the hand has let
go: from then on the angular speed stays within 6 % of its median over the second half. A toss goes on from there until
the cube rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from sheetbend.arrays.rotations import matrices_of

Arrays = dict[str, np.ndarray]
HALF = 0.0524  # m, of a side, as the source states
ABOVE = 0.004  # m
STEADY = 0.06
FEWEST = 9  # frames


def in_hand(quaternions: np.ndarray) -> int:
    """How many frames, of quaternions (frames, 4), the angular speed takes to become steady."""
    if len(quaternions) < 3:
        return 0
    cosines = np.abs((quaternions[1:] * quaternions[:-1]).sum(axis=1))
    speed = np.arccos(np.clip(cosines, 0.0, 1.0))
    usual = np.median(speed[len(speed) // 2 :])
    smooth = np.convolve(np.pad(speed, 1, mode="edge"), np.ones(3) / 3.0, mode="valid")
    off = np.flatnonzero(np.abs(smooth / usual - 1.0) > STEADY)
    return int(off[-1]) + 2 if len(off) else 0


def cut(source: Mapping[str, np.ndarray]) -> tuple[Arrays, Arrays]:
    """The free flights and the whole tosses of `cube_tosses.npz`: what flights.npz and tosses.npz hold."""
    corners = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    turns = source["quaternion"][:, [1, 2, 3, 0]]
    lowest = (source["position"][:, None] + np.einsum("fab,kb->fka", matrices_of(turns), corners))[..., 2].min(axis=1)
    starts = source["starts"]
    kept, numbers, flights = [], [], [0]
    whole, tosses, free = [], [0], []
    for number, (first, last) in zip(source["toss"], pairwise(starts), strict=True):
        low = lowest[first:last] < ABOVE
        frames = int(low.argmax()) if low.any() else last - first
        held = in_hand(turns[first : first + frames])
        first, frames = first + held, frames - held
        whole.append(np.arange(first, last))
        tosses.append(tosses[-1] + last - first)
        free.append(frames)
        if frames >= FEWEST:
            kept.append(np.arange(first, first + frames))
            numbers.append(number)
            flights.append(flights[-1] + frames)
    which, every = np.concatenate(kept), np.concatenate(whole)
    return (
        {
            "starts": np.array(flights),
            "toss": np.array(numbers),
            "positions": source["position"][which],
            "quaternions": turns[which],
        },
        {
            "starts": np.array(tosses),
            "toss": source["toss"],
            "free": np.array(free),
            "positions": source["position"][every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
        },
    )
