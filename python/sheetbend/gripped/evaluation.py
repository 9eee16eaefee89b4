"""A fitted rope on recordings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.checks import check_kind
from ..arrays.types import Array
from ..quantities.wording import short
from ..recording.recording import Recording
from ..report.scores import Scores, scores
from .model import NAME
from .motion import GrippedMotion
from .recipe import RopeFit
from .screening import screened
from .slips import slips, slips_said


@dataclass(frozen=True)
class Evaluation:
    """Predictions beside what was measured.

    Attributes:
        recordings: those predicted to their end.
        predicted: of each (frames, markers, 3) m.
        scores: their errors beside the no-physics blend; None where nothing was predicted to its end.
        diverged: names of the recordings whose prediction was not finite, or went farther off than the rope is long.
        notes: on recordings that were mended or left out, or in which the rope slips.
    """

    recordings: tuple[Recording, ...]
    predicted: tuple[Array, ...]
    scores: Scores | None
    diverged: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The mean errors in one sentence, for the summary of a report; empty where nothing was predicted."""
        if self.scores is None:
            return ""
        count = len(self.scores.rows)
        those = "a recording that was not fitted is" if count == 1 else f"{count} recordings that were not fitted are"
        words = f"{those} missed by {short(1e3 * self.scores.error)} mm (mean absolute coordinate error)"
        blend, it = self.scores.blend, "it" if count == 1 else "them"
        return (
            words if blend is None else f"{words}; a prediction without physics misses {it} by {short(1e3 * blend)} mm"
        )


def evaluate(found: RopeFit, recordings: Sequence[Recording | GrippedMotion]) -> Evaluation:
    """Predict each recording open loop from its first frame, and score it (`sheetbend.scores`).

    Recordings are screened first; motions are taken as they are. Shape and speed at the start, and what had slid inside
    a rope that yields, come from the first `smoothing` s of the model (`fit_rope`). The notes name recordings in which
    the rope slips in a grip, which no prediction knows.
    """
    check_kind("found", found, RopeFit, "give what fit_rope returns")
    usable = screened(recordings, found.model.smoothing)
    reach = found.values[f"{NAME}_length"]
    kept, predicted, diverged = [], [], []
    for motion in usable:
        recording, x = motion.recording, found.predict(motion)
        off = np.abs(x - recording.positions)[recording.mask]
        if (off <= reach).all():  # false where it is not a number
            kept.append(recording)
            predicted.append(x)
        else:
            diverged.append(recording.name)
    scored = scores(kept, predicted) if kept else None
    notes = (*usable.notes, *(words for motion in usable for words in slips_said(motion, slips(motion))))
    return Evaluation(tuple(kept), tuple(predicted), scored, tuple(diverged), notes)
