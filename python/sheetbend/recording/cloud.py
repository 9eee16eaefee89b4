"""A cloud: points on a cloth or a rope over time, such as a depth camera's, of which nobody knows which is which."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, finite, is_list, is_number
from ..arrays.types import Array
from ..errors import RecordingError
from ..files.names import checked_name
from .io import cloud as file_of_cloud
from .recording import Recording
from .recording_checks import check_points, checked_positions, checked_times, padded

CHUNK = 256  # points whose distances from all others are held at once


@dataclass(frozen=True, eq=False)
class Cloud(Recording):
    """Unordered points on a cloth or a rope, another number of them in every frame; some or many may be missing.

    A fit compares each point with the closest place on the simulated cloth or rope: see "Point clouds" in
    docs/clouds.md.
    Make one with `Cloud.of` or `Cloud.load`. It is a `Recording` whose points have no names: row k of one frame is
    another point than row k of the next, so whatever follows a marker over time (`select`, `resample`, `filled`,
    `noise`) is refused.

    Attributes:
        positions: (frames, most, 3) m, the points of each frame and behind them NaN; `frame(k)` has those of one frame.
        times, name, gravity, metadata: as of a `Recording`.

    Raises:
        RecordingError: as `Recording`; there is no point, or some are `clamped`.
    """

    def __post_init__(self) -> None:
        if len(self.clamped):
            fix = "drive the scene by a recording of markers or of poses, and leave `clamped` out"
            raise RecordingError("clamped", "names points of a cloud, which have no names", self.clamped, fix)
        points = checked_positions(self.positions)
        object.__setattr__(self, "positions", padded([frame[~np.isnan(frame[:, 0])] for frame in points]))
        object.__setattr__(self, "markers", ())  # numbers of rows, made again for as many as there are
        super().__post_init__()

    def __repr__(self) -> str:
        least, most = int(self.counts.min()), int(self.counts.max())
        return f"Cloud({self.name!r}, {len(self.times)} frames, {least} to {most} points)"

    @classmethod
    def of(cls, points: Sequence[ArrayLike], times: ArrayLike, **fields: Any) -> Cloud:
        """A cloud of one array of points per frame.

        Args:
            points: (n, 3) m of each frame, n of its own; (0, 3) where nothing was seen. No NaN.
            times: (frames,) s.
            fields: further attributes, such as `name`.

        Raises:
            RecordingError: names the frame whose points are not finite or have another shape.
        """
        if not is_list(points):
            raise RecordingError("points", "must be a list", points, "give the points (n, 3) m of each frame")
        at = checked_times(times, len(points))
        return cls(padded([_checked(k, frame) for k, frame in enumerate(points)]), at, **fields)

    @classmethod
    def load(cls, path: str | Path, units: str | None = None) -> Cloud:
        """Read an .npz file with `points` (all, 3), those of one frame after the other, `counts` (frames,), how many
        of them each frame has, and `times` (frames,) s. A JSON of the same stem adds units, gravity and metadata.

        Args:
            units: length unit of the file, "m", "cm", "mm", "in" or "ft"; None takes the JSON's, and m
                without one.

        Raises:
            RecordingError: the file is missing, corrupt or no valid cloud.
        """
        return cls(**vars(file_of_cloud.load(Path(path), units)))

    def save(self, path: str | Path) -> None:
        """Write an .npz file as `load` reads it, in meters, and the JSON beside it.

        Raises:
            RecordingError: the suffix is another, the folder is missing, or the metadata are no JSON.
        """
        file_of_cloud.save(self, Path(path))

    @property
    def counts(self) -> Array:
        """(frames,) how many points each frame has."""
        return np.asarray(self.mask.sum(axis=1))

    def frame(self, number: int) -> Array:
        """(n, 3) m, the points of one frame."""
        check_count("frame", number, -len(self.times), len(self.times) - 1, RecordingError)
        return np.asarray(self.positions[number][self.mask[number]])

    def named(self, name: str) -> Cloud:
        """The same cloud under another name. Its frames keep their width, so that pieces of one cloud fit each
        other."""
        return self._derive(name=checked_name("name", name))

    def closest_among(self, points: Array) -> Array:
        """(frames, most, 3) m, of `points` (k, 3) the one closest to each of the cloud's; NaN behind a frame's own."""
        found = np.full(self.positions.shape, np.nan)
        for number, own in enumerate(found):
            x = self.frame(number)
            for first in range(0, len(x), CHUNK):
                near = ((x[first : first + CHUNK, None] - points) ** 2).sum(axis=2).argmin(axis=1)
                own[first : first + len(near)] = points[near]
        return found

    def pooled(self) -> Cloud:
        """All points as one frame, at the time of the first: several frames of a cloth at rest."""
        return self._with([self.positions[self.mask]], self.times[:1])

    def thinned(self, most: int, seed: int = 0) -> Cloud:
        """The cloud with a part of its points: the time of a fit grows with their number.

        Args:
            most: points per frame, drawn at random.
            seed: of the draw.

        Raises:
            RecordingError: `most` is not positive.
        """
        check_count("most", most, 1, sys.maxsize, RecordingError)
        check_count("seed", seed, 0, sys.maxsize, RecordingError)
        generator = np.random.default_rng(seed)
        frames = [self.frame(k) for k in range(len(self.times))]
        drawn = [np.sort(generator.permutation(len(x))[:most]) for x in frames]
        return self._with([x[own] for x, own in zip(frames, drawn, strict=True)], self.times)

    def to_axis(self, camera: ArrayLike, radius: float) -> Cloud:
        """The cloud of a thick rope, moved from the side that a camera sees to the rope's axis.

        Each point moves away from the camera by pi/4 of the radius, which is the mean depth of the axis below the half
        of a cylinder that faces the camera. Across the rope the points still scatter, by half of the radius: let
        `sigma` contain this scatter.

        Args:
            camera: (3,) m, where the camera is, in the recording's frame.
            radius: of the rope, m.

        Raises:
            RecordingError: the camera is no place, or the radius is not positive.
        """
        at = finite("camera", camera, (3,), RecordingError)
        if not (is_number(radius) and radius > 0):
            raise RecordingError("radius", "must be positive", radius, "give the rope's radius in m, such as 0.004")
        frames = [self.frame(k) for k in range(len(self.times))]
        away = [x - at for x in frames]
        depth = np.pi / 4 * radius
        moved = [x + depth * d / np.linalg.norm(d, axis=1, keepdims=True) for x, d in zip(frames, away, strict=True)]
        return self._with(moved, self.times)

    def summary(self) -> str:
        """A few lines for a terminal: size, duration, attribution."""
        lines = [f"{self.name}: {len(self.times)} frames, {self.counts.min()} to {self.counts.max()} points each"]
        lines.append(f"  time      {self.times[0]:.6g} to {self.times[-1]:.6g} s")
        if self.gravity is not None:
            lines.append(f"  gravity   {', '.join(f'{g:.6g}' for g in self.gravity)} m/s^2")
        if "attribution" in self.metadata:
            lines.append(f"  source    {self.metadata['attribution']}")
        return "\n".join(lines)

    def select(self, markers: Sequence[str | int]) -> NoReturn:
        """Refused: the points have no names."""
        _refuse("select", markers)

    def resample(self, times: ArrayLike, kind: Any = "linear", max_gap: float | None = None) -> NoReturn:
        """Refused: no point is followed over time."""
        _refuse("resample", times)

    def filled(self, max_gap: float | None = None) -> NoReturn:
        """Refused: no point is followed over time."""
        _refuse("filled", max_gap)

    def noise(self) -> NoReturn:
        """Refused: no point is followed over time."""
        _refuse("noise", self.name)

    def _with(self, points: Sequence[Array], times: Array) -> Cloud:
        return Cloud(padded(points), times, name=self.name, gravity=self.gravity, metadata=self.metadata)


def _checked(k: int, given: ArrayLike) -> Array:
    try:
        points = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        points = np.full(1, np.nan)
    if points.ndim != 2 or points.shape[1] != 3:
        raise RecordingError(f"points[{k}]", "must have the shape (n, 3)", np.shape(given), "give x, y, z of each in m")
    check_points(f"points[{k}]", points)
    return points


def _refuse(what: str, got: Any) -> NoReturn:
    fix = "use `frames`, `piece`, `shifted` and `thinned`, or a Recording of markers"
    raise RecordingError(what, "follows markers, and the points of a cloud have no names", got, fix)
