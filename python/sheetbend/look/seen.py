"""What a recording shows before anything is fitted: what stays, what moves together, and how markers hang together."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..recording.recording import Recording
from ..arrays.smoothing import smoothed
from ..arrays.timeseries import default_max_gap, interpolate, mean_position

Array = np.ndarray
EARTH = 9.81
STILL, CALM = 6.0, 4.0  # times the noise, by which a marker that stays may move; by which one at rest may
SILENT = 2e-3  # of the extent: how little a marker moves that stays, where no noise is known
RIGID = 1.8  # times the noise, the standard deviation of the distance of two markers of one body: sqrt(2) is expected
REST = 0.15  # s that a recording must begin at rest to be called so
NEAR = 1.9  # times the nearest neighbor's distance: markers of a sheet have more than two others so near
SHARP, TURNS = 0.15, 3  # share of markers at which the shortest way through those of a sheet turns back, and how many
SHEET, FEWEST_OF_SHEET = 2.7, 8  # others so near, on average, of a sheet; markers that make one
PLAUSIBLE = (0.02, 20.0)  # m, extents of what is recorded in meters


@dataclass(frozen=True, eq=False)
class Seen:
    """What a recording shows.

    Attributes:
        recording: with lengths in m.
        still: numbers of the markers that do not move.
        bodies: groups of three or more markers that keep their distances, on no rope of their own.
        loose: the other markers, those that move and belong to no body, in the order of the file.
        apart: (markers, markers) m, the largest distance of every two markers over time (98 % of the frames).
        noise: m per coordinate; 0 where the recording is too short to tell.
        rest: s, for how long nothing moves at the beginning.
        up: 0, 1 or 2, the axis along which gravity points down; None where neither the file nor the motion tells.
        told: whether the file says it.
        sheet: whether the loose markers lie on a sheet rather than along a line.
    """

    recording: Recording
    still: tuple[int, ...]
    bodies: tuple[tuple[int, ...], ...]
    loose: tuple[int, ...]
    apart: Array
    noise: float
    rest: float
    up: int
    told: bool
    sheet: bool

    @property
    def static(self) -> bool:
        """Whether nothing moves at all: shapes at rest."""
        return len(self.still) == len(self.recording.markers)

    @property
    def gravity(self) -> Array:
        """(3,) m/s^2, the recording's own, or that along `up`."""
        if self.recording.gravity is not None:
            return np.asarray(self.recording.gravity)
        return -EARTH * np.eye(3)[self.up]


def seen(recording: Recording) -> Seen:
    """Look at a recording."""
    x, t = recording.positions, recording.times
    count = len(recording.markers)
    found = recording.noise()
    noise = float(np.nanmedian(found)) if np.isfinite(found).any() else 0.0
    center = mean_position(x)
    extent = float(np.linalg.norm(np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))))
    moved = np.sqrt(np.nanmean(np.sum((x - center) ** 2, axis=2), axis=0)) if len(t) > 1 else np.zeros(count)
    still = moved <= max(STILL * noise, SILENT * extent)
    distance = np.linalg.norm(x[:, :, None] - x[:, None], axis=3) if count <= 120 else _thinned(x)
    apart = np.nanquantile(distance, 0.98, axis=0)
    change = np.nanstd(distance, axis=0)
    bodies = [] if len(t) < 3 else _bodies(change <= np.maximum(RIGID * noise, 1e-3 * apart), apart, still)
    in_bodies = {k for body in bodies for k in body}
    loose = tuple(k for k in range(count) if not still[k] and k not in in_bodies)
    chosen = tuple(range(count))
    up, told = _up(recording, chosen, still, extent)
    return Seen(
        recording=recording,
        still=tuple(int(k) for k in np.flatnonzero(still)),
        bodies=tuple(bodies),
        loose=loose,
        apart=apart,
        noise=noise,
        rest=_rest(recording, max(noise, 1e-4 * extent)),
        up=up,
        told=told,
        sheet=_is_sheet(x, apart, chosen),
    )


def _thinned(x: Array) -> Array:
    some = x[np.linspace(0, len(x) - 1, min(len(x), 60)).astype(int)]
    return np.linalg.norm(some[:, :, None] - some[:, None], axis=3)


