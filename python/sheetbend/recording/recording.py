"""A recording: measured marker positions over time, and nothing that was simulated."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import timeseries
from ..arrays.checks import MOST, is_bound, is_list, is_number, numbers
from ..arrays.timeseries import Kind
from ..arrays.types import Array
from ..errors import RecordingError
from ..files.names import checked_name
from . import io
from .marker_data import MarkerData, read_only
from .of_poses import markers_of_poses
from .recording_checks import checked_markers, checked_times, choose_from, marker_indices
from .relabeled import relabeled

_SAME_TIME = 1e-9  # s: decimal bounds such as 0.66 must find the frame stored as 0.6600000000000001


@dataclass(frozen=True, eq=False)
class Recording(MarkerData):
    """Measured markers over time. Immutable: every method returns a new recording, and the arrays are read-only.

    Examples:
        >>> recording = sb.Recording.load("experiments/twin/data/twin.npz")
        >>> recording.positions.shape, recording.markers[:2]  # (frames, markers, 3) m
        ((181, 9, 3), ('m0', 'm1'))
        >>> first = recording.piece(0.0, 1.0).select([0, 4, 8])  # the first second of three markers

    Attributes:
        positions: (frames, markers, 3) float64, m; NaN (all three) where a marker was not seen.
        times: (frames,) float64, s, strictly increasing; the intervals need not be equal.
        markers: one name per marker; "m0", "m1", ... when none are given. On a rope, in order along it.
        clamped: indices of the markers whose motion is given (the boundary); names are accepted too.
        name: what reports call it, and the files that are written of it (`names.checked_name`).
        gravity: (3,) m/s^2 in the frame of the positions, or None when the source does not say.
        metadata: what else the source tells (known values, license, attribution); JSON values. Frame
            numbers in it count from the first frame of the source, also after `piece`.

    Raises:
        RecordingError: a field has the wrong shape or type, infinite values, a marker seen in part or never,
            times that do not increase, names or indices that are repeated or out of range, or the name can be that
            of no file.
    """

    def __repr__(self) -> str:
        frames, markers = self.mask.shape
        return f"Recording({self.name!r}, {frames} frames, {markers} markers)"

    @classmethod
    def load(cls, path: str | Path, units: str | None = None) -> Recording:
        """Read a recording; the suffix picks the reader (`sheetbend.recording.io`).

        A JSON file of the same stem, when there is one, adds units, gravity, marker names, clamped markers
        and metadata (`sheetbend.recording.io.sidecar`).

        Args:
            path: an .npz, .npy, .csv, .tsv, .txt, .c3d, .trc or .pkl file, or a folder of OBJ or PLY files with one
                frame each; docs/recordings.md describes them.
            units: length unit of the file, "m", "cm", "mm", "in" or "ft"; None takes the JSON's, and m
                without one.

        Raises:
            RecordingError: the file is missing, empty, corrupt, of an unknown kind or no valid recording.
        """
        if not isinstance(path, str | PathLike):
            fix = "give the path of a file, such as 'take.csv'"
            raise RecordingError("path", "must be the name of a file or a folder", path, fix)
        recording = object.__new__(cls)
        recording._set(**vars(io.read(Path(path), units)))  # which is checked
        return recording

    @classmethod
    def from_poses(
        cls,
        times: ArrayLike,
        positions: ArrayLike,
        quaternions: ArrayLike,
        points: ArrayLike,
        markers: Sequence[str] = (),
        **fields: Any,
    ) -> Recording:
        """The poses of a rigid body as markers at points of it, which `sb.on_body(body, points)` places.

        Choose points that are not on one line, such as the corners of a box. Their distance from the origin of the
        body's frame weighs errors of the angles against errors of the place.

        Args:
            times: (frames,) s.
            positions: (frames, 3) m, of the origin of the body's frame; NaN where the body was not seen.
            quaternions: (frames, 4), (x, y, z, w), from the body's axes to the recording's.
            points: (k, 3) m, in the body's frame.
            markers: their names, p0, p1, ... by default.
            fields: further attributes, such as `name`.

        Raises:
            RecordingError: shapes, quaternions of no length, or as for any recording.
        """
        x = markers_of_poses(positions, quaternions, points)
        names = checked_markers(markers, x.shape[1], "p")
        return cls(x, checked_times(times, len(x)), markers=names, **fields)

    def save(self, path: str | Path) -> None:
        """Write the recording in meters; the suffix picks the writer. A JSON of the same stem holds the rest.

        Raises:
            RecordingError: the suffix is unknown, the folder is missing, or the metadata are no JSON.
        """
        io.write(self, Path(path))

    def piece(self, start: float | None = None, stop: float | None = None) -> Recording:
        """Frames with start <= time < stop (s; None = open), with their absolute times.

        Pieces that share a bound share no frame. A frame within a nanosecond of a bound counts as on it. A
        marker may be unseen throughout a piece.

        Raises:
            RecordingError: no frame lies in the interval.
        """
        for field, bound in (("start", start), ("stop", stop)):
            if bound is not None and (not is_bound(bound)):
                raise RecordingError(field, "must be a time", bound, "give s, or None")
        keep = np.ones(len(self.times), dtype=bool)
        if start is not None:
            keep &= self.times >= start - _SAME_TIME
        if stop is not None:
            keep &= self.times < stop - _SAME_TIME
        if not keep.any():
            span = f"{self.times[0]:.6g} to {self.times[-1]:.6g} s"
            raise RecordingError(
                "piece", "holds no frame", (start, stop), f"choose start < stop within the recording, {span}"
            )
        return self._derive(positions=self.positions[keep], times=self.times[keep])

    def frames(self, which: slice | NDArray[np.bool_]) -> Recording:
        """Frames by number, for example `frames(slice(0, None, 2))` for every second one, or those where an array with
        one Boolean per frame is True. A marker may be unseen in all of them.

        Raises:
            RecordingError: no frame is chosen, a slice runs backwards, or it is neither.
        """
        each = isinstance(which, np.ndarray) and which.dtype == np.bool_ and which.shape == self.times.shape
        if not each and not isinstance(which, slice):
            fix = f"write frames(slice(start, stop, step)), or give an array of {len(self.times)} Booleans"
            raise RecordingError("frames", "must be a slice or one Boolean per frame", which, fix)
        times = self.times[which]
        if len(times) == 0 or (len(times) > 1 and times[1] < times[0]):
            raise RecordingError(
                "frames",
                "must hold at least one frame, in order",
                which,
                f"use a slice with a positive step within the {len(self.times)} frames",
            )
        return self._derive(positions=self.positions[which], times=times)

    def hidden(self, spans: Sequence[Sequence[float]]) -> Self:
        """The same frames, with every marker that is not clamped unseen within the spans.

        A fit to it knows nothing of these spans, so that they can test its predictions.

        Args:
            spans: of (start, stop), s, with start <= time < stop as in `piece`.

        Raises:
            RecordingError: a span is no pair, holds no frame, or nothing is seen outside of them.
        """
        if not is_list(spans):
            raise RecordingError("spans", "must be a list", spans, "give [(start, stop)] in s")
        inside = np.zeros(len(self.times), dtype=bool)
        for i, span in enumerate(spans):
            ends = numbers(f"hidden[{i}]", span, RecordingError)
            if ends.shape != (2,) or not np.isfinite(ends).all():
                raise RecordingError(f"hidden[{i}]", "is not a span", span, "give (start, stop) in s")
            own = (self.times >= span[0] - _SAME_TIME) & (self.times < span[1] - _SAME_TIME)
            if not own.any():
                known = f"{self.times[0]:.6g} to {self.times[-1]:.6g} s"
                raise RecordingError(
                    f"hidden[{i}]", "holds no frame", tuple(span), f"give start < stop within the recording, {known}"
                )
            inside |= own
        free = np.isin(np.arange(len(self.markers)), self.free)
        if not self.mask[np.ix_(~inside, free)].any():
            raise RecordingError("hidden", "leaves nothing seen", list(map(tuple, spans)), "hide less")
        positions = self.positions.copy()
        positions[np.ix_(inside, free)] = np.nan
        return self._derive(positions=positions)

    def select(self, markers: Sequence[str | int]) -> Recording:
        """The given markers only (names or indices), in the given order; clamped ones stay clamped.

        Raises:
            RecordingError: a marker is unknown, named twice, or none is given.
        """
        chosen = marker_indices("select", markers, self.markers)
        if not chosen:
            fix = choose_from(self.markers)
            raise RecordingError("select", "must name at least one marker", markers, fix)
        driven = set(self.clamped)
        return self._derive(
            positions=self.positions[:, chosen],
            markers=tuple(self.markers[i] for i in chosen),
            clamped=tuple(new for new, old in enumerate(chosen) if old in driven),
        )

    def compared(self, markers: Sequence[str | int], name: str) -> Recording:
        """The given markers (names or indices), none of which counts as clamped, under another name. One that is never
        seen stays, with NaN throughout: a piece of a recording may lack a marker.

        Raises:
            RecordingError: a marker is unknown or named twice, or the name can be that of no file.
        """
        chosen = marker_indices("markers", markers, self.markers)
        names = tuple(self.markers[i] for i in chosen)
        return self._derive(
            positions=self.positions[:, chosen], markers=names, clamped=(), name=checked_name("name", name)
        )

    def mean(self) -> Recording:
        """One frame, at the time of the first, with the mean place of each marker: several frames at rest."""
        return self._derive(positions=timeseries.mean_position(self.positions)[None], times=self.times[:1])

    def resample(self, times: ArrayLike, kind: Kind = "linear", max_gap: float | None = None) -> Recording:
        """The recording at other times; NaN wherever a marker's two neighboring samples are too far apart.

        Args:
            times: (samples,) s, strictly increasing, within the recording.
            kind: "linear", or "cubic" (C1; `timeseries.interpolate`).
            max_gap: s, the longest time between two seen samples that is interpolated over; None takes 3.5
                median frame intervals.

        Raises:
            RecordingError: times do not increase or leave the recording, kind is unknown, max_gap negative.
        """
        at = checked_times(times, None)
        if at[0] < self.times[0] or at[-1] > self.times[-1]:
            raise RecordingError(
                "times",
                f"must lie within the recording, {self.times[0]:.6g} to {self.times[-1]:.6g} s",
                (float(at[0]), float(at[-1])),
                "resample inside it: recordings are not extrapolated",
            )
        if kind not in timeseries.KINDS:
            raise RecordingError("kind", "is unknown", kind, f"use one of {', '.join(timeseries.KINDS)}")
        gap = self._max_gap(max_gap)
        return self._derive(positions=timeseries.interpolate(self.times, self.positions, at, kind, gap), times=at)

    def shifted(self, t0: float) -> Recording:
        """The same recording on a clock whose zero is the old time t0 (s): times - t0."""
        if not is_number(t0):
            raise RecordingError("t0", "must be finite", t0, "give the time in s that becomes zero")
        return self._derive(times=checked_times(self.times - t0, len(self.times)))

    def filled(self, max_gap: float | None = None) -> Recording:
        """Clamped markers with their gaps closed by the C1 cubic; free markers keep theirs.

        A simulation needs the boundary at every time, so a gap that cannot be closed is an error.

        Args:
            max_gap: s, as for `resample`.

        Raises:
            RecordingError: a clamped marker is lost for longer, or in the first or last frame.
        """
        gap = self._max_gap(max_gap)
        driven = self.positions[:, self.clamped]
        closed = timeseries.interpolate(self.times, driven, self.times, "cubic", gap)
        for column, marker in enumerate(self.clamped):
            still_open = np.flatnonzero(np.isnan(closed[:, column, 0]))
            if len(still_open):
                self._refuse_open_gap(marker, int(still_open[0]), gap)
        positions = self.positions.copy()
        positions[:, self.clamped] = closed
        return self._derive(positions=positions)

    @property
    def mends(self) -> list[str]:
        """Sentences on what the reader and `mended` corrected or assumed, from metadata["mended"]."""
        said = self.metadata.get("mended", [])
        return [str(one) for one in said] if isinstance(said, list) else []

    def mended(self) -> Recording:
        """Repair confused markers: exchanged labels are put back, and a marker is taken as not seen in frames in which
        it is far from its path. `mends` lists what was changed. Returns the same object if nothing was wrong."""
        positions, said = relabeled(self.times, self.positions, self.markers)
        return (
            self._derive(positions=positions, metadata={**self.metadata, "mended": [*self.mends, *said]})
            if said
            else self
        )

    def noise(self) -> Array:
        """(markers,) m: noise of one coordinate, a robust high-frequency residual (`timeseries.noise`)."""
        return timeseries.noise(self.times, self.positions)

    def summary(self) -> str:
        """A few lines for a terminal: size, duration, gaps, boundary, noise, attribution."""
        frames, markers = self.mask.shape
        lines = [f"{self.name}: {frames} frame{'s' * (frames != 1)}, {markers} marker{'s' * (markers != 1)}"]
        if frames > 1:
            step = np.diff(self.times)
            even = np.ptp(step) < 1e-3 * np.median(step)
            spread = f"{step.min():.3g} to {step.max():.3g} s apart"
            pace = f"{1 / np.median(step):.4g} Hz" if even else spread
            lines.append(f"  time      {self.times[0]:.6g} to {self.times[-1]:.6g} s, {pace}")
        lines.append(f"  not seen  {np.mean(~self.mask):.2%} of the samples")
        lines.append(f"  clamped   {', '.join(self.markers[i] for i in self.clamped) or 'none'}")
        if self.gravity is not None:
            lines.append(f"  gravity   {', '.join(f'{g:.6g}' for g in self.gravity)} m/s^2")
        noise = self.noise()
        if not np.isnan(noise).all():
            lines.append(f"  noise     {1e3 * np.nanmin(noise):.3g} to {1e3 * np.nanmax(noise):.3g} mm")
        source = self.metadata.get("source")
        told = {**self.metadata, **source} if isinstance(source, dict) else self.metadata
        if "attribution" in told:
            lines.append(f"  source    {told['attribution']}")
        return "\n".join(lines)

    def _derive(self, **fields: Any) -> Self:
        """A part of this recording, not checked again: a piece may hold a marker that it never sees."""
        other = copy.copy(self)
        other._set(**{k: read_only(v) if isinstance(v, np.ndarray) else v for k, v in fields.items()})
        return other

    def _max_gap(self, max_gap: float | None) -> float:
        if max_gap is None:
            return timeseries.default_max_gap(self.times)
        if not isinstance(max_gap, int | float | np.number) or not max_gap >= 0:
            raise RecordingError("max_gap", "must be zero or positive", max_gap, "give the longest gap in s")
        return float(min(max_gap, MOST))

    def _refuse_open_gap(self, marker: int, frame: int, max_gap: float) -> None:
        seen = np.flatnonzero(self.mask[:, marker])
        label = f"clamped marker {self.markers[marker]!r}"
        if len(seen) == 0:
            raise RecordingError(label, "is never seen", 0, "leave it out, or leave it free")
        first, last = self.times[seen[0]], self.times[seen[-1]]
        if not first < self.times[frame] < last:
            raise RecordingError(
                label,
                "is lost at an end of the recording, where nothing can be interpolated",
                float(self.times[frame]),
                f"cut a piece within {first:.6g} to {last:.6g} s",
            )
        before, after = self.times[seen[seen < frame][-1]], self.times[seen[seen > frame][0]]
        raise RecordingError(
            label,
            f"is lost from {before:.6g} to {after:.6g} s, longer than max_gap = {max_gap:.4g} s",
            float(after - before),
            "cut a piece on one side of the gap, or give a larger max_gap if the motion there is smooth",
        )
