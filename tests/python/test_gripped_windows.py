"""What a fit of a gripped rope sees, and what judges it: windows, and recordings or their ends."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.split import split
from sheetbend.gripped.windows import SPANS, counted, everything, places

FRAMES = 501


def motion(name: str, first_shown: int = 0) -> GrippedMotion:
    """5 s of a straight rope that swings aside; its free markers are unseen from the middle until a frame."""
    times = np.arange(FRAMES) / 100.0
    x = np.linspace(0.0, 0.9, 10)[None, :, None] * [1.0, 0.0, 0.0] + 0.1 * np.sin(times)[:, None, None] * [0, 1.0, 0]
    if first_shown:
        x[round(0.75 * FRAMES) : first_shown, 2:-2] = np.nan
    return GrippedMotion.of(sb.Recording(x, times, clamped=(0, 1, 8, 9), name=name), 0.08)


def names(motions: list[GrippedMotion]) -> list[str]:
    return [m.recording.name for m in motions]


class TestSplit:
    def test_a_quarter_of_many_recordings_judges(self) -> None:
        motions = [motion(f"{k}") for k in range(8)]
        fitted, judging = split(motions, 0.25)
        assert names(judging) == ["0", "7"] and names(fitted) == ["1", "2", "3", "4", "5", "6"]

    @pytest.mark.parametrize("count", [1, 2])
    def test_the_last_quarter_of_few_recordings_judges(self, count: int) -> None:
        motions = [motion(f"{k}") for k in range(count)]
        fitted, judging = split(motions, 0.25)
        assert len(fitted) == len(judging) == count
        for whole, first, last in zip(motions, fitted, judging, strict=True):
            times = np.concatenate([first.recording.times, last.recording.times])
            np.testing.assert_array_equal(times, whole.recording.times)
            assert last.seconds == pytest.approx(1.25, abs=0.02) and last.length == whole.length
            np.testing.assert_array_equal(last.velocities, whole.velocities[-len(last.recording.times) :])

    def test_the_last_part_starts_where_the_rope_is_seen(self) -> None:
        (first,), (last,) = split([motion("hidden", first_shown=420)], 0.25)
        assert 4.15 < last.recording.times[0] < 4.3 and last.shown(0)
        assert first.recording.times[-1] == pytest.approx(last.recording.times[0] - 0.01)

    def test_what_is_too_short_to_cut_is_fitted_alone(self) -> None:
        whole = motion("short").frames(slice(0, 8))
        assert split([whole], 0.25) == ([whole], [])
        assert split([motion("a")], 0.0)[1] == []


class TestWindows:
    def test_those_of_the_last_fit_are_counted_not_the_recordings(self) -> None:
        motions = [motion(f"{k}") for k in range(56)]
        assert len(places(motions, SPANS[-1])) == 12
        assert counted(motions, SPANS[-1]) == "12 windows of 5 s from 12 of 56 recordings"

    def test_everything_is_every_window_of_every_recording(self) -> None:
        motions = [motion(f"{k}") for k in range(56)]
        assert counted(motions, everything(motions, 5.0)) == "56 windows of 5 s from all 56 recordings"
        assert counted(motions, everything(motions, 2.0)) == "112 windows of 2 s from all 56 recordings"
        short = [m.frames(slice(0, 250)) for m in motions]  # once 28 of them
        assert len(places(short, everything(short, 5.0))) == 56

    def test_one_recording(self) -> None:
        assert counted([motion("a")], SPANS[-1]) == "1 window of 5 s from 1 recording"
        assert counted([motion("a")], (1.5, 15.0)) == "3 windows of 1.5 s from 1 recording"
