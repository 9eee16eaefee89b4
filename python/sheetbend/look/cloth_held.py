"""What holds a cloth in a recording: edges or corners of it, moved by a holder's markers or by its own, or at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.timeseries import default_max_gap
from ..arrays.types import Array
from .margin import HALF, Edge, Margin, margin
from .seen import Seen
from .sheet import laid, spacing

QUIET = 0.1  # of the motion of all: how little a row moves where the edge beyond it is held
STAYS = 0.3  # of the motion of all, and of any other side: how little the row moves that is next to a held edge
SAGS = 0.03  # of its length: by so much a row of markers hangs below its ends where only these are held
LEVEL = 0.05  # of the motion of all: by so much the row of markers below a rail moves up and down
HANGS = 0.4  # of its length: a cloth of which one end is so much higher than the other is not level
AROUND = 6  # markers next to a holder show how the cloth lies there
REACHES = 2.5  # spacings from the nearest marker on the cloth: how near a holder's marker is
LOOSE = 0.15  # of this distance: by so much it varies at most, a standard deviation
CORNER = 0.5  # of how far a holder's marker is beyond any side: so far it is beyond the one side that several hold
SIDES = {"left": (0, -1), "right": (0, 1), "bottom": (1, -1), "top": (1, 1)}


@dataclass(frozen=True)
class Hold:
    """A side of a cloth that is held.

    Attributes:
        side: of its mesh.
        markers: that show where the held part is: of a holder, or of the cloth's own row, in order along it.
        corners: whether each of them holds the vertex next to it, instead of all of them the whole side.
        moves: whether they move; a side at rest is pinned.
        beyond: m, from the outer row of markers to the side.
        own: whether these markers are the cloth's own.
        along: m, where they are along the side, in the coordinates of the markers' places; of a holder.
        bar: (3,) direction of the side, where one marker of a holder alone shows where it is.
        tool: name of the tool that moves it, in place of the markers.
        margin: where `beyond` is from, of an edge beyond the cloth's own row that rests or that a tool moves.
    """

    side: str
    markers: tuple[int, ...]
    corners: bool
    moves: bool
    beyond: float
    own: bool
    along: tuple[float, ...] = ()
    bar: tuple[float, ...] | None = None
    tool: str | None = None
    margin: Margin | None = None

    def driving(self, s: Seen) -> list[int]:
        """The markers whose motion moves the cloth."""
        if not self.moves or self.tool is not None:
            return []
        return list(self.markers) if self.corners else _without_gaps(s, self.markers)

    def tables(self, names: Sequence[str], s: Seen) -> tuple[list[Any], list[Any], list[Any]]:
        """Sets that are pinned, sets, and grips of a cloth."""
        if not self.corners:
            if not self.moves:
                return [self.side], [], []
            if self.tool is not None:
                return [], [], [{"set": self.side, "tool": self.tool}]
            return [], [], [{"set": self.side, "markers": [names[k] for k in self.driving(s)]}]
        by_set = {f"{self.side}_{j + 1}": [names[k]] for j, k in enumerate(self.markers)}
        sets = [{"name": name, "markers": markers} for name, markers in by_set.items()]
        if not self.moves:
            return list(by_set), sets, []
        return [], sets, [{"set": name, "markers": markers} for name, markers in by_set.items()]

    @property
    def edge(self) -> Edge | None:
        """The edge beyond the cloth's own row, where the motion shows it."""
        return None if self.margin is None else self.margin.edge


def share(held: Sequence[Hold]) -> float:
    """By how much a cloth goes on beyond its outer markers where nothing holds it, over the distance between markers:
    as beyond the row next to what holds it, for want of better knowledge. Not at all where the corners of the markers
    are in the hands, so that the markers end at the edges."""
    if any(hold.corners and hold.own for hold in held):
        return 0.0
    return next((hold.margin.share for hold in held if hold.margin is not None), HALF)


