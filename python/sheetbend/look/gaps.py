"""The longest piece of a recording in which what moves its scene is seen, where it is lost for too long elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .take import GAP, Take
from .text import joined

FEWEST = 30  # frames of such a piece


def without_gaps(take: Take, driving: Sequence[str]) -> tuple[Take, str] | None:
    """The take from its longest piece alone, and a sentence about that; None where nothing is lost for too long, or too
    little is left.

    Args:
        driving: markers that move something. A cubic closes what is lost of them for up to `GAP` s.
    """
    r = take.seen.recording
    columns = [k for k, name in enumerate(r.markers) if name in driving]
    seen, times = r.mask[:, columns], r.times
    lost = [
        gap
        for own in seen.T
        for gap in zip(np.flatnonzero(own)[:-1], np.flatnonzero(own)[1:], strict=True)
        if times[gap[1]] - times[gap[0]] > GAP
    ]
    ends = [(-1, int(np.flatnonzero(own)[0])) for own in seen.T if not own[0]]
    ends += [(int(np.flatnonzero(own)[-1]), len(times)) for own in seen.T if not own[-1]]
    if not lost and not ends:
        return None
    kept = np.ones(len(times), bool)
    for before, after in lost + ends:
        kept[before + 1 : after] = False
    borders = np.flatnonzero(np.diff(np.concatenate([[0], kept.astype(int), [0]])))
    whole = [np.flatnonzero(seen[a:b].all(axis=1)) + a for a, b in zip(borders[::2], borders[1::2], strict=True)]
    longest = max((run for run in whole if len(run)), key=lambda run: run[-1] - run[0], default=np.zeros(0, int))
    if not len(longest) or longest[-1] - longest[0] + 1 < FEWEST:
        return None
    first, last = int(longest[0]), int(longest[-1])
    part = take.seen.of(r.piece(float(times[first]), float(times[last]) + 1e-6))
    begin = take.frames[0] if take.frames is not None else 0
    many = "is" if len(columns) == 1 else "are"
    said = (
        f"{joined(r.markers[k] for k in columns)}, by which it is moved, {many} lost for longer than {GAP:g} s, or at "
        f"an end: only the longest piece without, from {times[first]:.4g} to {times[last]:.4g} s, is used (`frames`)"
    )
    return replace(take, seen=part, frames=(begin + first, begin + last + 1)), said
