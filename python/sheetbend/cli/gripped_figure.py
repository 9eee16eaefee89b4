"""The figure of a fitted rope: free markers of the recording that it predicts worst."""

from __future__ import annotations

from pathlib import Path

from ..gripped.evaluation import Evaluation
from ..gripped.report import RopeReport
from ..pictures import plotting
from ..quantities.wording import short
from ..recording.baseline import blend_baseline


def write_figure(report: RopeReport, drawn: Evaluation, form: str, folder: Path) -> list[str]:
    """Measured against predicted over time, and the no-physics blend; gives the file's name."""
    if form == "none" or drawn.scores is None:
        return []
    rows = drawn.scores.rows
    worst = max(range(len(rows)), key=lambda i: rows[i].error)
    recording, row = drawn.recordings[worst], rows[worst]
    free = list(recording.free)
    blend = "" if row.blend is None else f", without physics {short(1e3 * row.blend)} mm"
    unseen = "unseen" if drawn is report.unseen else "fitted"
    title = f"{report.name}, {unseen} recording {row.recording}, the worst: {short(1e3 * row.error)} mm{blend}"
    figure = plotting.plot_trajectories(
        recording.positions[:, free],
        drawn.predicted[worst][:, free],
        recording.times,
        markers=[recording.markers[k] for k in free],
        baseline=None if row.blend is None else blend_baseline(recording)[:, free],
        title=title,
    )
    plotting.save(figure, folder / f"predicted.{form}")
    return [f"predicted.{form}"]
