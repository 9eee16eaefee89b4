"""A fitted rope on recordings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..recording import Recording
from ..scores import Scores, scores
from .motion import Array
from .recipe import RopeFit


@dataclass(frozen=True)
class Evaluation:
    """Predictions beside what was measured.

    Attributes:
        recordings: those predicted to their end.
        predicted: of each (frames, markers, 3) m.
        scores: their errors beside the no-physics blend; None where nothing was predicted to its end.
        diverged: names of the recordings whose prediction was not finite.
    """

    recordings: tuple[Recording, ...]
    predicted: tuple[Array, ...]
    scores: Scores | None
    diverged: tuple[str, ...]


def evaluate(found: RopeFit, recordings: Sequence[Recording]) -> Evaluation:
    """Predict each recording open loop from its first frame, and score it (`sheetbend.scores`)."""
    pairs = [(recording, found.predict(recording)) for recording in recordings]
    whole = [(recording, x) for recording, x in pairs if np.isfinite(x[recording.mask]).all()]
    kept, predicted = tuple(r for r, _ in whole), tuple(x for _, x in whole)
    diverged = tuple(r.name for r, x in pairs if not np.isfinite(x[r.mask]).all())
    return Evaluation(kept, predicted, scores(kept, predicted) if kept else None, diverged)
