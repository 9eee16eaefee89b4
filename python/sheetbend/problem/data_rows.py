"""The data rows of a least-squares problem: what each is of, and when it was recorded.

Rows come experiment by experiment: of each first those of its markers, frame by frame, then those of its force sensors,
one after the other, sample by sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..recording.recording import Recording
from ..statistics.layout import Layout

Sensed = Sequence[Sequence[Mapping[str, Any]]]
"""By experiment and force sensor, what `Experiment.sensed` gives."""


def layout_of(experiments: Sequence[Experiment], recordings: Sequence[Recording], sensed: Sensed) -> Layout:
    """Where each row comes from, for the covariance. Markers are on clock 0, force sensors on clocks of their own; each
    axis of either is a kind of its own, but along a static shape all are one. Of a cloud, points in the same row count
    as one channel, which is as good as any: they are others in every frame."""
    rows: list[tuple[Array, ...]] = []  # recording, channel, frame, kind, clock
    for i, (e, r, sensors) in enumerate(zip(experiments, recordings, sensed, strict=True)):
        seen_frame, seen_marker = np.nonzero(r.mask)
        axes = np.tile(np.arange(e.rows_each), len(seen_frame))
        frames, markers = np.repeat(seen_frame, e.rows_each), np.repeat(seen_marker, e.rows_each)
        if e.static:  # along its shape the points are the series
            rows.append((np.full_like(axes, i), axes, markers, 0 * axes, 0 * axes))
        else:
            rows.append((np.full_like(axes, i), markers * len(e.axes) + axes, frames, axes, 0 * axes))
        for clock, sensor in enumerate(sensors, start=1):
            sample, reads = np.nonzero(~np.isnan(sensor["measured"]))
            rows.append((np.full_like(sample, i), reads, sample, 3 + reads, np.full_like(sample, clock)))
    return Layout(*(np.concatenate(part) for part in zip(*rows, strict=True)))


def times_of(experiments: Sequence[Experiment], recordings: Sequence[Recording], sensed: Sensed) -> Array:
    """(rows,) s, when each row was recorded; of an equilibrium NaN."""
    times = []
    for e, r, sensors in zip(experiments, recordings, sensed, strict=True):
        seen_frame, _ = np.nonzero(r.mask)
        when = np.full(len(seen_frame), np.nan) if e.static else r.times[seen_frame]
        times.append(np.repeat(when, e.rows_each))
        for force, sensor in zip(e.forces, sensors, strict=True):
            span = (float(r.times[0]), float(r.times[-1]))
            at = force.recording.times[force.kept(e.t0, span)]
            times.append(at[np.nonzero(~np.isnan(sensor["measured"]))[0]])
    return np.concatenate(times)
