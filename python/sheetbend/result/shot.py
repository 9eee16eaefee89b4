"""What a fit tells of a motion that it shot in windows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ShotMotion:
    """One motion that was cut into windows, whose states at the start were found along with the parameters.

    Attributes:
        name: of the experiment.
        windows: how many.
        length: s, of each.
        numbers: of a state, at each border between two windows.
        loss: m/s, what the model loses: the gap that is expected at a border over the length of a window. A gap is the
            root mean square over the free particles of distances and of differences of velocities times `pace`.
        lower, upper: of its 95 % interval; None where the loss was given.
        gap: m, root mean square of the gaps that were found.
        pace: s, the time in which the markers move as far as they sway.
    """

    name: str
    windows: int
    length: float
    numbers: int
    loss: float
    lower: float | None
    upper: float | None
    gap: float
    pace: float
