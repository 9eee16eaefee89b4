"""Grips that are recorded later than the other markers, such as poses that a robot reports with a delay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .judging import predict
from .model import RopeModel
from .motion import GrippedMotion

STEP = 5e-3  # s, along which predictions change
ROUNDS = 2  # of a linear estimate; one where it finds less than `LEAST`
LEAST = 4e-3  # s: of less, what the model lacks may make as much
LEFT = 5e-4  # s, that may be left of what was found
FEW = 6  # motions that tell it
MOST = 0.1  # s


def lateness(
    model: RopeModel, motions: Sequence[GrippedMotion], values: Mapping[str, float], threads: int = 1
) -> float | None:
    """By how many s the markers of the grips come after the others, as predictions with these values tell; negative
    where they come before. None where a prediction has no answer, or where it would be more than 0.1 s."""
    late, some = 0.0, np.unique(np.linspace(0, len(motions) - 1, FEW).astype(int))
    motions = [motions[k] for k in some]
    for _ in range(ROUNDS):
        here, there = (predict(model, [m.later(late + by) for m in motions], values, threads) for by in (0.0, STEP))
        along = off = 0.0
        for motion, x, y in zip(motions, here, there, strict=True):
            free = list(motion.free)
            change, left = (y - x)[:, free] / STEP, (motion.recording.positions - x)[:, free]
            seen = motion.recording.mask[:, free]
            if not (np.isfinite(x[:, free]).all() and np.isfinite(y[:, free]).all()):
                return None
            along += float((change[seen] * left[seen]).sum())
            off += float(np.square(change[seen]).sum())
        late += along / off if off > 0.0 else 0.0
        if abs(late) > MOST:
            return None
        if abs(late) < LEAST:
            break
    return late
