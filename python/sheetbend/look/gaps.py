"""The longest piece of a recording in which what moves its scene is seen, where it is lost for too long elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..arrays.timeseries import stretches
from .take import GAP, Take
from .text import joined

FEWEST = 30  # frames of such a piece


def without_gaps(take: Take, driving: Sequence[str]) -> tuple[Take, str] | None:
    """The take from its longest piece alone, and a sentence about that; None where nothing is lost for too long, or too
    little is left.

    Args:
        driving: markers that move something. A cubic closes what is lost of them for up to `GAP` s.
    """
    r, times = take.seen.recording, take.seen.recording.times
    columns, lost = _lost(take, driving)
    if not lost:
        return None
    kept = np.ones(len(times), bool)
    for before, after in lost:
        kept[before + 1 : after] = False
    whole = np.asarray(r.mask[:, columns].all(axis=1))
    spans = [(a + int(own[0]), a + int(own[-1])) for a, b in stretches(kept) if len(own := np.flatnonzero(whole[a:b]))]
    first, last = max(spans, key=lambda span: span[1] - span[0], default=(0, -1))
    if last - first + 1 < FEWEST:
        return None
    part = take.seen.of(r.piece(float(times[first]), float(times[last]) + 1e-6))
    begin = take.frames[0] if take.frames is not None else 0
    many = "is" if len(columns) == 1 else "are"
    said = (
        f"{joined(r.markers[k] for k in columns)}, by which it is moved, {many} lost for longer than {GAP:g} s, or at "
        f"an end: only the longest piece without, from {times[first]:.4g} to {times[last]:.4g} s, is used (`frames`)"
    )
    return replace(take, seen=part, frames=(begin + first, begin + last + 1)), said


def unfilled(take: Take, driving: Sequence[str]) -> list[str]:
    """That the draft of the whole take does not run, where what moves its scene is lost for too long; else nothing."""
    columns, lost = _lost(take, driving)
    if not lost:
        return []
    r, last = take.seen.recording, len(take.seen.recording.times) - 1
    spans = [(float(r.times[max(a, 0)]), float(r.times[min(b, last)])) for a, b in lost]
    start, stop = max(spans, key=lambda span: span[1] - span[0])
    names = joined(r.markers[k] for k in columns)
    they = "it is" if len(columns) == 1 else "they are"
    return [
        f"how it is moved by {names} while {they} lost for longer than {GAP:g} s, or at an end: in {take.file} the "
        f"longest from {start:.4g} to {stop:.4g} s. No piece without such gaps shows as much. "
        "This configuration does not run until they are filled in the file"
    ]


def _lost(take: Take, driving: Sequence[str]) -> tuple[list[int], list[tuple[int, int]]]:
    """The columns of markers that move something; and the last frame before and the first after each time that one of
    them is lost for longer than `GAP`, or at an end."""
    r = take.seen.recording
    columns = [k for k, name in enumerate(r.markers) if name in driving]
    lost = []
    for k in columns:
        own = [-1, *np.flatnonzero(r.mask[:, k]).tolist(), len(r.times)]
        lost += [(a, b) for a, b in pairwise(own[1:-1]) if r.times[b] - r.times[a] > GAP]
        lost += [(a, b) for a, b in {(own[0], own[1]), (own[-2], own[-1])} if b - a > 1]
    return columns, lost
