"""Whether markers in order along a line are those of one rope."""

from __future__ import annotations

from ..errors import RecordingError
from .line import forks
from .seen import Seen
from .text import joined

BRANCHED = 1.1  # times the shortest tree: how much longer the line through all markers of a branched cable is


def check_one_rope(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse markers of a branched cable: their shortest tree forks, and is much shorter than any line through them.

    Raises:
        RecordingError: the markers are those of a cable that branches.
    """
    at, longer = forks(s.apart, order)
    if at and longer > BRANCHED:
        raise RecordingError(
            "markers",
            "lie along a cable that branches, so one rope cannot go through all of them",
            f"branches near {joined(s.recording.markers[k] for k in at)}",
            "give a recording of one branch, or write one [[scene.rod]] for each, see docs/configuration.md",
        )
