"""The windows that a fit of a gripped rope sees: pieces of recordings, each predicted from its first frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .motion import GrippedMotion

Span = tuple[float, float]
"""(length, total), s: windows of this length, of about this total."""
SPANS: tuple[Span, ...] = ((0.5, 8.0), (1.5, 15.0), (5.0, 60.0))


def everything(motions: Sequence[GrippedMotion], length: float) -> Span:
    """The span that takes every window of this length, s."""
    return length, length * sum(_held(motion, length) for motion in motions)


def _held(motion: GrippedMotion, length: float) -> int:
    """How many windows of this length, s, a motion holds; a shorter motion is one."""
    return max(1, int(motion.seconds / length + 1e-9))


def places(motions: Sequence[GrippedMotion], span: Span) -> list[tuple[GrippedMotion, float]]:
    """(motion, start in s) of the windows of a span, spread evenly over all motions; none starts where less than half
    of the free markers are seen."""
    length, total = span
    every = [
        (m, start)
        for m in motions
        for start in (m.recording.times[0] + length * np.arange(_held(m, length))).tolist()
        if m.shown(int(np.searchsorted(m.recording.times, start - 1e-9)))
    ]
    count = max(1, min(len(every), round(total / length)))
    return [every[i] for i in np.unique(np.linspace(0, len(every) - 1, count).astype(int))]


def counted(motions: Sequence[GrippedMotion], span: Span) -> str:
    """How many windows of which length a span takes, and of how many recordings: a phrase."""
    chosen = places(motions, span)
    seconds = float(np.median([min(span[0], m.seconds) for m, _ in chosen]))
    seen = len({id(m) for m, _ in chosen})
    whole = f"{len(motions)} recording{'s' if len(motions) > 1 else ''}"
    of = f"all {whole}" if seen == len(motions) > 1 else whole if seen == len(motions) else f"{seen} of {whole}"
    return f"{len(chosen)} window{'s' if len(chosen) > 1 else ''} of {seconds:.3g} s from {of}"
