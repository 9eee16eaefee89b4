"""Frames in which a marker is elsewhere, told by the jumps there and back."""

from __future__ import annotations

import numpy as np
import pytest
from sheetbend.recording.leaps import elsewhere, least_leap


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(
    ("sides", "away"),
    [((1, 1), 0.3), ((1, 1), 0.08), ((1, -1), 0.3), ((1, 1, 1), 0.3)],
    ids=["one side", "one side, near", "both sides", "three times"],
)
def test_what_is_between_two_excursions_is_kept(sides: tuple[int, ...], away: float, backward: bool) -> None:
    """The jump back from the first and that to the second one cancel, as those of an excursion do: the 12 frames
    between two to one side were left out with them."""
    t = np.arange(200) / 100
    track = np.stack([0.2 * np.sin(3.0 * t), 0.1 * np.cos(2.0 * t), 0.0 * t], axis=1)
    track += np.random.default_rng(2).normal(0.0, 2e-4, track.shape)
    gone = np.zeros(len(t), bool)
    for k, side in enumerate(sides):
        there = slice(20 + 18 * k, 26 + 18 * k)
        gone[there] = True
        track[there, 2] += side * away
    if backward:
        track, gone = track[::-1], gone[::-1]
    np.testing.assert_array_equal(elsewhere(t, track, least_leap(t, 0.5)), gone)
