"""What a simulation needs from a recording of a gripped rope: smooth grips, and a shape and speed to start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import timeseries
from ..arrays.smoothing import LocalFit, smoothed, steadiest
from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from ..objects.grip import Grip
from ..optional import require
from ..recording.recording import Recording
from .order import check_order

POLYLINE = 200  # points of the initial curve, which links are laid along
BRIDGED = 0.1  # s, of a gap: there the C1 cubic stands in for what was not seen, of grips and of starts


@dataclass(frozen=True, eq=False)
class GrippedMotion:
    """A recording of a rope whose first and last two markers are gripped, smoothed.

    Attributes:
        recording: as given, short gaps of gripped markers closed.
        inner: numbers of the two inner gripped markers, between which the rope is free.
        positions, velocities: (frames, markers, 3) m and m/s, of a local parabola in time; NaN about long gaps of free
            markers.
        fractions: (markers,) arc length from the first inner marker over the free length, mean chords; outside 0 to 1
            in the grips.
        length: m, mean arc length of a smooth curve through the free markers.
        steadied: by what the gripped markers were smoothed; None = not at all.
    """

    recording: Recording
    inner: tuple[int, int]
    positions: Array
    velocities: Array
    fractions: Array
    length: float
    steadied: LocalFit | None = None

    @classmethod
    def of(cls, recording: Recording, smoothing: float, usual: Array | None = None) -> GrippedMotion:
        """Smooth over `smoothing` s (0 = not at all); gripped markers over more, where that leaves nothing but noise
        behind (`steadiest`): what shakes a grip shakes the rope.

        Args:
            usual: (markers - 1,) m, lengths of the links in other recordings of the rope (`usual_links`).

        Raises:
            RecordingError: the rope is not gripped by two markers at each end, its markers are not in order, or too
                much was not seen.
        """
        if len(recording.times) < 3:
            problem = f"of {recording.name} are fewer than three frames"
            raise RecordingError("times", problem, len(recording.times), "leave the recording out, or record a motion")
        inner = gripped_ends(recording)
        check_order(recording, inner, usual)
        recording, positions = _bridged(recording)
        x, v = smoothed(recording.times, positions, smoothing)
        part = slice(inner[0], inner[1] + 1)
        chords = chords_of(x)
        _check_shown(recording, x, chords, inner)
        fractions = fractions_of(chords, inner)
        seen = np.isfinite(x[:, part, 0]).sum(axis=1)
        best = np.flatnonzero(seen == seen.max())
        some = best[np.linspace(0, len(best) - 1, min(len(best), 20)).astype(int)]
        curves = [_curve(x[f, part], fractions[part]) for f in some]
        length = float(np.mean([np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in curves]))
        gripped = np.r_[: inner[0] + 1, inner[1] : len(recording.markers)]
        steadied = steadiest(recording.times, positions[:, gripped], smoothing)
        if steadied is not None and steadied.width > smoothing:
            x = x.copy()
            x[:, gripped], _ = steadied.of(recording.times, positions[:, gripped])
        return cls(recording, inner, x, v, fractions, length, steadied)

    @property
    def free(self) -> range:
        """Numbers of the markers between the grips."""
        return range(self.inner[0] + 1, self.inner[1])

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return float(self.recording.times[-1] - self.recording.times[0])

    def frames(self, which: slice) -> GrippedMotion:
        """A piece, smoothed as the whole was; places of markers and the length stay those of the whole."""
        part = self.recording.frames(which)
        return replace(self, recording=part, positions=self.positions[which], velocities=self.velocities[which])

    def moved(self, by: Array) -> GrippedMotion:
        """The same with its free markers moved by (frames, free markers, 3) m."""
        free, x, v = list(self.free), self.positions.copy(), self.velocities.copy()
        recorded = self.recording.positions.copy()
        x[:, free] += by
        v[:, free] += np.gradient(by, self.recording.times, axis=0)
        recorded[:, free] += by
        return replace(self, recording=replace(self.recording, positions=recorded), positions=x, velocities=v)

    def later(self, by: float) -> GrippedMotion:
        """The same where the smoothed gripped markers are those of `by` s later: they were recorded late. Beyond the
        recording they go on as they moved last."""
        if by == 0.0:
            return self
        gripped = np.r_[: self.inner[0] + 1, self.inner[1] : len(self.recording.markers)]
        times = self.recording.times
        at = np.clip(times + by, times[0], times[-1])
        x, v = self.positions.copy(), self.velocities.copy()
        for kept, given in ((x, self.positions), (v, self.velocities)):
            kept[:, gripped] = timeseries.interpolate(times, given[:, gripped], at, "cubic", np.inf)
        x[:, gripped] += v[:, gripped] * (times + by - at)[:, None, None]
        return replace(self, positions=x, velocities=v)

    def directions(self, end: bool) -> Array:
        """(frames, 3) unit directions of a gripped piece, in the rope's direction of travel."""
        k = self.inner[1] if end else self.inner[0] - 1
        d = self.positions[:, k + 1] - self.positions[:, k]
        return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))

    def grip(self, end: bool, frames: slice, nominal: Array) -> Grip:
        """The grip over some frames; its times count from the first of them."""
        t = self.recording.times[frames]
        k = self.inner[1] if end else self.inner[0] - 1
        first, second = self.positions[frames, k], self.positions[frames, k + 1]
        return Grip.from_markers(t - t[0], first, second, end=end, nominal=nominal)

    @property
    def sag(self) -> Array:
        """(3,) m, by which the free markers are off the line between the grips, on average."""
        first, last = (self.positions[:, [k]] for k in self.inner)
        free = list(self.free)
        share = self.fractions[free, None]
        return np.nanmean(self.positions[:, free] - (1.0 - share) * first - share * last, axis=(0, 1))

    def shown(self, frame: int) -> bool:
        """Whether at least half of the free markers are seen about a frame: a motion can start there."""
        return _mostly_seen(self.positions[frame], self.inner)

    def start(self, frame: int) -> tuple[Array, Array]:
        """Points (k, 3) m along a smooth curve through the markers between the grips, and velocities (k, 3) m/s;
        markers that are not seen are left out."""
        part = slice(self.inner[0], self.inner[1] + 1)
        s = self.fractions[part]
        return _curve(self.positions[frame, part], s), _curve(self.velocities[frame, part], s)