def row_of(flat: Array, side: str, apart: float) -> list[int]:
    """Numbers in flat (markers, 2) of the outer row of a side, in order along it."""
    axis, sign = SIDES[side]
    across = sign * flat[:, axis]
    return [int(k) for k in np.argsort(flat[:, 1 - axis]) if across[k] > across.max() - 0.5 * apart]


def slung(x: Array, flat: Array, up: Array, apart: float) -> tuple[int, float]:
    """How a cloth that lies about level is slung: the axis of flat along which its middle is lowest or highest, and by
    what share of the size both ends are above the middle; negative for a cloth that lies over something. Zero for a
    cloth that hangs."""
    height = np.nanmean(x, axis=0) @ up
    best = (0, 0.0)
    for axis, pair in enumerate((("left", "right"), ("bottom", "top"))):
        along, size = flat[:, axis], max(float(np.ptp(flat[:, axis])), 1e-12)
        near = np.abs(along - 0.5 * (along.max() + along.min())) < max(size / 6, 0.75 * apart)
        ends = [float(np.nanmean(height[row_of(flat, side, apart)])) for side in pair]
        if abs(ends[1] - ends[0]) > HANGS * size:
            return axis, 0.0
        middle = float(np.nanmean(height[near])) if near.any() else 0.5 * sum(ends)
        rise = min(ends) - middle if min(ends) > middle else min(max(ends) - middle, 0.0)
        best = max(best, (axis, rise / size), key=lambda found: abs(found[1]))
    return best


def holds(
    s: Seen,
    own: Sequence[int],
    flat: Array,
    others: Sequence[int],
    sides: Sequence[str],
    bars: Mapping[int, tuple[float, ...]],
) -> list[Hold]:
    """How a cloth is held: by the holder's markers that are near it, else by the outer rows of some sides.

    Args:
        own: its markers, which lie at `flat` (markers, 2) m.
        others: markers on no cloth.
        sides: where it is held if no marker of a holder is near, and no other side stays alone; of two sides that such
            a marker is beyond, one of these counts.
        bars: directions of bars by their markers, in place of that of the row beside each.
    """
    x, numbers = s.recording.positions, list(own)
    apart = spacing(s.apart[np.ix_(numbers, numbers)])
    moved = max(motion(x[:, numbers]), apart)
    by_side: dict[str, list[tuple[float, float, int]]] = {}
    places = {k: at for k in others if (at := _place(s, numbers, flat, k, apart)) is not None}
    sides_of = _one_side(flat, list(places.values())) or sides
    for k, at in places.items():
        side, beyond = _side(flat, at, sides_of)
        if beyond > -0.5 * apart:
            by_side.setdefault(side, []).append((float(at[1 - SIDES[side][0]]), beyond, k))
    if len(sides) > 1 and all(len(near) == 1 for near in by_side.values()):
        by_side = _on_bars(s, numbers, flat, others, sides, bars) or by_side
    found = []
    for side, near in by_side.items():
        row = [numbers[k] for k in row_of(flat, side, apart)]
        along, _, markers = zip(*sorted(near), strict=True)
        beyond = max(0.0, float(np.mean([off for _, off, _ in near])))
        moves = motion(x[:, list(markers)]) >= QUIET * moved and not s.static
        sags = _sags(x, row)
        bar = None if sags or len(near) > 1 else bars.get(markers[0], tuple(_direction(x, row).tolist()))
        found.append(Hold(side, markers, sags, moves, beyond, False, along, bar))
    on_rail = len(sides) == 1 and _on_rail(s, [numbers[k] for k in row_of(flat, sides[0], apart)], moved)
    if not found and len(sides) == 1 and not on_rail:
        sides = _at_rest(s, numbers, flat, apart) or sides
    for side in () if found else sides:
        row = [numbers[k] for k in row_of(flat, side, apart)]
        moves = not s.static and motion(x[:, row]) >= QUIET * moved
        corners = not on_rail and _sags(x, row)
        told = None if moves or corners else margin(x[:, numbers], flat, *SIDES[side])
        markers = _corners(s, row) if corners else tuple(row)
        beyond = 0.0 if told is None else told.length
        found.append(Hold(side, markers, corners, moves, beyond, True, margin=told))
    return found


