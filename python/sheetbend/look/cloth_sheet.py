"""A cloth as its markers show it: how it lies on the flat fabric, what holds it, and how far it goes on beyond them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays.types import Array
from ..errors import RecordingError
from . import robot
from .cloth_held import SAGS, SIDES, Hold, holds, row_of, share, slung
from .lattice import in_rows
from .margin import margin, pitches
from .seen import Seen
from .sheet import flattened, placed, spacing
from .slung import Slack, slack
from .take import Measured
from .text import joined

ASKEW = 0.15  # slope at which a cloth hangs that a wind blows on
AIR = 0.7  # kg/m^3, of a plate across the wind: half the density of air times a drag coefficient of 1.2
PLANE = 1.5  # times the noise, by which markers are off a plane at most that a cloth starts in


@dataclass(frozen=True)
class Sheet:
    """A cloth as its markers show it.

    Attributes:
        name: of the cloth in the configuration.
        own: its markers.
        flat: (markers, 2) m, where they lie on the fabric.
        width, height: m.
        low: (2,) m, from the left and lower edge to the outer markers.
        origin, axes: (3,) m and (2, 3), where the fabric lies best.
        held: what holds it.
        static: whether it hangs at rest in all frames.
        slung: whether it lies between two sides that are held, its x axis from one to the other.
        starts_flat: whether it lies flat in the first frame: a shape through its noisy markers would have wrinkles.
        slack: what it is without tension, where its motion shows it.
        wind: (3,) m/s, a guess, where the cloth hangs askew and hardly moves; None elsewhere.
        margin: m, on the left, right, lower and upper side, by which it goes on beyond that, as was measured.
        ride: how its upper edge rides on a tool, or its upper row where nothing tells where that edge is.
    """

    name: str
    own: list[int]
    flat: Array
    width: float
    height: float
    low: Array
    origin: Array
    axes: Array
    held: list[Hold]
    static: bool
    slung: bool
    starts_flat: bool
    slack: Slack | None
    wind: Array | None
    margin: tuple[float, ...] | None = None
    ride: robot.Riding | None = None

    @property
    def tension(self) -> tuple[str, ...]:
        """Its stiffnesses in tension that its recording shows. Kept at a guess they draw the others off: the wind of
        experiments/cloth_in_wind from 3 to 9 mm, and a cloth in two clips falls by 5 mm in its first 50 ms."""
        at_corners = not self.static and any(hold.corners for hold in self.held)
        return ("warp",) if self.slung else ("warp", "shear") if self.wind is not None or at_corners else ()

    @property
    def sizes(self) -> tuple[str, ...]:
        """Those of the flat fabric that its tension depends on: of what the markers show it is stretched there."""
        return ("warp_size", "weft_size")[: len(self.tension)]


def sheet_of(
    s: Seen,
    name: str,
    own: list[int],
    others: Sequence[int],
    density: float,
    bars: Mapping[int, tuple[float, ...]],
    measured: Measured,
) -> Sheet | None:
    """A cloth; None where something lies under it. Bars point where its rows beside them do, if not given."""
    up = -s.gravity / np.linalg.norm(s.gravity)
    laid = _laid(s, own, up)
    if laid is None:
        return None
    flat, apart = laid.flat, spacing(s.apart[np.ix_(own, own)])
    found = slack(s, own, flat, apart) if laid.slung else None
    if found is not None:
        flat = flat * [found.length / np.ptp(flat[:, 0]), 1.0]
    held = holds(s, own, flat, others, ("left", "right") if laid.slung else ("top",), bars)
    ride = None
    if measured.poses is not None:
        hold, ride = _on_tool(s, own, flat, held, measured.poses)
        held = [hold]
    low, high, margins = _beyond_markers(flat, held, found, measured.margin)
    width, height = (np.ptp(flat, axis=0) + low + high).tolist()
    rests = not any(hold.moves for hold in held) and not laid.slung
    wind = None
    if rests and not s.static:
        wind = _wind(s, own, [own[k] for k in row_of(flat, held[0].side, apart)], up, density)
    origin = laid.place - laid.axes.T @ low
    for edge in (hold.edge for hold in held if ride is None and not laid.slung):
        if edge is not None:  # all frames show an edge at rest
            origin = np.nanmean(edge.points, axis=(0, 1)) - laid.axes.T @ [edge.along.mean() + low[0], height]
    return Sheet(
        name=name,
        own=own,
        flat=flat + low,
        width=width,
        height=height,
        low=low,
        origin=origin,
        axes=laid.axes,
        held=held,
        static=s.static,
        slung=laid.slung,
        starts_flat=rests and not s.static and _lies_flat(s, own),  # a grip starts where its markers are
        slack=found,
        wind=wind,
        margin=margins,
        ride=ride,
    )


class Laid(NamedTuple):
    """Markers on the flat fabric, and where the fabric is at the first frame that shows most of them."""

    flat: Array  # (markers, 2) m; of a slung cloth x runs from one held side to the other
    place: Array  # (3,) m, of the flat zero
    axes: Array  # (2, 3), directions of the flat axes
    slung: bool


def _laid(s: Seen, own: list[int], up: Array) -> Laid | None:
    """How a cloth's markers lie on the flat fabric; None where something lies under it."""
    apart = s.apart[np.ix_(own, own)]
    flat = flattened(apart)
    rows = in_rows(apart, flat)
    start = int(np.argmax(s.recording.mask[:, own].sum(axis=1)))
    place, axes, flat = placed(flat if rows is None else rows, s.recording.positions[start, own], up)
    axis, rise = slung(s.recording.positions[:, own], flat, up, spacing(apart))
    if rise < -SAGS:
        return None
    if rise > SAGS and axis == 1:
        place = place + axes[0] * np.ptp(flat[:, 0])
        flat = np.stack([flat[:, 1], np.ptp(flat[:, 0]) - flat[:, 0]], axis=1)
        axes = np.stack([axes[1], -axes[0]])
    return Laid(flat, place, axes, rise > SAGS)


