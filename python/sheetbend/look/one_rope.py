"""Whether markers in order along a line are those of one rope that hangs in the air."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..errors import RecordingError
from .line import forks, split
from .lying import lies
from .seen import Seen
from .text import joined

BRANCHED = 1.1  # times the shortest tree: how much longer the line through all markers of a branched cable is
LOOSE = 0.02  # of their distance: by so much that of the ends of two ropes changes, a standard deviation


def check_one_rope(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse what is no rope in the air.

    Raises:
        RecordingError: the markers are those of a cable that branches, of two ropes, or of a rope on a floor.
    """
    _unbranched(s, order)
    _one(s, order)
    if lies(s, order):
        fix = (
            "take the configuration in docs/tutorials/dragged_rope.md, with a table and its friction, for your markers"
        )
        got = joined(s.recording.markers[k] for k in order)
        raise RecordingError("markers", "slide along at one height, as a rope on a floor or a table does", got, fix)


def _unbranched(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse markers of a branched cable: their shortest tree forks, and is much shorter than any line through them."""
    at, longer = forks(s.apart, order)
    if at and longer > BRANCHED:
        raise RecordingError(
            "markers",
            "lie along a cable that branches, so one rope cannot go through all of them",
            f"branches near {joined(s.recording.markers[k] for k in at)}",
            "give a recording of one branch, or write one [[scene.rod]] for each, see docs/configuration.md",
        )


def _one(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse markers of two ropes: their distance from each other is no distance along a rope, since it changes, or is
    longer than both."""
    two = split(s.apart, order)
    if two is None or s.static:
        return
    a, b = two[0][-1], two[1][0]
    x = s.recording.positions
    longer = max(sum(s.apart[j, k] for j, k in pairwise(part)) for part in two)
    if np.nanstd(np.linalg.norm(x[:, a] - x[:, b], axis=1)) > LOOSE * s.apart[a, b] or s.apart[a, b] > longer:
        first, second = (joined(s.recording.markers[k] for k in part) for part in two)
        fix = "name the markers of one rope with --markers, such as --markers " + repr(
            ",".join(s.recording.markers[k] for k in sorted(two[0]))
        )
        fix += (
            "; of one rope, record markers between them, or write the configuration by hand, see docs/configuration.md"
        )
        problem = "are those of two ropes, or of one with a long part that no marker shows"
        raise RecordingError("markers", problem, f"{first}; and {second}", fix)
