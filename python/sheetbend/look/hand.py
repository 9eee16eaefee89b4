"""A hand whose markers move as a rigid body: where it holds a rope."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..arrays.rigid import rigid_motion
from ..arrays.types import Array
from .line import tangent
from .seen import Seen

RIDES = 3.0  # times the noise: a marker that moves less in the hand's own axes rides on the hand
LEADS = np.geomspace(0.1, 6.0, 150)  # that are looked for, in distances between the first two markers
LAYERS = np.geomspace(1e-3, 1.0, 80)  # bent stretches that are looked for, in lengths of the rope
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

    The lead follows from how the first markers swing as seen from the hand.
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
    """m from where a hand holds a rope to its first marker; 0 where that rides on the hand, or tells of no lead.

    Seen from the hand, a rope under the tension T that leaves it at an angle is off by the angle times
    y - l (1 - exp(-y/l)) at y along it, where l = sqrt(EI/T): first it bends, then it hangs on a straight line that
    meets the hand's direction l below the hand. Lead and l follow from the motions of the first three markers.
    """
    x = s.recording.positions
    frames = np.isfinite(x[:, [*hand, *way[:3]], 0]).all(axis=1)
    if frames.sum() < 3:
        return 0.0
    turns, centers, _ = rigid_motion(x[frames][:, list(hand)])
    own = np.einsum("fba,fkb->fka", turns, x[frames][:, list(way[:3])] - centers[:, None])
    off = (own - own.mean(axis=0)).transpose(1, 0, 2).reshape(3, -1)
    if np.sqrt(np.mean(off[0] ** 2)) < RIDES * s.noise:
        return 0.0
    chords = np.array([s.apart[a, b] for a, b in pairwise(way)])
    along = chords[0] * LEADS[:, None, None] + np.concatenate([[0.0], np.cumsum(chords[:2])])
    layer = chords.sum() * LAYERS[:, None]
    shapes = along + layer * np.expm1(-along / layer)
    shapes /= np.linalg.norm(shapes, axis=2, keepdims=True)
    told = np.einsum("lti,ij,ltj->lt", shapes, off @ off.T, shapes).max(axis=1)
    best = int(told.argmax())
    return float(chords[0] * LEADS[best]) if 0 < best < len(LEADS) - 1 else 0.0
