"""Whether markers in order along a line are those of one rope that hangs in the air."""

from __future__ import annotations

from ..errors import RecordingError
from .line import forks
from .lying import lies
from .seen import Seen
from .text import joined

BRANCHED = 1.1  # times the shortest tree: how much longer the line through all markers of a branched cable is


def check_one_rope(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse what is no rope in the air.

    Raises:
        RecordingError: the markers are those of a cable that branches, or of a rope on a floor.
    """
    _unbranched(s, order)
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
