"""What a simulation needs from a recording of a gripped rope: smooth grips, and a shape and speed to start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import timeseries
from ..errors import RecordingError
from ..grip import Grip
from ..optional import require
from ..recording import Recording

Array = np.ndarray
POLYLINE = 200  # points of the initial curve, which links are laid along
BRIDGED = 0.1  # s, of a free marker's gap: there the C1 cubic stands in for what was not seen, in starts alone


@dataclass(frozen=True, eq=False)
class GrippedMotion:
    """A recording of a rope whose first and last two markers are gripped, smoothed.

    Attributes:
        recording: as given.
        inner: numbers of the two inner gripped markers, between which the rope is free.
        positions, velocities: (frames, markers, 3) m and m/s, of a local parabola in time.
        fractions: (markers,) arc length from the first inner marker over the free length, mean chords; outside 0 to 1
            in the grips.
        length: m, mean arc length of a smooth curve through the free markers.
    """

    recording: Recording
    inner: tuple[int, int]
    positions: Array
    velocities: Array
    fractions: Array
    length: float

    @classmethod
    def of(cls, recording: Recording, smoothing: float) -> GrippedMotion:
        """Smooth over `smoothing` s (0 = not at all).

        Raises:
            RecordingError: the rope is not gripped by two markers at each end, or a gap is too long to fill.
        """
        inner = _inner(recording)
        x, v = smoothed(recording.times, _bridged(recording), smoothing)
        free = x[:, inner[0] : inner[1] + 1]
        chords = np.linalg.norm(np.diff(x, axis=1), axis=2).mean(axis=0)
        s = np.concatenate([[0.0], np.cumsum(chords)])
        fractions = (s - s[inner[0]]) / (s[inner[1]] - s[inner[0]])
        some = np.linspace(0, len(free) - 1, min(len(free), 20)).astype(int)
        curves = [_curve(free[f], fractions[inner[0] : inner[1] + 1]) for f in some]
        length = float(np.mean([np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in curves]))
        return cls(recording, inner, x, v, fractions, length)

    @property
    def free(self) -> range:
        """Numbers of the markers between the grips."""
        return range(self.inner[0] + 1, self.inner[1])

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

    def start(self, frame: int) -> tuple[Array, Array]:
        """Points (k, 3) m along a smooth curve through the markers between the grips, and velocities (k, 3) m/s."""
        part = slice(self.inner[0], self.inner[1] + 1)
        s = self.fractions[part]
        return _curve(self.positions[frame, part], s), _curve(self.velocities[frame, part], s)


def motions_of(recordings: Sequence[Recording | GrippedMotion], smoothing: float) -> list[GrippedMotion]:
    """Motions of recordings, smoothed over so many s; those that are motions already stay as they are."""
    return [r if isinstance(r, GrippedMotion) else GrippedMotion.of(r, smoothing) for r in recordings]


def smoothed(times: Array, positions: Array, width: float) -> tuple[Array, Array]:
    """Values and slopes of the parabola fitted around each frame (Savitzky & Golay 1964), one-sided at the ends.

    Args:
        times: (frames,) s, evenly spaced.
        positions: (frames, ...) finite.
        width: s; fewer than five frames leave the positions as they are, with central differences.
    """
    step = float(np.median(np.diff(times)))
    frames = min(2 * round(width / step / 2) + 1, len(times) - (1 - len(times) % 2))
    if frames < 5:
        return positions, np.gradient(positions, times, axis=0)
    half = frames // 2
    t = step * np.arange(-half, half + 1)
    fit = np.linalg.pinv(np.vander(t, 3, increasing=True))
    parabolas = np.lib.stride_tricks.sliding_window_view(positions, frames, axis=0) @ fit.T
    at = np.clip(np.arange(len(times)), half, len(times) - 1 - half)  # the middle of the frame's parabola
    offset = (step * (np.arange(len(times)) - at)).reshape(-1, *[1] * (positions.ndim - 1))
    value, slope, bend = np.moveaxis(parabolas[at - half], -1, 0)
    return value + offset * (slope + offset * bend), slope + 2.0 * offset * bend


def _bridged(recording: Recording) -> Array:
    """(frames, markers, 3) m without gaps; those of gripped markers must be shorter (`Recording.filled`)."""
    filled, times = recording.filled(), recording.times
    gap = max(timeseries.default_max_gap(times), BRIDGED)
    positions = timeseries.interpolate(times, filled.positions, times, "cubic", gap)
    lost = np.argwhere(np.isnan(positions[:, :, 0]))
    if len(lost):
        frame, marker = lost[0]
        label, problem = f"marker {recording.markers[marker]!r} of {recording.name}", f"is lost for over {gap:.3g} s"
        fix = "cut a piece without the gap, or leave the marker out with `select`"
        raise RecordingError(label, f"{problem}, or at an end", f"not seen at {times[frame]:.6g} s", fix)
    return positions


def _curve(points: Array, s: Array) -> Array:
    spline = require("scipy.interpolate", "fit").CubicSpline(s, points)
    return np.asarray(spline(np.linspace(s[0], s[-1], POLYLINE)))


def _inner(recording: Recording) -> tuple[int, int]:
    count, held = len(recording.markers), set(recording.clamped)
    first = next((k for k in range(count) if k not in held), count)
    last = next((k for k in reversed(range(count)) if k not in held), -1)
    gripped = held == set(range(first)) | set(range(last + 1, count))
    if not gripped or first < 2 or last > count - 3 or last < first:
        fix = "name the gripped markers in `clamped`: two or more in a row at each end, free ones between"
        raise RecordingError("clamped", f"of {recording.name} are no two grips", sorted(held), fix)
    return first - 1, last + 1
