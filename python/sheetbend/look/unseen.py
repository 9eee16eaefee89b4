"""What moves a thing that no marker shows: a push, or a hand that bends or pulls it and lets go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays.timeseries import mean_position
from ..recording.recording import Recording
from .seen import Seen, motion_of
from .take import Take

PEAK = 0.3  # of the largest kinetic energy: how much the first peak has at least
LEAST_FREE = 0.2  # of a recording: how much is left at least where its beginning is cut off
SEEN = 0.1  # s after the peak, in which a frame is looked for that shows all markers
BEGUN, LEADS = 0.1, 0.3  # of the largest motion: where it has begun; of that of all: how far what moves them is there


class Freed(NamedTuple):
    """The part of a recording in which a thing moves freely, what is said of it, and what is not known."""

    take: Take
    said: str
    unknown: str


def freed(take: Take, markers: Sequence[int], thing: str) -> Freed | None:
    """The part of a recording in which a thing moves freely that rested before, though nothing that holds it moves;
    None where too little is left.

    Args:
        take: of which only the motion from then on is to be used.
        markers: on what moves.
        thing: what this is, such as "rope".
    """
    s, r = take.seen, take.seen.recording
    start = free_from(r, s.rest, markers)
    if start + LEAST_FREE * float(r.times[-1] - r.times[0]) > r.times[-1]:
        return None
    said = (
        f"it rests for the first {s.rest:.2g} s and then moves, before what holds it does: something that no marker "
        f"shows pushes it, or bends or pulls it and lets go. The fit begins at {start:.4g} s, where it moves fastest "
        "for the first time, with the places and speeds of the markers"
    )
    unknown = (
        f"whether anything still touches the {thing} after {start:.4g} s. If so, let `fit` in [[recording]] begin later"
    )
    return Freed(replace(take, seen=replace(s, recording=r.piece(start), rest=0.0)), said, unknown)


def free_from(recording: Recording, rest: float, markers: Sequence[int]) -> float:
    """s, from when on something that rested moves freely, whatever made it move: the first peak of its kinetic energy,
    or the frame soon after it that shows all markers.

    Args:
        recording: in m.
        rest: s, for how long it rests.
        markers: of what moves.
    """
    _, velocity = motion_of(recording)
    energy = _mean(np.sum(velocity[:, list(markers)] ** 2, axis=2))
    t = recording.times
    peak = (energy[1:-1] >= energy[:-2]) & (energy[1:-1] > energy[2:]) & (energy[1:-1] > PEAK * energy.max())
    at = 1 + np.flatnonzero(peak & (t[1:-1] >= t[0] + rest))
    start = float(t[at[0]] if len(at) else t[0] + rest)
    whole = t[(t >= start) & (t <= start + SEEN) & recording.mask[:, list(markers)].all(axis=1)]
    return float(whole[0]) if len(whole) else start


def moves_first(s: Seen, markers: Sequence[int], holding: Sequence[int]) -> bool:
    """Whether a thing that rested begins to move while what holds it hardly does, so that this does not move it.

    Args:
        markers: on the thing.
        holding: those that show where it is held; its own ones next to there follow it a little.
    """
    smooth, _ = motion_of(s.recording)
    t = s.recording.times
    off = np.sum((smooth - mean_position(smooth[t <= t[0] + s.rest])) ** 2, axis=2)
    whole = _mean(off[:, list(markers)])
    begun = whole >= BEGUN**2 * whole.max()
    return bool(_mean(off[begun][:1, list(holding)])[0] < LEADS**2 * whole[begun][0])


def _mean(square: np.ndarray) -> np.ndarray:
    """(frames,) of the markers that are seen in each; 0 where none is."""
    seen = np.isfinite(square)
    return np.asarray(np.where(seen, square, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1))
