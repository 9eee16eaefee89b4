"""Errors of predicted rope motions in the measure that rope data sets are compared by, beside a baseline."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_kind, numbers
from ..errors import InputError, RecordingError
from ..optional import require
from ..quantities.wording import short
from ..recording.baseline import blend_baseline, is_gripped_rope
from ..recording.recording import Recording
from .tables import Section, plain_section, rich_section

if TYPE_CHECKING:
    from rich.console import Group


@dataclass(frozen=True, kw_only=True)
class Score:
    """How well one recording is predicted.

    Attributes:
        recording: its name.
        error: mean absolute coordinate error of the prediction, m.
        blend: that of the no-physics blend of the two ends, m; None where the rope is not clamped at both ends.
    """

    recording: str
    error: float
    blend: float | None


@dataclass(frozen=True)
class Scores:
    """Scores of several recordings; `print(scores.report())` shows the table.

    Attributes:
        rows: one per recording, in their order.
        given: number of frames at the beginning that were not scored.
    """

    rows: tuple[Score, ...]
    given: int

    @property
    def error(self) -> float:
        """Mean over the recordings, each counted once, m."""
        return float(np.mean([row.error for row in self.rows]))

    @property
    def blend(self) -> float | None:
        """Mean error of the blend over the recordings, m; None unless every recording has one."""
        blends = [row.blend for row in self.rows if row.blend is not None]
        return float(np.mean(blends)) if len(blends) == len(self.rows) else None

    def report(self) -> str:
        """The table as plain text, its notes wrapped at 100 columns."""
        return "\n".join(plain_section(self._section())) + "\n"

    def rich_report(self) -> Group:
        """The table for rich terminals.

        Raises:
            MissingExtraError: rich is not installed.
        """
        group: Group = require("rich.console", "cli").Group(*rich_section(self._section()))
        return group

    def _section(self) -> Section:
        rows = list(self.rows)
        if len(rows) > 1:
            rows.append(Score(recording="mean", error=self.error, blend=self.blend))
        headers: tuple[str, ...] = ("recording", "error", "blend", "error/blend", "unit")
        measure = "mean absolute coordinate error of all markers seen, clamped ones included"
        notes = [("error", f"{measure}, from frame {self.given + 1} on")]
        table = [_row(row) for row in rows]
        if all(row.blend is None for row in rows):
            headers, table = (headers[0], headers[1], headers[4]), [(row[0], row[1], row[4]) for row in table]
        else:
            notes.append(("blend", "no physics: every marker follows the two ends, weighted by arc length"))
        return Section("Prediction", headers, tuple(table), tuple(notes))


def coordinate_error(recording: Recording, predicted: ArrayLike, given: int = 1) -> float:
    """Compute the mean absolute coordinate error, m: the mean of |predicted - measured| over x, y, z and all samples.

    All markers count, clamped ones included, wherever they were seen in the frames after those given. This is the
    measure of the DEFORM rope data; a root mean square distance in space (`baseline.rms_about`) is larger.

    Args:
        recording: what was measured.
        predicted: (frames, markers, 3) m, for all frames and markers of the recording; where nothing was seen, and in
            the frames given, it may be anything.
        given: number of frames at the beginning that the prediction starts from, not scored.

    Raises:
        RecordingError: the shape is wrong, nothing is left to score, or the prediction is not finite where it counts.
    """
    check_kind("recording", recording, Recording, "read the file: sb.Recording.load(path)", RecordingError)
    predicted = numbers("predicted", predicted, RecordingError)
    if predicted.shape != recording.positions.shape:
        fix = f"give one position per frame and marker, {recording.positions.shape}"
        raise RecordingError("predicted", f"does not fit {recording.name}", predicted.shape, fix)
    check_count("given", given, 0, sys.maxsize, RecordingError)
    counts = recording.mask
    counts[:given] = False
    if not counts.any():
        fix = f"give fewer than the {len(recording.times)} frames of {recording.name}"
        raise RecordingError("given", "leaves nothing to score", given, fix)
    lost = counts & ~np.isfinite(predicted).all(axis=2)
    if lost.any():
        frame, marker = np.argwhere(lost)[0]
        fix = "predict every sample that was seen"
        place = f"is not finite in frame {frame}, marker {recording.markers[marker]!r} of {recording.name}"
        raise RecordingError("predicted", place, predicted[frame, marker].tolist(), fix)
    return float(np.abs(predicted - recording.positions)[counts].mean())


def scores(recordings: Sequence[Recording], predicted: Sequence[ArrayLike], given: int = 1) -> Scores:
    """Score predictions, each beside the no-physics blend of its recording's two ends.

    Args:
        recordings: what was measured, motions that were not fitted.
        predicted: one (frames, markers, 3) m per recording.
        given: as for `coordinate_error`.

    Raises:
        InputError: there is no recording, or not one prediction per recording.
        RecordingError: as for `coordinate_error`, or a clamped marker is lost (`Recording.filled`).
    """
    for field, listed in (("recordings", recordings), ("predicted", predicted)):
        if isinstance(listed, str) or not isinstance(listed, Sequence):
            raise InputError(field, "must be a list", listed, "give one for each motion")
    if not recordings or len(recordings) != len(predicted):
        fix = f"give at least one recording and as many predictions ({len(recordings)} recordings)"
        raise InputError("predicted", "must hold one prediction per recording", len(predicted), fix)
    rows = []
    for recording, prediction in zip(recordings, predicted, strict=True):
        blend = blend_baseline(recording) if is_gripped_rope(recording) else None
        rows.append(
            Score(
                recording=recording.name,
                error=coordinate_error(recording, prediction, given),
                blend=None if blend is None else coordinate_error(recording, blend, given),
            )
        )
    return Scores(tuple(rows), given)


def _row(score: Score) -> tuple[str, ...]:
    if score.blend is None:
        return (score.recording, short(1e3 * score.error), "", "", "mm")
    ratio = f"{100 * score.error / score.blend:.3g} %" if score.blend > 0 else ""
    return (score.recording, short(1e3 * score.error), short(1e3 * score.blend), ratio, "mm")
