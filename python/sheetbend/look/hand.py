"""A hand whose markers move as a rigid body: where it holds a rope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.rigid import rigid_motion
from .line import tangent
from .seen import Seen

Array = np.ndarray
RIDES = 3.0  # times the noise: a marker that moves less in the hand's own axes rides on the hand
LEAST, MOST = 0.1, 0.9  # of the next marker's motion, seen from the hand: beyond, the first one tells of no lead
BEYOND_HINGE = 1.3  # times the distance of the point it seems to turn about: a stiff rope is held above that
LEAD_SD = 0.3  # of a lead
TILT_SD, SHIFT_SD = 0.2, 0.1  # rad; of a lead


@dataclass(frozen=True)
class Entry:
    """Where a rope enters a hand.

    Attributes:
        place: (3,) m at the first frame; None where the first marker is not seen there.
        lead: m, from there to the first marker; 0 where that rides on the hand.
    """

    place: list[float] | None
    lead: float


def entry(s: Seen, hand: tuple[int, ...], way: tuple[int, ...]) -> Entry:
    """Where a hand holds a rope whose markers are given from the hand on.

    Seen from the hand, the first two markers swing about one point, near which the rope is held: the nearer one moves
    by a share b of what the other does, so that point is b/(1 - b) times their distance beyond the nearer one.
    """
    x = s.recording.positions
    resting = x[: max(1, int(np.searchsorted(s.recording.times, s.recording.times[0] + s.rest)))]
    first = _mean(resting[:, way[0]])
    lead = 0.0 if len(way) < 3 else _lead(s, hand, way)
    if lead and first is not None:
        first = first - lead * tangent(np.array([_mean(resting[:, k], np.nan) for k in range(x.shape[1])]), way)
    return Entry(None if first is None or np.isnan(first).any() else first.tolist(), lead)


def _mean(x: Array, otherwise: float | None = None) -> Array | None:
    seen = x[~np.isnan(x[:, 0])]
    if not len(seen):
        return None if otherwise is None else np.full(3, otherwise)
    return np.asarray(seen.mean(axis=0))


def _lead(s: Seen, hand: tuple[int, ...], way: tuple[int, ...]) -> float:
    x = s.recording.positions
    frames = np.isfinite(x[:, [*hand, *way[:2]], 0]).all(axis=1)
    if frames.sum() < 3:
        return 0.0
    turns, centers, _ = rigid_motion(x[frames][:, list(hand)])
    own = np.einsum("fba,fkb->fka", turns, x[frames][:, list(way[:2])] - centers[:, None])
    off = (own - own.mean(axis=0)).transpose(1, 0, 2).reshape(2, -1)
    if np.sqrt(np.mean(off[0] ** 2)) < RIDES * s.noise:
        return 0.0
    along = np.linalg.eigh(off @ off.T)[1][:, -1]  # by total least squares: both are noisy
    share = float(along[0] / along[1]) if along[1] else np.inf
    apart = float(s.apart[way[0], way[1]])
    return BEYOND_HINGE * apart * share / (1.0 - share) if LEAST < share < MOST else 0.0