def _bodies(rigid: Array, apart: Array, still: Array) -> list[tuple[int, ...]]:
    """Largest groups of three or more moving markers of which every two keep their distance, and that lie close
    together: a straight piece of rope is no body."""
    left = set(np.flatnonzero(~still).tolist())
    found = []
    for first in sorted(left):
        if first not in left:
            continue
        group = [first]
        for other in sorted(left - {first}, key=lambda k: apart[first, k]):
            if all(rigid[other, k] for k in group):
                group.append(other)
        if len(group) >= 3 and not _in_line(apart[np.ix_(group, group)]):
            found.append(tuple(sorted(group)))
            left -= set(group)
    return found


def _in_line(apart: Array) -> bool:
    """Whether three or more points with these distances are on one line, or almost: classical scaling."""
    n = len(apart)
    centered = np.eye(n) - 1.0 / n
    spread = np.sort(np.linalg.eigvalsh(-0.5 * centered @ apart**2 @ centered))[::-1]
    return bool(spread[1] < 0.01 * spread[0])


def _rest(recording: Recording, noise: float) -> float:
    """s, until a marker leaves where it was in the first frames."""
    t = recording.times - recording.times[0]
    if len(t) < 8 or not (t <= REST).sum() >= 4:
        return 0.0
    x = recording.positions
    filled = interpolate(recording.times, x, recording.times, "linear", default_max_gap(recording.times))
    smooth = np.where(np.isnan(filled), 0.0, filled)
    smooth, _ = smoothed(recording.times, smooth, REST / 2)
    first = np.median(smooth[t <= REST / 2], axis=0)
    off = np.where(np.isnan(filled), 0.0, smooth - first)
    gone = np.flatnonzero((np.linalg.norm(off, axis=2) > CALM * noise).any(axis=1))
    return float(t[gone[0]] if len(gone) else t[-1])


def _up(recording: Recording, chosen: tuple[int, ...], still: Array, extent: float) -> tuple[int, bool]:
    if recording.gravity is not None:
        return int(np.argmax(np.abs(recording.gravity))), True
    x = recording.positions[:, list(chosen)]
    spread = np.nanmax(mean_position(x), axis=0) - np.nanmin(mean_position(x), axis=0)
    # what hangs is long along the vertical; motion capture has y or z there
    return (1 if spread[1] > 1.5 * spread[2] else 2), False


def _is_sheet(x: Array, apart: Array, chosen: tuple[int, ...]) -> bool:
    if len(chosen) < FEWEST_OF_SHEET:
        return False
    d = apart[np.ix_(chosen, chosen)] + np.where(np.eye(len(chosen), dtype=bool), np.inf, 0.0)
    nearest = np.median(d.min(axis=1))
    if (d < NEAR * nearest).sum(axis=1).mean() > SHEET:
        return True
    way = np.diff(x[int(np.argmax((~np.isnan(x[:, :, 0])).sum(axis=1))), list(chain(apart, chosen))], axis=0)
    back = np.sum(way[1:] * way[:-1], axis=1) < 0.0
    return bool(back.sum() >= TURNS and back.mean() > SHARP)


def chain(apart: Array, markers: tuple[int, ...]) -> tuple[int, ...]:
    """Markers in order along a line: the file's order, unless another one is a tenth shorter."""
    if len(markers) < 3:
        return markers

    def length(order: tuple[int, ...]) -> float:
        return float(sum(apart[a, b] for a, b in pairwise(order)))

    best = markers
    for first in markers:
        order, left = [first], set(markers) - {first}
        while left:
            order.append(min(left, key=lambda k: apart[order[-1], k]))
            left.remove(order[-1])
        if length(tuple(order)) < 0.9 * length(best):
            best = tuple(order)
    return best


def unit_doubt(recording: Recording) -> str | None:
    """The unit that a recording is more plausible in than in the one that was read, "mm" or "cm"; None where it is
    plausible as it is: nothing that hangs in a hand is 700 m long."""
    x = recording.positions
    extent = float(np.linalg.norm(np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))))
    if extent <= PLAUSIBLE[1]:
        return None
    return "cm" if extent < 1e2 * PLAUSIBLE[1] / 10 else "mm"
