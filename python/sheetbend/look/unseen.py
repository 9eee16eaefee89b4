"""What moves a thing that no marker shows: a push, or a finger that bends it and lets go."""

from __future__ import annotations

import numpy as np

from ..recording.recording import Recording
from .seen import motion_of

PEAK = 0.3  # of the largest kinetic energy: how much the first peak has at least


def free_from(recording: Recording, rest: float, markers: tuple[int, ...]) -> float:
    """s, from when on something that rested moves freely, whatever made it move: the first peak of its kinetic energy.

    Args:
        recording: in m.
        rest: s, for how long it rests.
        markers: of what moves.
    """
    _, velocity = motion_of(recording)
    square = np.sum(velocity[:, list(markers)] ** 2, axis=2)
    seen = np.isfinite(square)
    energy = np.where(seen, square, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    t = recording.times
    peak = (energy[1:-1] >= energy[:-2]) & (energy[1:-1] > energy[2:]) & (energy[1:-1] > PEAK * energy.max())
    at = 1 + np.flatnonzero(peak & (t[1:-1] >= t[0] + rest))
    return float(t[at[0]] if len(at) else t[0] + rest)