def _on_rail(s: Seen, row: list[int], moved: float) -> bool:
    """Whether a row of markers moves and stays at one height, as that of a curtain below its rail."""
    height = s.recording.positions[:, row] @ (s.gravity / np.linalg.norm(s.gravity))
    level = float(np.nanstd(height)) < max(LEVEL * moved, 2.0 * s.noise)
    return level and motion(s.recording.positions[:, row]) >= QUIET * moved


def _at_rest(s: Seen, own: list[int], flat: Array, apart: float) -> tuple[str, ...]:
    """The one side whose outer row stays where it is while the others move, as that of a flag, or moves far less than
    theirs, as beside a pole; else none."""
    x = s.recording.positions[:, own]
    rows = {side: row_of(flat, side, apart) for side in SIDES}
    resting = tuple(side for side, row in rows.items() if {own[k] for k in row} <= set(s.still))
    if len(resting) == 1 or s.static:
        return resting if len(resting) == 1 else ()
    (side, least), (_, following), *_ = sorted(
        ((side, motion(x[:, row])) for side, row in rows.items()), key=lambda found: found[1]
    )
    return (side,) if least < STAYS * min(motion(x), following) else ()


def _on_bars(
    s: Seen,
    own: list[int],
    flat: Array,
    others: Sequence[int],
    sides: Sequence[str],
    bars: Mapping[int, tuple[float, ...]],
) -> dict[str, list[tuple[float, float, int]]]:
    """By side, a marker on a straight bar that holds it: in line with the outer row, at a distance from it that hardly
    changes, however far along. Only where each side has one of its own."""
    x, t = s.recording.positions, s.recording.times
    apart = spacing(s.apart[np.ix_(own, own)])
    center = np.nanmean(x[:, own], axis=(0, 1))
    found = dict[str, list[tuple[float, float, int]]]()
    for side in sides:
        row = row_of(flat, side, apart)
        seen = x[:, [own[k] for k in row]]
        if len(row) < 2 or _sags(x, [own[k] for k in row]):
            continue
        axis, sign = SIDES[side]
        inset = float(np.max(sign * flat[:, axis]) - np.mean(sign * flat[row, axis]))
        least = LOOSE
        for k in others:
            direction = np.array(bars.get(k, _direction(x, [own[j] for j in row])))
            off = x[:, k] - seen.mean(axis=1)
            along = off @ direction
            distance = np.linalg.norm(off - along[:, None] * direction, axis=1)
            far = float(np.nanmean(distance))
            varies = float(np.nanstd(distance)) / max(far, apart)
            outside = float(np.nanmean(off, axis=0) @ (np.nanmean(seen, axis=(0, 1)) - center)) > 0
            if outside and far <= REACHES * apart and varies < least:
                least = varies
                first = distance[t <= t[0] + s.rest]
                beyond = float(np.nanmean(first if np.isfinite(first).any() else distance)) - inset
                found[side] = [(float(flat[:, 1 - axis].mean() + np.nanmean(along)), beyond, k)]
    whole = len(found) == len(sides) == len({near[0][2] for near in found.values()})
    return found if whole else {}


def _direction(x: Array, row: list[int]) -> Array:
    """(3,) unit direction of a row of markers, on average."""
    ends = np.nanmean(x[:, row[-1]] - x[:, row[0]], axis=0)
    return np.asarray(ends / np.linalg.norm(ends))


def motion(x: Array) -> float:
    """m, root mean square distance of markers (frames, k, 3) from their mean places."""
    if len(x) < 2:
        return 0.0
    return float(np.sqrt(np.nanmean(np.nanvar(x, axis=0).sum(axis=1))))


