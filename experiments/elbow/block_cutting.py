"""Where tosses of two blocks on a hinge are cut.

A flight is the longest part of a toss in which nothing but gravity accelerates the center of mass: second differences
of the middle between the blocks are within 6 m/s^2 of gravity, and every corner is 16 mm or more above the table. A
toss begins with its flight; where that has fewer than five frames, with the five in which these differences are
smallest.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import sheetbend as sb
from blocks import LEVELED, RATE, SIDES, UP, second_block
from sheetbend.arrays.rotations import matrices_of
from toss_files import read, told_fall  # beside the tossed cube, where `blocks` finds it

Arrays = dict[str, np.ndarray]
COLUMNS = {"position": (3,), "quaternion": (4,), "angle": ()}
ABOVE = 0.016  # m
FREE = 6.0  # m/s^2
GRAVITY = np.array([0.0, 0.0, -9.63])  # m/s^2, in the unit of the recording
FEWEST = 11  # frames of a flight
LEAST = 5  # of the beginning of a toss


def free(x: np.ndarray, frames: np.ndarray, angles: np.ndarray) -> slice:
    """The frames of one toss that are a flight; none where it has too few before it touches the table."""
    corners = sb.box_corners(SIDES)
    centers, turned = second_block(x, frames, angles)
    both = [o[:, None] + np.einsum("fab,kb->fka", R, corners) for o, R in ((x, frames), (centers, turned))]
    low = np.concatenate(both, axis=1)[..., 2].min(axis=1) < ABOVE
    end = int(low.argmax()) if low.any() else len(x)
    if end < LEAST:
        return slice(0, 0)
    pull = np.linalg.norm(np.diff((x + centers)[:end] / 2, 2, axis=0) * RATE**2 - GRAVITY, axis=1)
    edges = [-1, *np.flatnonzero(pull > FREE), len(pull)]
    first, last = max(pairwise(edges), key=lambda pair: pair[1] - pair[0])
    found = slice(first + 1, last + 2)  # a second difference takes a frame on either side
    if found.stop - found.start >= LEAST:
        return found
    quietest = int(np.convolve(pull**2, np.ones(LEAST - 2), "valid").argmin())
    return slice(quietest, quietest + LEAST)


def leaning(numbers: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, str]:
    """Which tosses were recorded in axes that lean against the table, and how that was found.

    Blocks that rest flat show it by the normal of the table in the axes of the recording (tosses, 3), which is NaN of
    the others. The numbers of the source say it where they agree with nine of ten of these; otherwise most of the
    nearest five do.
    """
    flat = np.flatnonzero(np.isfinite(normals[:, 0]))
    near = np.linalg.norm(normals - UP, axis=1) < np.linalg.norm(normals - [0.0, 0.0, 1.0], axis=1)
    stated = numbers < LEVELED
    if (near[flat] == stated[flat]).sum() >= 0.9 * len(flat):
        return stated, f"tosses before number {LEVELED} are turned upright"
    closest = np.argsort(np.abs(flat - np.arange(len(numbers))[:, None]), axis=1, kind="stable")[:, :5]
    most = near[flat][closest].mean(axis=1) > 0.5
    return most, f"{most.sum()} of {len(most)} tosses are turned upright, as blocks lie that rest flat"


def table_normal(frames: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Of blocks that rest flat, in attitudes (3, 3); NaN where a block leans."""
    found = []
    for rest in (frames, turned):
        axis = int(np.abs(rest[2]).argmax())
        found.append(rest[:, axis] * np.sign(rest[2, axis]))
    flat = found[0] @ found[1] > np.cos(np.radians(1.5)) and found[0][2] > np.cos(np.radians(5.0))
    return np.mean(found, axis=0) if flat else np.full(3, np.nan)


def cut(source: Mapping[str, np.ndarray]) -> tuple[Arrays, Arrays, list[str]]:
    """The free flights and the whole tosses of `elbow_tosses.npz`: what flights.npz and tosses.npz hold, and a sentence
    on each toss that is not among them."""
    x, angles, turns = source["position"], source["angle"], source["quaternion"][:, [1, 2, 3, 0]]
    frames, ends = matrices_of(turns), list(pairwise(source["starts"]))
    parts = [free(x[a:b], frames[a:b], angles[a:b]) for a, b in ends]
    flown = np.array([part.stop - part.start for part in parts])
    words = [
        f"toss {number}: touches the table in its first {LEAST} frames"
        for number, n in zip(source["toss"], flown, strict=True)
        if n == 0
    ]
    words.append(f"{((flown > 0) & (flown < FEWEST)).sum()} landings have fewer than {FEWEST} frames of free flight")
    usable = flown > 0
    normals = [
        table_normal(frames[b - 1], second_block(x[b - 1 : b], frames[b - 1 : b], angles[b - 1 : b])[1][0])
        for _, b in ends
    ]
    leans, how = leaning(source["toss"], np.array(normals))
    words.append(how)
    whole = [np.arange(a + part.start, b) for (a, b), part in zip(ends, parts, strict=True)]
    kept = [own[:count] for own, count in zip(whole, flown, strict=True) if count >= FEWEST]
    down = [own for own, can in zip(whole, usable, strict=True) if can]
    which, every = (np.concatenate([np.zeros(0, dtype=int), *own]) for own in (kept, down))
    turning = np.concatenate([np.zeros(0), *(np.unwrap(angles[own]) for own in down)])
    return (
        {
            "starts": np.cumsum([0, *map(len, kept)]),
            "toss": source["toss"][flown >= FEWEST],
            "leans": leans[flown >= FEWEST],
            "positions": x[which],
            "quaternions": turns[which],
            "angles": angles[which],
        },
        {
            "starts": np.cumsum([0, *map(len, down)]),
            "toss": source["toss"][usable],
            "leans": leans[usable],
            "free": flown[usable],
            "positions": x[every].astype(np.float32),
            "quaternions": turns[every].astype(np.float32),
            "angles": turning.astype(np.float32),
        },
        words,
    )


def read_and_cut(folder: Path) -> tuple[Arrays, Arrays]:
    """Those of a folder; prints how many there are, and why others are left out."""
    source, bad = read(folder / "elbow_tosses.npz", COLUMNS, RATE)
    flights, tosses, words = cut(source)
    told = f"{len(source['toss'])} tosses, {len(flights['toss'])} free flights, {len(tosses['toss'])} landings"
    falls = told_fall([flights["positions"][a:b, 2] for a, b in pairwise(flights["starts"])], RATE)
    print("\n  ".join([f"{folder}: {told}", *bad, *words, *falls]))
    return flights, tosses
