"""Reads what recordings of a rope show, after errors in them are corrected. A fit begins with the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..recording.recording import Recording
from .model import GRAVITY, shared_gravity
from .motion import GrippedMotion
from .plausible import doubts, gravities
from .screening import screened
from .slips import held, slips, slips_said


@dataclass(frozen=True)
class Read:
    """What recordings show, after errors in them are corrected.

    Attributes:
        motions: of the grips and markers, in m and s.
        notes: what was corrected, left out or found.
        gravities: m/s^2, that the rope may have, the usual one first.
    """

    motions: Sequence[GrippedMotion]
    notes: tuple[str, ...]
    gravities: Sequence[tuple[float, float, float]]

    @property
    def said(self) -> list[str]:
        """The notes, and what is doubtful about the motions."""
        return [*self.notes, *(f"doubtful: {doubt}" for doubt in doubts(self.motions, self.gravities[-1]))]


def read(
    recordings: Sequence[Recording | GrippedMotion], smoothing: float, gravity: tuple[float, float, float] | None
) -> Read:
    """Read the motions of recordings, with ropes that slip through their grips held where they were.

    Args:
        recordings: of one rope, as `screened` takes them.
        smoothing: s, over which positions are smoothed.
        gravity: (3,) m/s^2; None takes what the recordings tell, else what the sag of the rope allows.

    Raises:
        RecordingError: more than half of the recordings cannot be used.
        InputError: something else than recordings, or they tell different gravities.
    """
    usable = screened(recordings, smoothing)
    slipped = [slips(m) for m in usable]
    motions = [held(m, found) for m, found in zip(usable, slipped, strict=True)]
    told_slips = [words for m, found in zip(usable, slipped, strict=True) for words in slips_said(m, found)]
    told = shared_gravity([m.recording for m in motions])
    meant = (gravity,) if gravity is not None else (GRAVITY,) if told is not None else gravities(motions)
    return Read(motions, (*usable.notes, *told_slips), meant)