def _on_tool(s: Seen, own: list[int], flat: Array, held: list[Hold], poses: robot.Poses) -> tuple[Hold, robot.Riding]:
    """How a tool holds the upper edge of a cloth whose own upper row shows it, and what rides on it: the edge itself,
    where the motion of the rows tells where it is, else the upper row."""
    hold, *more = held
    if more or not hold.own or hold.corners or not hold.moves:
        names = [s.recording.markers[k] for h in held for k in h.markers]
        fix = "leave out the poses, or write the configuration by hand, as in docs/configuration.md"
        raise RecordingError("poses", "go with a cloth whose whole upper edge moves", joined(names), fix)
    x, t = s.recording.positions, s.recording.times
    row = list(hold.markers)
    ride = robot.riding(x[:, row], t, poses)
    told = margin(x[:, own], flat, *SIDES[hold.side], lambda edge: robot.off_near(edge, t, poses, ride.shift))
    if told.edge is not None:
        ride = robot.riding(told.edge.points, t, poses)
    return replace(hold, tool=robot.TOOL, beyond=told.length, margin=told), ride


def _beyond_markers(
    flat: Array, held: Sequence[Hold], found: Slack | None, given: float | None
) -> tuple[Array, Array, tuple[float, ...] | None]:
    """(2,) m of fabric beyond the markers at the lower and at the upper end of each axis, and the margins that were
    given, by side: beyond all outer rows but those beside an edge that is known."""
    beyond = {hold.side: hold.beyond for hold in held}
    if found is not None:  # the cloth is stretched there too
        beyond |= {side: beyond[side] * found.length / found.first for side in ("left", "right") if side in beyond}
    free, margins = share(held) * pitches(flat), None
    if given is not None:
        shown = {h.side for h in held if h.edge is not None or not h.own or (h.moves and not h.corners)}
        margins, free = tuple(0.0 if side in shown else given for side in SIDES), 0.0 * free
        beyond = {side: off for side, off in beyond.items() if side in shown}
    low, high = (
        np.array([beyond.get(side, free[SIDES[side][0]]) for side in sides])
        for sides in (("left", "bottom"), ("right", "top"))
    )
    return low, high, margins


def _wind(s: Seen, own: list[int], row: list[int], up: Array, density: float) -> Array | None:
    """m/s, of a wind that balances the weight of a cloth that leans by as much on average, about half of the time."""
    x = s.recording.positions[len(s.recording.times) // 2 :]
    lean = np.nanmean(x[:, own], axis=(0, 1)) - np.nanmean(x[:, row], axis=(0, 1))
    drop = float(-lean @ up)
    across = lean + drop * up
    slope = float(np.linalg.norm(across)) / max(drop, 1e-9)
    if drop <= 0 or slope < ASKEW:
        return None
    speed = np.sqrt(density * float(np.linalg.norm(s.gravity)) * slope / AIR)
    return np.asarray(speed * across / np.linalg.norm(across))


def _lies_flat(s: Seen, own: list[int]) -> bool:
    """Whether markers lie in a plane in the first frame, but for their noise."""
    x = s.recording.positions[0, own]
    x = x[np.isfinite(x[:, 0])]
    if len(x) < 4:
        return False
    off = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[2] / np.sqrt(len(x) - 3)
    return bool(off < max(PLANE * s.noise, 1e-3 * np.linalg.norm(np.ptp(x, axis=0))))
