"""Mean absolute coordinate errors against numbers found by hand, and the table that shows them."""

from __future__ import annotations

import io

import numpy as np
import pytest
import sheetbend as sb
from rich.console import Console
from sheetbend.recording.baseline import rms_about

NAN = np.nan


def rope(name: str = "swing", frames: int = 3, clamped: tuple[int, ...] = (0, 1, 4, 5)) -> sb.Recording:
    """Markers at 0, 1, ..., 5 m along x that do not move."""
    x = np.zeros((frames, 6, 3))
    x[:, :, 0] = np.arange(6)
    return sb.Recording(x, np.arange(frames) / 100, clamped=clamped, name=name)


def raised(recording: sb.Recording, frame: int, marker: int, by: tuple[float, float, float]) -> np.ndarray:
    predicted = recording.positions.copy()
    predicted[frame, marker] += by
    return predicted


def test_the_error_is_the_mean_over_coordinates_of_all_markers() -> None:
    """Two frames of six markers count: 36 coordinates, of which one marker's miss by 3, 4 and 5 m."""
    recording = rope()
    assert sb.coordinate_error(recording, recording.positions) == 0.0
    for marker in range(6):  # clamped ones too
        for frame in (1, 2):
            assert sb.coordinate_error(recording, raised(recording, frame, marker, (3, -4, 5))) == 12 / 36
    assert rms_about(recording, raised(recording, 1, 2, (3, -4, 5))) == np.sqrt(50 / 6)  # another measure


def test_frames_that_are_given_are_not_scored() -> None:
    recording = rope()
    first = raised(recording, 0, 2, (3, -4, 5))
    assert sb.coordinate_error(recording, first) == 0.0
    assert sb.coordinate_error(recording, first, given=0) == 12 / 54
    assert sb.coordinate_error(recording, raised(recording, 1, 2, (3, -4, 5)), given=2) == 0.0
    assert sb.coordinate_error(recording, raised(recording, 2, 2, (3, -4, 5)), given=2) == 12 / 18


def test_what_was_not_seen_is_left_out() -> None:
    x = rope().positions.copy()
    x[1, 2] = NAN
    x[2, [0, 5]] = NAN
    gapped = sb.Recording(x, rope().times, clamped=[0, 1, 4, 5])
    predicted = raised(rope(), 1, 3, (1, 1, 0))
    predicted[1, 2] = NAN  # nothing was seen there
    predicted[0] = NAN  # given
    assert sb.coordinate_error(gapped, predicted) == pytest.approx(2 / (3 * 9), abs=1e-15)  # 12 samples less 3


def test_predictions_that_do_not_fit_are_refused() -> None:
    recording = rope()
    hole = raised(recording, 2, 3, (NAN, 0, 0))
    for predicted, given, words in (
        (recording.positions[1:], 1, r"predicted: does not fit swing \(got \(2, 6, 3\)\).*\(3, 6, 3\)"),
        (recording.positions[:, 2:4], 1, "does not fit"),
        (hole, 1, r"is not finite in frame 2, marker 'm3' of swing"),
        (np.where(np.isnan(hole), np.inf, hole), 1, "is not finite in frame 2"),
        (recording.positions, 3, r"given: leaves nothing to score \(got 3\).*3 frames of swing"),
        (recording.positions, -1, "given: must be a whole number, at least 0"),
    ):
        with pytest.raises(sb.RecordingError, match=words):
            sb.coordinate_error(recording, predicted, given)


def moved() -> sb.Recording:
    """In frame 1 the driven pair at the left rises by 3 m, the free markers by 2 and 0 m; the blend says 2 and 1 m."""
    x = rope().positions.copy()
    x[1, :, 2] = [3, 3, 2, 0, 0, 0]
    return sb.Recording(x, rope().times, clamped=[0, 1, 4, 5], name="moved")


def test_each_recording_is_scored_beside_the_blend() -> None:
    pair = [rope(), moved()]
    found = sb.scores(pair, [raised(pair[0], 1, 0, (0, 0, 9)), raised(pair[1], 2, 3, (0, 0.18, 0))])
    assert [row.recording for row in found.rows] == ["swing", "moved"]
    assert found.rows[0].error == 0.25 and found.rows[0].blend == 0.0
    assert found.rows[1].error == pytest.approx(0.005, abs=1e-15)
    assert found.rows[1].blend == pytest.approx(1 / 36, abs=1e-15)
    assert found.error == pytest.approx(0.1275, abs=1e-15)
    assert found.blend == pytest.approx(1 / 72, abs=1e-15)
    shorter = sb.scores([moved()], [moved().positions], given=2)
    assert shorter.rows[0].blend == 0.0 and "from frame 3 on" in shorter.report()


def test_what_is_no_gripped_rope_has_no_blend() -> None:
    found = sb.scores([rope(clamped=(0,)), rope()], [rope().positions] * 2)
    assert [row.blend for row in found.rows] == [None, 0.0] and found.blend is None
    hanging = sb.scores([rope(clamped=(0,))], [rope().positions])
    assert "blend" not in hanging.report() and "swing" in hanging.report()


def test_as_many_predictions_as_recordings_are_asked() -> None:
    for recordings, predicted in (([], []), ([rope()], []), ([rope()], [rope().positions] * 2)):
        with pytest.raises(sb.InputError, match="predicted: must hold one prediction per recording"):
            sb.scores(recordings, predicted)


TABLE = """\
Prediction
----------
  recording  error  blend  error/blend  unit
  swing        250      0               mm
  moved          5   27.8         18 %  mm
  mean         128   13.9        918 %  mm

  error: mean absolute coordinate error of all markers seen, clamped ones included, from frame 2 on
  blend: no physics: every marker follows the two ends, weighted by arc length
"""


def test_the_table_reads_well_in_text_and_in_rich() -> None:
    pair = [rope(), moved()]
    found = sb.scores(pair, [raised(pair[0], 1, 0, (0, 0, 9)), raised(pair[1], 2, 3, (0, 0.18, 0))])
    assert found.report() == TABLE
    console = Console(file=io.StringIO(), width=100)
    console.print(found.rich_report())
    shown = console.file.getvalue().split()
    assert [word for word in shown if not set(word) <= {"─"}] == [
        word for word in TABLE.split() if not set(word) <= {"-"}
    ]
    single = sb.scores(pair[1:], [pair[1].positions])
    assert "mean " not in single.report().split("error:")[0]
