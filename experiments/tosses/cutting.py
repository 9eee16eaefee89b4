"""Where tosses of a cube are cut.

A flight ends with the last frame in which every corner is 4 mm or more above the table. It begins when the hand has let
go: from then on the angular speed stays within 6 % of its median over the second half. A toss goes on from there until
the cube rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import sheetbend as sb
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
    corners = sb.box_corners(np.full(3, 2 * HALF))
    x, turns = source["position"], source["quaternion"][:, [1, 2, 3, 0]]
    lowest = (x[:, None] + np.einsum("fab,kb->fka", matrices_of(turns), corners))[..., 2].min(axis=1)
    whole, free = [], []
    for first, last in pairwise(source["starts"]):
        low = lowest[first:last] < ABOVE
        frames = int(low.argmax()) if low.any() else last - first
        held = in_hand(turns[first : first + frames])
        whole.append(np.arange(first + held, last))
        free.append(frames - held)
    kept = [own[:frames] for own, frames in zip(whole, free, strict=True) if frames >= FEWEST]
    which, every = np.concatenate(kept), np.concatenate(whole)
    return (
        {
            "starts": np.cumsum([0, *map(len, kept)]),
            "toss": source["toss"][np.array(free) >= FEWEST],
            "positions": x[which],
            "quaternions": turns[which],
        },
        {
            "starts": np.cumsum([0, *map(len, whole)]),
            "toss": source["toss"],
            "free": np.array(free),
            "positions": x[every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
        },
    )