def motions_of(recordings: Sequence[Recording | GrippedMotion], smoothing: float) -> list[GrippedMotion]:
    """Motions of recordings, smoothed over so many s; those that are motions already stay as they are."""
    return [r if isinstance(r, GrippedMotion) else GrippedMotion.of(r, smoothing) for r in recordings]


def chords_of(positions: Array) -> Array:
    """(markers - 1,) m, mean distances of neighbors in (frames, markers, 3)."""
    return mean_position(np.linalg.norm(np.diff(positions, axis=1), axis=2))


def fractions_of(chords: Array, inner: tuple[int, int]) -> Array:
    """(markers,) `GrippedMotion.fractions`."""
    s = np.concatenate([[0.0], np.cumsum(chords)])
    return np.asarray((s - s[inner[0]]) / (s[inner[1]] - s[inner[0]]))


def _bridged(recording: Recording) -> tuple[Recording, Array]:
    """The recording with closed gaps of gripped markers, and (frames, markers, 3) m with those of free ones closed too.

    Raises:
        RecordingError: a gap of a gripped marker, or of all, is too long.
    """
    times = recording.times
    gap = max(timeseries.default_max_gap(times), BRIDGED)
    jump = np.flatnonzero(np.diff(times) > gap * (1 + 1e-9))
    if len(jump):
        before, after = times[jump[0]], times[jump[0] + 1]
        problem = f"of {recording.name} jump by {after - before:.3g} s: nothing was recorded there"
        fix = "save each side as a recording of its own (`Recording.piece`)"
        raise RecordingError("times", problem, (float(before), float(after)), fix)
    filled = recording.filled(gap)
    return filled, timeseries.interpolate(times, filled.positions, times, "cubic", gap)


def _check_shown(recording: Recording, positions: Array, chords: Array, inner: tuple[int, int]) -> None:
    """Raises RecordingError where a free marker is hardly ever seen beside its neighbor or is the same as that, or too
    few are seen at the start."""
    lost = np.flatnonzero(np.isnan(chords))
    if len(lost):
        names = [recording.markers[k] for k in (lost[0], lost[0] + 1)]
        problem = f"of {recording.name} are never seen together for long enough"
        raise RecordingError("markers", problem, names, "leave one out with `Recording.select`")
    same = np.flatnonzero(chords == 0.0)
    if len(same):
        names = [recording.markers[k] for k in (same[0], same[0] + 1)]
        problem = f"of {recording.name} are at the same place throughout"
        raise RecordingError("markers", problem, names, "leave one out with `Recording.select`")
    if not _mostly_seen(positions[0], inner):
        later = [f"{t:g} s" for t, x in zip(recording.times, positions, strict=True) if _mostly_seen(x, inner)]
        fix = f"save the recording from {later[0] if later else 'a later frame'} on (`Recording.piece`)"
        problem = f"of {recording.name} are less than half seen in the first frames"
        raise RecordingError("markers", problem, float(recording.times[0]), fix)


def _mostly_seen(positions: Array, inner: tuple[int, int]) -> bool:
    return 2 * int(np.isfinite(positions[inner[0] + 1 : inner[1], 0]).sum()) >= inner[1] - inner[0] - 1


def _curve(points: Array, s: Array) -> Array:
    """Through those points (k, 3) that are seen."""
    seen = np.isfinite(points[:, 0])
    spline = require("scipy.interpolate", "fit").CubicSpline(s[seen], points[seen])
    return np.asarray(spline(np.linspace(s[0], s[-1], POLYLINE)))


def gripped_ends(recording: Recording) -> tuple[int, int]:
    """Numbers of the two inner gripped markers.

    Raises:
        RecordingError: the first two and the last two markers or more are not the gripped ones.
    """
    count, held = len(recording.markers), set(recording.clamped)
    first = next((k for k in range(count) if k not in held), count)
    last = next((k for k in reversed(range(count)) if k not in held), -1)
    gripped = held == set(range(first)) | set(range(last + 1, count))
    if not gripped or first < 2 or last > count - 3 or last < first:
        fix = "name the gripped markers in `clamped`, the first two or more and the last two or more along the rope"
        raise RecordingError("clamped", f"of {recording.name} are not two grips", sorted(held), fix)
    return first - 1, last + 1