def _place(s: Seen, own: list[int], flat: Array, k: int, apart: float) -> Array | None:
    """(2,) m, where another marker is beside the flat cloth, as the markers next to it lie; None where it is far from
    them or moves against them."""
    x = s.recording.positions
    beside = np.isfinite(x[:, own, 0]) & np.isfinite(x[:, k, :1])
    frame = int(np.argmax(beside.sum(axis=1)))  # the first with the most of them
    seen = np.flatnonzero(beside[frame])
    if len(seen) < AROUND:
        return None
    distance = np.linalg.norm(x[frame, own] - x[frame, k], axis=1)
    near = seen[np.argsort(distance[seen])[:AROUND]]
    nearest = float(distance[near[0]])
    varies = float(np.nanstd(np.linalg.norm(x[:, own[near[0]]] - x[:, k], axis=1)))
    if nearest > REACHES * apart or varies > LOOSE * max(nearest, apart):
        return None
    axes, mean, center = laid(flat[near], x[frame, own][near])
    return np.asarray(mean + axes @ (x[frame, k] - center))


def _side(flat: Array, at: Array, sides: Sequence[str]) -> tuple[str, float]:
    """The side of the markers' box that a place is beyond, and by how much, m; negative inside of it."""
    off = _off(flat, at)
    side = max([side for side in sides if off[side] > 0] or off, key=lambda side: off[side])
    return side, off[side]


def _one_side(flat: Array, places: Sequence[Array]) -> tuple[str, ...]:
    """The side that all of several places are beyond, about as far as beyond any other: two at the corners of a flag's
    pole hold one side of it, not two."""
    off = [_off(flat, at) for at in places]
    every = [side for side in SIDES if all(here[side] > CORNER * max(here.values()) > 0.0 for here in off)]
    return (max(every, key=lambda side: min(here[side] for here in off)),) if len(places) > 1 and every else ()


def _off(flat: Array, at: Array) -> dict[str, float]:
    """m, by which a place is beyond each side of the markers' box; negative inside of it."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    return {side: float(at[a] - high[a] if sign > 0 else low[a] - at[a]) for side, (a, sign) in SIDES.items()}


def _sags(x: Array, row: list[int]) -> bool:
    """Whether a row of markers (k,) hangs below the line between its ends."""
    if len(row) < 3:
        return False
    line = x[:, row]
    ends = line[:, -1] - line[:, 0]
    size = np.linalg.norm(ends, axis=1)
    share = np.einsum("fkx,fx->fk", line - line[:, :1], ends) / size[:, None] ** 2
    off = np.nanmean(line - line[:, :1] - share[..., None] * ends[:, None], axis=0)
    return bool(np.linalg.norm(off, axis=1).max() > SAGS * np.nanmean(size))


def _corners(s: Seen, row: Sequence[int]) -> tuple[int, ...]:
    """The ends of a row that sags between them; the upper one alone where the row hangs down from it to its other
    end."""
    height = np.nanmean(s.recording.positions[:, list(row)], axis=0) @ (-s.gravity / np.linalg.norm(s.gravity))
    for upper, along in ((row[0], height), (row[-1], height[::-1])):
        if along[0] - along[-1] > HANGS * s.apart[row[0], row[-1]] and (along[:-1] > along[-1]).all():
            return (upper,)
    return (row[0], row[-1])


def _without_gaps(s: Seen, row: Sequence[int]) -> list[int]:
    """Markers of a row that are never lost for long; all of them where there is none."""
    r, gap = s.recording, default_max_gap(s.recording.times)
    kept = []
    for k in row:
        t = r.times[r.mask[:, k]]
        if r.mask[0, k] and r.mask[-1, k] and np.diff(t).max() <= gap:
            kept.append(k)
    return kept or list(row)
