"""Recordings of one rope: where each one's markers are along it, and what holds the rope there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import RecordingError
from .held import Hands, Held, parts
from .seen import Seen
from .take import Take
from .text import joined, table

ANEW = 0.05  # of the distance of neighbors: where it differs by more, and
ALIKE = 8.0  # times the noise, markers were put on anew


@dataclass(frozen=True)
class Marked:
    """The markers of one recording on a rope.

    Attributes:
        take: the recording.
        held: what holds the rope in it, and its markers in order.
        arcs: (markers,) m of these along the rope, from its start.
        anew: whether they are others than the first recording's, or at other places.
    """

    take: Take
    held: Held
    arcs: Array
    anew: bool = False

    def placed(self, length: float) -> dict[str, float]:
        """Names and arc lengths of its markers, on a rope so long."""
        names = [self.take.seen.recording.markers[k] for k in self.held.order]
        return dict(zip(names, np.minimum(self.arcs, length), strict=True))

    def lines(self, length: float, estimated: bool) -> list[str]:
        """Tables below [[recording]], of what differs from the first one."""
        found = table("[recording.here.rope.markers]  # m", self.placed(length)) if self.anew else []
        for grip in self.held.grips if self.anew or self._placed_anew else []:
            found += table("[[recording.here.rope.grip]]", grip | ({"smoothing": 0.0} if estimated else {}))
        return found

    @property
    def _placed_anew(self) -> bool:
        """Whether a grip has a place in the axes of its own recording."""
        return any(grip.get("position") is not None for grip in self.held.grips)


def marked_by(
    takes: Sequence[Take], found: Held, holding: Callable[[Seen, Hands, tuple[int, ...]], Held]
) -> list[Marked]:
    """The markers of each recording; those of the first one are held as found.

    Args:
        holding: from a recording, the markers of its hands and those on the rope in order to what holds it.

    Raises:
        RecordingError: one shows no rope, or one that is held otherwise than the first one's.
    """
    first = takes[0]
    alike = [_alike(first, take, found.order) for take in takes]
    shared = _arcs([take for take, same in zip(takes, alike, strict=True) if same], found)
    marked = [Marked(first, found, shared)]
    for take, same in zip(takes[1:], alike[1:], strict=True):
        if same and not marked[0]._placed_anew:
            marked.append(Marked(take, found, shared))
            continue
        own = _held_alike(first, take, found, holding)
        marked.append(Marked(take, own, shared if same else _arcs([take], own), not same))
    return marked


def said_of(marked: Sequence[Marked]) -> tuple[list[str], list[str]]:
    """Sentences about recordings whose markers are their own: what is seen, and what is not known."""
    anew = [own for own in marked if own.anew]
    seen = [
        f"{own.take.file} has markers of its own on the same rope: {joined(own.placed(np.inf))}; {own.arcs[-1]:.4g} m "
        "of it are free"
        for own in anew
    ]
    files = joined(own.take.file for own in anew)
    unknown = [
        "whether the rope is held at the same place in all recordings, as it is taken to be: the arc lengths in "
        f"{files} count from there too. If it was not, add the difference to `markers` of [recording.here.rope]"
    ]
    return seen, unknown if anew else []


def _alike(first: Take, take: Take, order: tuple[int, ...]) -> bool:
    """Whether two recordings have the same markers, at the same distances where the rope moves: at rest, bends make
    them shorter."""
    a, b = first.seen, take.seen
    if a.recording.markers != b.recording.markers:
        return False
    chords = np.array([[s.apart[i, j] for i, j in pairwise(order)] for s in (a, b)])
    most = np.maximum(ANEW * chords[0], ALIKE * max(a.noise, b.noise))
    return a.static or bool(np.all(np.abs(chords[1] - chords[0]) < most))


def _held_alike(first: Take, take: Take, found: Held, holding: Callable[[Seen, Hands, tuple[int, ...]], Held]) -> Held:
    """What holds the rope in a further recording, its markers from the same end as in the first one."""
    hands, order = parts(take.seen)
    if take.seen.static == first.seen.static and len(order) >= 3:
        for way in (order, order[::-1]):
            own = holding(take.seen, hands, way)
            if _way(own) == _way(found):
                leads = [grip | ({"lead": found.leads[grip["at"]]} if "lead" in grip else {}) for grip in own.grips]
                return replace(own, leads=found.leads, grips=leads)
    fix = "make one configuration for each"
    raise RecordingError("markers", f"of {take.file} show no rope that is held as in {first.file}", take.file, fix)


def _way(held: Held) -> tuple[Any, ...]:
    """What decides about the model of a held rope."""
    grips = [(grip["at"], min(len(grip["markers"]), 3), "direction" in grip) for grip in held.grips]
    return sorted(grips), sorted(held.rope), held.rope.get("pinned"), sorted(held.leads)


def _arcs(takes: Sequence[Take], found: Held) -> Array:
    """(markers,) m along the rope. No chord is longer than its arc, so the longest ones count."""
    pairs = list(pairwise(found.order))
    chords = np.max([[take.seen.apart[a, b] for a, b in pairs] for take in takes], axis=0)
    noise = max(take.seen.noise for take in takes)
    if not takes[0].seen.static:
        even = float(np.median(chords))
        if len(chords) >= 4 and np.all(np.abs(chords - even) < 2.0 * noise):
            chords = np.full(len(chords), even)  # all alike within their noise: the median is closer
    return found.leads.get("start", 0.0) + np.concatenate([[0.0], np.cumsum(chords)])
