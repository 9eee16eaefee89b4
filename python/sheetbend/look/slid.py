"""A rope that slides out of a hand: the way from the hand to the first marker on the rope gets longer for good.

Bends make the distance between them shorter than that way, but never longer. So the largest distance in each part of
the time hardly changes unless the rope slides, or a marker does. What an arc takes off the distance is added to it: its
curvature follows from the angle to the next two markers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays.rigid import rigid_motion
from ..arrays.types import Array
from .end_load import free_end
from .held import Held
from .seen import Seen
from .text import joined

PARTS, FRAMES = 10, 5  # of the time, and frames in each at least
SHARE = 0.9  # of the distances in a part are smaller than what counts as its largest
SWING = 1.0  # s of a motion that does not begin at rest, that show how long the way is
LEAST, NOISES, PART = 4e-3, 8.0, 0.05  # m, times the noise, and of the distance: how far a rope slides at least


class Slip(NamedTuple):
    """By how much a rope slid out of what holds it, m, when, s, and markers in the hand."""

    by: float
    time: float
    hand: str


def slid(s: Seen, found: Held) -> Slip | None:
    """The first slip of a rope that hangs from a hand with three markers or more; None where none is seen. Between two
    hands, or behind one marker, a slack rope that gets taut looks alike."""
    if free_end(found) is None:
        return None
    hands = [grip for grip in found.grips if len(grip["markers"]) >= 3]
    each = [_through(s, found, grip["at"], grip["markers"]) for grip in hands]
    return min((slip for slip in each if slip is not None), key=lambda slip: slip.time, default=None)


def _through(s: Seen, found: Held, at: str, hand: Sequence[str]) -> Slip | None:
    r, way = s.recording, found.order if at == "start" else found.order[::-1]
    own = [r.markers.index(name) for name in hand]
    t, far = _distances(s, own, way, found.leads.get(at, 0.0))
    parts = [part for part in np.array_split(np.arange(len(t)), PARTS) if len(part) >= FRAMES]
    if len(parts) < PARTS:
        return None
    largest = np.array([np.quantile(far[part], SHARE) for part in parts])
    least = max(LEAST, NOISES * s.noise, PART * float(largest[0]))
    before = np.maximum.accumulate(largest)[:-1]
    after = np.array([np.median(largest[k:]) for k in range(1, PARTS)])
    before[[not s.rest and t[part[-1]] - t[0] < SWING for part in parts[:-1]]] = np.inf
    k = int(np.argmax(after - before))
    if not after[k] - before[k] >= 0.5 * least or largest[k + 1 :].max() - before[k] < least:
        return None
    when = int(np.argmax(far > before[k] + 0.5 * least))
    return Slip(float(after[k] - before[k]), float(t[when]), joined(hand))


def _distances(s: Seen, own: list[int], way: tuple[int, ...], lead: float) -> tuple[Array, Array]:
    """s and m: the times at which all is seen, and the way from what holds the rope to its first marker there."""
    first, second = way[:2]
    x = s.recording.positions
    seen = np.isfinite(x[:, [*own, first, second], 0]).all(axis=1)
    t, x = s.recording.times[seen], x[seen]
    if not len(t):
        return t, np.zeros(0)
    turns, centers, _ = rigid_motion(x[:, own])
    places = [np.einsum("fba,fb->fa", turns, x[:, k] - centers) for k in (first, second)]
    along = np.mean(places[1] - places[0], axis=0)
    lead = lead or float(s.apart[first, second])  # longer than it is, the distance would only get shorter
    entry = places[0].mean(axis=0) - lead * along / np.linalg.norm(along)
    chord = np.einsum("fab,fb->fa", turns, places[0] - entry)
    following = x[:, second] - x[:, first]
    d, c = np.linalg.norm(chord, axis=1), np.linalg.norm(following, axis=1)
    angle = np.arccos(np.clip(np.sum(chord * following, axis=1) / (d * c), -1.0, 1.0))
    return t, d * (1.0 + (2.0 * d / (d + c) * angle) ** 2 / 24.0)
