"""Which part of the recordings decides whether a rung stays: some of them, or the end of each where they are few."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .motion import GrippedMotion

LEAST = 5  # frames of each part of a recording that is cut


def split(motions: Sequence[GrippedMotion], share: float) -> tuple[list[GrippedMotion], list[GrippedMotion]]:
    """Divide motions into those that rungs are fitted to and those that judge them.

    Whole recordings judge, spread evenly over the set, where `share` of them is at least one. Otherwise each recording
    is cut in time: its first part is fitted, and its last part, predicted from its own first frame, judges.

    Args:
        share: of the recordings or of their time that judges, below 1; at 0 nothing does.

    Returns:
        (fitted, judging). The second list is empty where `share` is 0 or where recordings are too short to cut.
    """
    count = len(motions)
    if share == 0.0:
        return list(motions), []
    others = round(share * count)
    if 0 < others < count:
        judging = set(np.linspace(0, count - 1, others, dtype=int).tolist())
        return (
            [m for i, m in enumerate(motions) if i not in judging],
            [m for i, m in enumerate(motions) if i in judging],
        )
    halves = [_cut(m, 1.0 - share) for m in motions]
    return [m for parts in halves for m in parts[:1]], [m for parts in halves for m in parts[1:]]


def _cut(motion: GrippedMotion, share: float) -> tuple[GrippedMotion, ...]:
    """The part up to a share of the time and the rest, which starts at a frame that shows enough; or only the whole."""
    count = len(motion.recording.times)
    at = round(share * count)
    while at < count and not motion.shown(at):
        at += 1
    if at < LEAST or count - at < LEAST:
        return (motion,)
    return motion.frames(slice(0, at)), motion.frames(slice(at, count))
