"""What a recording shows before anything is fitted: what stays, what moves together, and how markers hang together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from statistics import NormalDist
from typing import Literal

import numpy as np

from ..arrays.shortest_tree import tree
from ..arrays.smoothing import smoothed
from ..arrays.timeseries import default_max_gap, interpolate, linear, mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from ..recording.recording import Recording
from . import strangers
from .line import chain, turns_sharply

EARTH = 9.81
STILL, CALM = 6.0, 4.0  # times the noise, by which a marker that stays may move; by which one at rest may
SILENT = 2e-3  # of the extent: how little a marker moves that stays, where no noise is known
RIGID = 1.8  # times the noise, the standard deviation of the distance of two markers of one body: sqrt(2) is expected
MANY, ABOVE = 50, 2.9  # frames from which on 98 % of the distances are 2.05 sqrt(2) times the noise above the true one
SHARE, FEW = 0.98, 10  # of the frames have smaller distances; frames from which on noise is taken out of these
SLOWEST = 0.5  # s between two frames of a motion
REST = 0.15  # s that a recording must begin at rest to be called so
NEAR = 1.9  # times the nearest neighbor's distance: markers of a sheet have more than two others so near
SHARP, TURNS = 0.15, 3  # share of markers at which the shortest way through those of a sheet turns back, and how many
SHEET, FEWEST_OF_SHEET = 2.7, 8  # others so near, on average, of a sheet; markers that make one
BROAD, FEWEST_BROAD = 0.4, 12  # of the shortest tree: the largest distance is less on a sheet; markers that tell it


@dataclass(frozen=True, eq=False)
class Seen:
    """What a recording shows.

    Attributes:
        recording: with lengths in m.
        still: numbers of the markers that do not move.
        bodies: groups of three or more markers that keep their distances, on no rope of their own.
        loose: the other markers, those that move and belong to no body, in the order of the file.
        apart: (markers, markers) m, the largest distance of every two markers over time: 98 % of the frames are below,
            less what their noise adds where the distance hardly changes.
        noise: m per coordinate; 0 where the recording is too short to tell.
        rest: s, for how long nothing moves at the beginning.
        speed: m/s, of the fastest marker, smoothed; 99 % of the frames are slower.
        up: 0, 1 or 2, the axis along which gravity points.
        up_by: who says which way that is: the file, who began the draft, or nobody.
        strangers: sentences about markers that are left out.
        sheet: whether the loose markers lie on a sheet rather than along a line.
    """

    recording: Recording
    still: tuple[int, ...]
    bodies: tuple[tuple[int, ...], ...]
    loose: tuple[int, ...]
    apart: Array
    noise: float
    rest: float
    speed: float
    up: int
    up_by: Literal["file", "user", "guess"]
    sheet: bool
    strangers: tuple[str, ...] = ()

    @property
    def static(self) -> bool:
        """Whether nothing moves at all: shapes at rest."""
        return len(self.still) == len(self.recording.markers)

    @property
    def gravity(self) -> Array:
        """(3,) m/s^2, as told, else along `up`."""
        if self.recording.gravity is not None:
            return np.asarray(self.recording.gravity)
        return np.where(np.arange(3) == self.up, -EARTH, 0.0)

    def along(self, way: Sequence[int]) -> Array:
        """(markers,) m, where markers in this order are along the line through them."""
        return np.concatenate([[0.0], np.cumsum([self.apart[a, b] for a, b in pairwise(way)])])

    def upside_down(self) -> Seen:
        """The same, with gravity the other way."""
        return replace(self, recording=replace(self.recording, gravity=0.0 - self.gravity))

    def of(self, part: Recording) -> Seen:
        """What a part of the recording shows alone: some of its markers, or of its time."""
        return replace(seen(part), up=self.up, up_by=self.up_by)


def seen(recording: Recording, up: str | None = None) -> Seen:
    """Look at a recording.

    Args:
        recording: with lengths in m.
        up: which way is up, such as "y" or "-z", in place of what the file says.

    Raises:
        RecordingError: two markers are never seen together.
    """
    if up is not None:
        down = np.where(np.array(list("xyz")) == up[-1], EARTH if up[0] == "-" else -EARTH, 0.0)
        recording = replace(recording, gravity=down)
    if (found := strangers.twice(recording) or strangers.rare(recording)) is not None:
        return _without(recording, found, up)
    x, t = recording.positions, recording.times
    count = len(recording.markers)
    each = recording.noise()
    if (found := strangers.restless(recording, each)) is not None:
        return _without(recording, found, up)
    noise = float(np.nanmedian(each)) if np.isfinite(each).any() else 0.0
    center = mean_position(x)
    extent = float(np.linalg.norm(np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))))
    moved = np.sqrt(np.nanmean(np.sum((x - center) ** 2, axis=2), axis=0)) if len(t) > 1 else np.zeros(count)
    _check_together(recording)
    _check_rate(recording)
    distance = distances(x)
    # by each one's own noise: marks of the room make the extent large, and may be noisier
    stays = moved <= (STILL * np.fmax(each, noise) if noise else SILENT * extent)
    if (found := strangers.of_the_room(recording, stays, distance, each)) is not None:
        return _without(recording, found, up)
    still = moved <= max(STILL * noise, SILENT * extent)
    apart = np.nanquantile(distance, SHARE, axis=0)
    if len(t) >= FEW:
        apart = np.maximum(apart - _above(len(distance)) * noise, 0.5 * apart)
    change = np.nanstd(distance, axis=0)
    bodies = [] if len(t) < 3 else _bodies(change <= np.maximum(RIGID * noise, 1e-3 * apart), apart, still)
    in_bodies = {k for body in bodies for k in body}
    loose = tuple(k for k in range(count) if not still[k] and k not in in_bodies)
    axis, told = _up(recording)
    return Seen(
        recording=recording,
        still=tuple(int(k) for k in np.flatnonzero(still)),
        bodies=tuple(bodies),
        loose=loose,
        apart=apart,
        noise=noise,
        rest=_rest(recording, max(noise, 1e-4 * extent)),
        speed=_speed(recording),
        up=axis,
        up_by="user" if up is not None else "file" if told else "guess",
        sheet=is_sheet(x, apart, bodies, np.flatnonzero(still).tolist()),
    )


def _without(recording: Recording, found: strangers.Strangers, up: str | None) -> Seen:
    """What it shows without some markers."""
    rest = seen(recording.select([name for k, name in enumerate(recording.markers) if k not in found.markers]), up)
    return replace(rest, strangers=(found.said, *rest.strangers))


def _check_rate(recording: Recording) -> None:
    """Refuse motions so slowly recorded that their times are in another unit."""
    if len(recording.times) < FEW:
        return
    apart = float(np.median(np.diff(recording.times)))
    if apart >= SLOWEST:
        fix = "name its column time_ms if it counts milliseconds, or take every frame of the recording"
        raise RecordingError(f"{recording.name}.times", f"are {apart:.3g} s apart, too far for a motion", apart, fix)


def _check_together(recording: Recording) -> None:
    """Refuse markers of which two are never seen in one frame: mostly one that came back under another name."""
    seen_in = recording.mask.astype(float)
    together = seen_in.T @ seen_in
    if together.all():
        return
    a, b = np.argwhere(together == 0)[0]
    names = [recording.markers[a], recording.markers[b]]
    fix = (
        "if they are one marker that was lost and found again, give both pieces one name where you label the "
        "recording; else delete one of them, or cut a part of the recording in which both are seen"
    )
    raise RecordingError("markers", "are never seen together, so nothing tells how far apart they are", names, fix)


def _above(frames: int) -> float:
    """By how many times the noise of a coordinate the quantile of so many distances is above a distance that does not
    change: of a few an order statistic of normal numbers (Blom 1958), of sqrt(2) times the noise."""
    if frames >= MANY:
        return ABOVE
    rank = 1.0 + SHARE * (frames - 1)
    return float(np.sqrt(2.0)) * NormalDist().inv_cdf((rank - 0.375) / (frames + 0.25))


def distances(x: Array) -> Array:
    """(frames, markers, markers) m, of so many frames that the array stays small."""
    most = max(60, 4_000_000 // x.shape[1] ** 2)
    some = x[np.linspace(0, len(x) - 1, min(len(x), most)).astype(int)]
    return np.asarray(np.linalg.norm(some[:, :, None] - some[:, None], axis=3))


def _bodies(keeps: Array, apart: Array, still: Array) -> list[tuple[int, ...]]:
    """Largest groups of three or more moving markers of which every two keep their distance, and that lie close
    together: a straight piece of rope is no body."""
    left = set(np.flatnonzero(~still).tolist())
    found = []
    for first in sorted(left):
        if first not in left:
            continue
        group = [first]
        for other in sorted(left - {first}, key=lambda k: apart[first, k]):
            if all(keeps[other, k] for k in group):
                group.append(other)
        if len(group) >= 3 and not in_line(apart[np.ix_(group, group)]):
            found.append(tuple(sorted(group)))
            left -= set(group)
    return found


def rigid(x: Array, noise: float) -> bool:
    """Whether markers (frames, markers, 3) keep their distances, up to the noise, m."""
    distance = distances(x)
    return bool(np.all(np.nanstd(distance, axis=0) <= np.maximum(RIGID * noise, 1e-3 * np.nanmax(distance, axis=0))))


def in_line(apart: Array) -> bool:
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
    smooth, _ = motion_of(recording)
    first = mean_position(smooth[t <= REST / 2])
    off = np.nan_to_num(smooth - first)
    gone = np.flatnonzero((np.linalg.norm(off, axis=2) > CALM * noise).any(axis=1))
    return float(t[gone[0]] if len(gone) else t[-1])


def _speed(recording: Recording) -> float:
    """m/s; 0 for recordings that are too short to tell."""
    if len(recording.times) < 8:
        return 0.0
    _, rate = motion_of(recording)
    size = np.nan_to_num(np.linalg.norm(rate, axis=2))
    return float(np.quantile(size.max(axis=1), 0.99))


def motion_of(recording: Recording) -> tuple[Array, Array]:
    """Smoothed positions and velocities; NaN where a marker is lost for longer than short gaps, and as near to such a
    gap as the smoothing reaches."""
    t, x = recording.times, recording.positions
    known = np.isfinite(interpolate(t, x, t, "linear", default_max_gap(t))[..., 0])
    whole = np.zeros_like(x)
    for k in range(x.shape[1]):
        seen = recording.mask[:, k]
        whole[:, k] = linear(t[seen], x[seen, k], t)
    reach = round(REST / 2 / float(np.median(np.diff(t))))
    known = all_around(known, reach)
    value, rate = smoothed(t, whole, REST / 2)
    return np.where(known[..., None], value, np.nan), np.where(known[..., None], rate, np.nan)


def all_around(known: Array, reach: int) -> Array:
    """Whether all of so many frames before and after each one are known, of series (frames, markers)."""
    lost = np.cumsum(np.pad(~known, ((reach + 1, reach), (0, 0))), axis=0)
    return np.asarray(lost[2 * reach + 1 :] == lost[: -2 * reach - 1])


def _up(recording: Recording) -> tuple[int, bool]:
    if recording.gravity is not None:
        return int(np.argmax(np.abs(recording.gravity))), True
    center = mean_position(recording.positions)
    spread = np.nanmax(center, axis=0) - np.nanmin(center, axis=0)
    # what hangs is long along the vertical; motion capture has y or z there
    return (1 if spread[1] > 1.5 * spread[2] else 2), False


def fixtures(apart: Array, still: Sequence[int]) -> list[tuple[int, ...]]:
    """Groups of three or more markers that stay and lie on no line, as those on a vise or on a robot that rests."""
    left, neighbors = set(still), tree(apart, tuple(range(len(apart))))[0]
    found = []
    while left:
        group, reached = set[int](), {min(left)}
        while reached:
            group |= reached
            reached = {k for j in reached for k in neighbors[j] if k in left} - group
        left -= group
        own = tuple(sorted(group))
        if len(own) >= 3 and turns_sharply(apart, chain(apart, own)):
            found.append(own)
    return found


def is_sheet(x: Array, apart: Array, bodies: Sequence[Sequence[int]], still: Sequence[int] = ()) -> bool:
    """Whether the markers have neighbors on all sides, or the shortest way through them turns back again and again.
    Those on what holds them do not count: bodies with half of the markers at most, or at the ends of a line."""
    few = {k for group in bodies for k in group}
    few = few if 2 * len(few) <= len(apart) else set()
    holding = _at_the_ends(apart, [*bodies, *fixtures(apart, still)]) or few
    own = [k for k in range(len(apart)) if k not in holding]
    x, apart = x[:, own], apart[np.ix_(own, own)]
    if len(apart) < FEWEST_OF_SHEET:
        return False
    d = apart + np.where(np.eye(len(apart), dtype=bool), np.inf, 0.0)
    nearest = np.median(d.min(axis=1))
    if (d < NEAR * nearest).sum(axis=1).mean() > SHEET:
        return True
    everyone = tuple(range(len(apart)))
    if len(apart) >= FEWEST_BROAD and apart.max() < BROAD * tree(apart, everyone)[1]:  # rows far apart
        return True
    fullest = int(np.argmax((~np.isnan(x[:, :, 0])).sum(axis=1)))
    way = np.diff(x[fullest, list(chain(apart, everyone))], axis=0)
    back = np.sum(way[1:] * way[:-1], axis=1) < 0.0
    return bool(back.sum() >= TURNS and back.mean() > SHARP)


def _at_the_ends(apart: Array, groups: Sequence[Sequence[int]]) -> set[int]:
    """The markers of one or two of the groups, where the others are a line of three or more and each of these groups is
    at an end of it of its own; else none."""
    for chosen in [*combinations(groups, 2), *combinations(groups, 1)]:
        holding = {k for group in chosen for k in group}
        line = chain(apart, tuple(k for k in range(len(apart)) if k not in holding))
        if len(line) >= 3 and not turns_sharply(apart, line):
            near = {line[int(apart[np.ix_(group, line)].min(axis=0).argmin())] for group in chosen}
            if len(near) == len(chosen) and near <= {line[0], line[-1]}:
                return holding
    return set()
