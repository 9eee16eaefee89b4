"""What a scene takes from its recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.timeseries import mean_position
from ..recording.recording import Recording


@dataclass(frozen=True)
class Moment:
    """The frames of a recording from the scene's start on, the shape there, and the whole recording; `max_gap`, s, is
    the longest time for which a marker that drives something may be lost."""

    recording: Recording
    whole: Recording
    t0: float
    static: bool
    max_gap: float | None = None

    @property
    def shape(self) -> np.ndarray:
        """(markers, 3) m at the start: the first frame of a motion, the mean of an equilibrium; NaN where not seen."""
        x = self.recording.positions
        return mean_position(x) if self.static else x[0]

    def followed(self, markers: Sequence[str | int]) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
        """The motion of some markers, gaps closed: times (frames,) s from the scene's start, positions (frames,
        markers, 3) m, names; of an equilibrium one frame.

        Raises:
            RecordingError: unknown markers, or a gap too long to be closed.
        """
        chosen = self.recording.select(markers)
        if self.static:
            return np.zeros(1), replace(self, recording=chosen).shape[None], chosen.markers
        chosen = replace(chosen, clamped=tuple(range(len(markers)))).filled(self.max_gap)
        return chosen.times - self.t0, chosen.positions, chosen.markers
