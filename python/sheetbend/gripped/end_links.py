"""Whether the markers of a grip are exchanged, or the rope folds back at its grip.

Both bring the next marker nearer to the outer one of the grip. The length of the link behind the grip tells them apart:
from the inner marker of a grip that is in order it is what the other recordings of the rope show, and from the outer
marker of one that is exchanged. A recording by itself is compared with its own links between free markers, if these are
alike; markers beside a grip may sit at another distance, so that such a fold is named as a guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.timeseries import mean_position
from ..arrays.types import Array

LONG = 0.95  # quantile over frames of a distance: the length of a link, which is as long when the rope is straight
SHORTER = 0.98  # mean distance to the outer marker over that to the inner one, from which on an order is in question
CLEAR = 0.5  # difference of one order's link from the usual one over the other order's, below which it is decided
EVEN = 1.1  # longest over shortest link between free markers, up to which they tell the length of others


@dataclass(frozen=True)
class EndLink:
    """The link behind a grip, in both orders of the grip's markers.

    Attributes:
        given, exchanged: m, long distances of the next marker from the inner marker as given, and from the outer one.
        usual: m, the length of this link in other recordings, or of this recording's other links; NaN if neither tells.
        others: whether it is that of other recordings.
    """

    given: float
    exchanged: float
    usual: float
    others: bool

    @property
    def _off(self) -> tuple[float, float]:
        """How far the given and the exchanged order's link are from the usual one, in logarithms."""
        least = np.finfo(float).tiny
        given, exchanged = (abs(float(np.log(max(x, least) / self.usual))) for x in (self.given, self.exchanged))
        return given, exchanged

    @property
    def in_order(self) -> bool:
        """Whether the given order is nearer to the usual link, clearly so if only this recording tells: the rope folds
        back."""
        given, exchanged = self._off
        return given < (exchanged if self.others else CLEAR * exchanged)  # false where nothing is known of the link

    @property
    def clear(self) -> bool:
        """Whether one order is much nearer than the other, by what other recordings show."""
        return self.others and min(self._off) < CLEAR * max(self._off)

    @property
    def words(self) -> str:
        """The lengths that decide."""
        of = "in the other recordings" if self.others else "between its other markers"
        given, exchanged, usual = (f"{1e3 * x:.3g} mm" for x in (self.given, self.exchanged, self.usual))
        known = f", and {usual} {of}" if np.isfinite(self.usual) else ""
        return f"the next link is {given} long as given, {exchanged} exchanged{known}"


def end_link(positions: Array, outer: int, inner: tuple[int, int], usual: Array | None = None) -> EndLink | None:
    """The link behind a grip where it is in question which of its markers is the outer one; None where it is not.

    Args:
        positions: (frames, markers, 3) m; NaN where not seen.
        outer: number of the marker farther out; the other one of the pair and the next marker follow toward the rope.
        inner: numbers of the two inner gripped markers.
        usual: (markers - 1,) m, of other recordings (`usual_links`).
    """
    toward = 1 if outer < inner[1] - 1 else -1
    other, beyond = outer + toward, outer + 2 * toward
    given, exchanged = (np.linalg.norm(positions[:, beyond] - positions[:, k], axis=1) for k in (other, outer))
    if not mean_position(exchanged) < SHORTER * mean_position(given):
        return None
    link = min(other, beyond)
    known = float(usual[link]) if usual is not None else np.nan
    others = bool(np.isfinite(known))
    if not others:
        free = long_chords(positions[:, inner[0] + 1 : inner[1]])
        free = free[np.isfinite(free)]
        known = float(np.median(free)) if len(free) and free.max() <= EVEN * free.min() else np.nan
    return EndLink(_long(given), _long(exchanged), known, others)


def usual_links(positions: Sequence[Array], inner: Sequence[tuple[int, int]]) -> dict[int, Array]:
    """By number of markers (markers - 1,) m the lengths of the links between neighbors, medians over the recordings in
    which the order of none of them is in question; NaN where it always is.

    Args:
        positions: of each recording (frames, markers, 3) m.
        inner: of each recording, numbers of the two inner gripped markers.
    """
    found: dict[int, list[Array]] = {}
    for x, ends in zip(positions, inner, strict=True):
        links = long_chords(x)
        last = x.shape[1] - 1
        for outer in {0, ends[0] - 1, ends[1] + 1, last}:
            if end_link(x, outer, ends) is not None:
                links[outer + 1 if outer < ends[0] else outer - 2] = np.nan
        found.setdefault(last + 1, []).append(links)
    return {count: _medians(np.array(every)) for count, every in found.items()}


def long_chords(positions: Array) -> Array:
    """(markers - 1,) m, long distances of neighbors."""
    distance = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    return np.array([_long(d) for d in distance.T])


def _long(distance: Array) -> float:
    seen = distance[np.isfinite(distance)]
    return float(np.quantile(seen, LONG)) if len(seen) else np.nan


def _medians(every: Array) -> Array:
    """Of the columns of (recordings, links), of what is known."""
    return np.array([np.median(c[np.isfinite(c)]) if np.isfinite(c).any() else np.nan for c in every.T])
