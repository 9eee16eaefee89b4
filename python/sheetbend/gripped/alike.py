"""Brings the recordings of one rope to one unit of length, one order of markers, and one direction along the rope.

Each of these is decided by the rope itself: links between neighbors have the same lengths in all recordings, and
markers in order along it make the shortest line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from ..arrays.shortest_tree import tree
from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from ..files.units import METERS
from ..recording.recording import Recording
from ..recording.relabeled import put_back
from ..recording.unit_doubt import LONGEST, unit_doubt
from .end_links import long_chords
from .mend import SHORTER, steadied_order
from .motion import gripped_ends

FEWEST = 3  # recordings, from which one is compared with the others
MOST_FRAMES = 200  # of a recording, that its order is found from
CLOSE = 5.0  # of two units: a rope that is so much longer than the others may be another rope (an inch has 2.54 cm)
FACTORS = tuple(
    sorted({float(f"{a / b:.12g}") for a, b in permutations(METERS.values(), 2) if not 1 / CLOSE < a / b < CLOSE})
)
"""One unit of length over another."""
SAME = 0.05  # relative difference of lengths of one rope in different units
UNEVEN = 0.02  # median difference of logarithms of the links of a rope and of the same rope the other way round
CLEAR = 0.5  # of one direction's difference over that of the other, below which it is decided
OPPOSITE = -0.7  # cosine between the line from grip to grip and that of the others, where even links do not decide


def alike(recordings: Sequence[Recording], units: bool = True) -> tuple[list[Recording], list[list[str]]]:
    """The recordings, brought to one unit, order and direction, and sentences on what was done with each.

    Args:
        recordings: of one rope, most of them.
        units: whether a unit may be wrong in all of them; otherwise only one that differs from the others' is.
    """
    found, words = [], []
    for recording in recordings:
        other, said = _along(recording)
        found.append(other)
        words.append(said)
    for step in (lambda r: _in_one_unit(r, units), _in_one_direction):
        found, said_of = step(found)
        words = [[*old, *new] for old, new in zip(words, said_of, strict=True)]
    return found, words


def _along(recording: Recording) -> tuple[Recording, list[str]]:
    """The recording with its markers in the order in which the shortest line joins them, where more than neighbors are
    exchanged (`mend` puts these back). Names stay with places along the rope: the first name is then that of the first
    marker on it."""
    positions = steadied_order(recording)[0]
    if _order(positions) is None:
        return recording, []
    order = _order(put_back(recording.times, positions, recording.markers)[0])  # labels may be exchanged later on
    if order is None:
        return recording, []
    held = set(recording.clamped)
    moved = tuple(new for new, old in enumerate(order.tolist()) if old in held)
    names = ", ".join(recording.markers[k] for k in order)
    ordered = replace(recording, positions=recording.positions[:, order])
    try:  # the grips that are named, where that makes two; else those of that data set stay at the ends
        gripped_ends(replace(ordered, clamped=moved))
        ordered = replace(ordered, clamped=moved)
    except RecordingError:
        pass
    return ordered, [f"its markers are in the order {names} along the rope, and are taken in that order"]


def _order(positions: Array) -> np.ndarray | None:
    """The order of markers (frames, markers, 3) along the rope where it is clearly not the given one."""
    some = positions[np.linspace(0, len(positions) - 1, min(len(positions), MOST_FRAMES)).astype(int)]
    distance = mean_position(np.linalg.norm(some[:, :, None] - some[:, None], axis=3))
    given, order = np.arange(len(distance)), _shortest_line(distance)
    if order is None or max(abs(order - given)) < 2:
        return None
    before, after = (distance[o[:-1], o[1:]].sum() for o in (given, order))
    return order if after < SHORTER * before else None


def _shortest_line(distance: Array) -> np.ndarray | None:
    """The order in which the shortest tree joins markers, if it is a line, from the end whose number is lower."""
    if len(distance) < 2 or not np.isfinite(distance).all():
        return None
    beside, _ = tree(distance, tuple(range(len(distance))))
    ends = sorted(k for k, others in beside.items() if len(others) == 1)
    if len(ends) != 2:
        return None
    order = ends[:1]
    while len(order) < len(distance):
        order.append(next(k for k in beside[order[-1]] if k not in order[-2:]))
    return np.array(order)


def _in_one_unit(recordings: Sequence[Recording], units: bool) -> tuple[list[Recording], list[list[str]]]:
    """In meters, in which a rope is no longer than any, and as long as in most others."""
    lengths = np.array([np.nansum(long_chords(r.positions)) for r in recordings])
    words: list[list[str]] = [[] for _ in recordings]
    seen = lengths[lengths > 0.0]  # the others show no link, and keep their unit
    if not len(seen):
        return list(recordings), words
    plausible = seen[seen <= LONGEST] if units else seen
    if len(plausible):
        usual = float(np.median(plausible))
    else:
        middle = recordings[int(np.argsort(lengths)[len(lengths) - len(seen) + len(seen) // 2])]
        usual = float(np.median(seen)) * METERS[unit_doubt(middle) or "m"]
    found = []
    for recording, length, said in zip(recordings, lengths.tolist(), words, strict=True):
        factor = next((f for f in FACTORS if abs(length / (f * usual) - 1.0) < SAME), 1.0)
        if factor != 1.0:
            recording = replace(recording, positions=recording.positions / factor)
            said.append(
                f"its lengths are divided by {factor:g}: its rope was {length:.3g} m long, and is {usual:.3g} m"
            )
        found.append(recording)
    return found, words


def _in_one_direction(recordings: Sequence[Recording]) -> tuple[list[Recording], list[list[str]]]:
    """With the markers in the direction along the rope that most recordings have."""
    count = np.array([len(r.markers) for r in recordings])
    usual = int(np.bincount(count).argmax()) if len(count) else 0
    same = np.flatnonzero(count == usual)
    words: list[list[str]] = [[] for _ in recordings]
    if len(same) < FEWEST:
        return list(recordings), words
    least = np.finfo(float).tiny
    links = np.log([np.maximum(long_chords(recordings[k].positions), least) for k in same.tolist()])
    lines = np.array([_from_grip_to_grip(recordings[k]) for k in same.tolist()])
    against = _against(links, lines)
    found = list(recordings)
    for k in same[against].tolist():
        r = recordings[k]
        clamped = tuple(sorted(usual - 1 - i for i in r.clamped))
        found[k] = replace(r, positions=r.positions[:, ::-1], clamped=clamped)
        words[k].append("its markers run against those of the others along the rope, and are taken the other way round")
    return found, words


def _against(links: Array, lines: Array) -> np.ndarray:
    """(recordings,) whether each runs against most, from logarithms of its links (recordings, markers - 1) and its unit
    line from grip to grip (recordings, 3)."""
    turned = np.zeros(len(links), dtype=bool)
    for _ in range(2):  # with the medians of what is turned already
        usual = np.nanmedian(np.where(turned[:, None], links[:, ::-1], links), axis=0)
        given, other = (np.nanmedian(np.abs(x - usual), axis=1) for x in (links, links[:, ::-1]))
        backward = (other < CLEAR * given) & (given > UNEVEN)
        forward = (given < CLEAR * other) & (other > UNEVEN)
        along = lines @ np.nanmedian(np.where(turned[:, None], -lines, lines), axis=0)
        turned = np.where(backward | forward, backward, along < OPPOSITE)
    return turned if 2 * turned.sum() <= len(turned) else ~turned


def _from_grip_to_grip(recording: Recording) -> Array:
    """(3,) unit direction from the first marker to the last, on average; zero where they come together."""
    line = mean_position(recording.positions[:, -1] - recording.positions[:, 0])
    size = float(np.linalg.norm(line))
    return line / size if size > 0.0 else np.zeros(3)
