"""Where tosses of a cube are cut.

A flight ends with the last frame in which every corner is 4 mm or more above the table. It begins when the hand has let
go: from then on the angular speed stays within 6 % of its median over the second half. A toss goes on from there until
the cube rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.arrays.rotations import matrices_of
from toss_files import read, told_fall

Arrays = dict[str, np.ndarray]
RATE = 148.0  # Hz
COLUMNS = {"position": (3,), "quaternion": (4,)}
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
    if usual == 0.0:
        return 0
    smooth = np.convolve(np.pad(speed, 1, mode="edge"), np.ones(3) / 3.0, mode="valid")
    off = np.flatnonzero(np.abs(smooth / usual - 1.0) > STEADY)
    return int(off[-1]) + 2 if len(off) else 0


def cut(source: Mapping[str, np.ndarray]) -> tuple[Arrays, Arrays, list[str]]:
    """The free flights and the whole tosses of `cube_tosses.npz`: what flights.npz and tosses.npz hold, and a sentence
    on each toss that is not among them."""
    corners = sb.box_corners(np.full(3, 2 * HALF))
    x, turns = source["position"], source["quaternion"][:, [1, 2, 3, 0]]
    lowest = (x[:, None] + np.einsum("fab,kb->fka", matrices_of(turns), corners))[..., 2].min(axis=1)
    whole, free, landed, words = [], [], [], []
    for number, (first, last) in zip(source["toss"], pairwise(source["starts"]), strict=True):
        low = lowest[first:last] < ABOVE
        frames = int(low.argmax()) if low.any() else last - first
        held = in_hand(turns[first : first + frames])
        whole.append(np.arange(first + held, last))
        free.append(frames - held)
        landed.append(low.any() and not low[0])
        if not landed[-1]:
            words.append(f"toss {number}: {'begins on the table' if low.any() else 'never touches the table'}")
    few = sum(lands and frames < FEWEST for lands, frames in zip(landed, free, strict=True))
    words.append(f"{few} landings have fewer than {FEWEST} frames of free flight")
    kept = [own[:frames] for own, frames in zip(whole, free, strict=True) if frames >= FEWEST]
    down = [own for own, lands in zip(whole, landed, strict=True) if lands]
    which, every = (np.concatenate([np.zeros(0, dtype=int), *own]) for own in (kept, down))
    words += told_fall([x[own, 2] for own in kept], RATE)
    return (
        {
            "starts": np.cumsum([0, *map(len, kept)]),
            "toss": source["toss"][np.array(free) >= FEWEST],
            "positions": x[which],
            "quaternions": turns[which],
        },
        {
            "starts": np.cumsum([0, *map(len, down)]),
            "toss": source["toss"][np.array(landed)],
            "free": np.array(free)[np.array(landed)],
            "positions": x[every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
        },
        words,
    )


def read_and_cut(folder: Path) -> tuple[Arrays, Arrays]:
    """Those of a folder; prints how many there are, and why others are left out."""
    source, bad = read(folder / "cube_tosses.npz", COLUMNS, RATE)
    flights, tosses, words = cut(source)
    told = f"{len(source['toss'])} tosses, {len(flights['toss'])} free flights, {len(tosses['toss'])} landings"
    print("\n  ".join([f"{folder}: {told}", *bad, *words]))
    return flights, tosses
