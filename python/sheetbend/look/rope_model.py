"""The model of a rope in a draft: its length and density, how it is held, and how its motion begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..arrays.timeseries import mean_position
from ..errors import RecordingError
from .beginning import lets_go
from .end_load import free_end, loaded_end
from .held import Held
from .line import plane, snapped
from .lying import Table
from .marked import Marked
from .seen import Seen
from .stretching import Stretch, stretching
from .take import Measured, Take

FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most; the next third is predicted
ROUND = 0.75  # GJ/EI of a round solid section with a Poisson ratio of 1/3
LEAST_SIGMA = 1e-4  # m, of the markers of a motion: a model misses by as much
UNSEEN = 30.0  # by which factor a mass may be off that nothing but the stretch of a rope tells of
NUMBERS = 1500  # of a hand's motion, three for every fitted frame: so many are estimated in minutes


class Known(NamedTuple):
    """A number that a motion does not show: its value, whether it was measured, and a sentence about it."""

    value: float
    measured: bool
    said: str


class Load(NamedTuple):
    """A mass at the end `at` of a rope, kg, and in masses of 1 m of it; whether it was weighed, and by which factor it
    may be off where it was not."""

    at: str
    mass: float
    meters: float
    weighed: bool = False
    within: float = 5.0


class Start(NamedTuple):
    """How the rope begins: keys of its section, and sentences about it."""

    keys: dict[str, Any]
    said: list[str]


@dataclass(frozen=True)
class RopeModel:
    """The model of a rope in recordings.

    Attributes:
        marked: the recordings, with the markers on the rope and what holds it in each.
        markers: names of the rope's markers in the first one, in order.
        length: m.
        density: kg/m.
        flat: the normal of the plane that a shape at rest is in.
        in_space: whether a motion leaves every plane.
        rod: whether it is a rod, which knows twist, and not a rope.
        start: how it begins.
        estimated: whether the fit estimates the true motion of what moves it.
        load: at its free end.
        weighed: whether it was told what hangs there, if only nothing.
        table: that it lies on.
        stretch: how much it stretches, where that is seen.
    """

    marked: Sequence[Marked]
    markers: Sequence[str]
    length: Known
    density: Known
    flat: list[float] | None
    in_space: bool
    rod: bool
    start: Start
    estimated: bool
    load: Load | None
    weighed: bool
    table: Table | None = None
    stretch: Stretch | None = None

    @property
    def hangs_unknown(self) -> bool:
        """Whether nothing tells if a mass hangs at its free end: a stiff rope's motion alone does not."""
        hangs = not self.seen.static and self.table is None and free_end(self.held) is not None
        return hangs and not self.weighed and self.load is None

    @property
    def seen(self) -> Seen:
        """The first recording."""
        return self.marked[0].take.seen

    @property
    def held(self) -> Held:
        """What holds the rope in the first recording."""
        return self.marked[0].held

    @property
    def kind(self) -> str:
        """The section that describes it."""
        return "rod" if self.rod else "rope"

    @property
    def keeps_roll(self) -> bool:
        """Whether it turns freely, but is taken not to spin about its own axis."""
        return self.rod and turns_freely(self.held) and not self.held.rope.get("pinned")


def model_of(
    marked: Sequence[Marked], order: tuple[int, ...], measured: Measured, pushed: str | None, table: Table | None
) -> RopeModel:
    """The model of a rope.

    Args:
        marked: its recordings.
        order: its markers in the first one, those that hold it too.
        measured: beside the recordings.
        pushed: what is said of how it begins, where something pushed it.
        table: that it lies on.
    """
    takes, found = [own.take for own in marked], marked[0].held
    s = takes[0].seen
    stretch = None if table is not None or free_end(found) is None else stretching(s, found.order)
    if stretch is not None:
        marked = [_unloaded(own, stretch) for own in marked]
    length = _length(s, max(marked, key=lambda own: float(own.arcs[-1])), measured, stretch)
    density = _density(s, measured)
    normal = plane(s.recording.positions[:, list(order)], length.value)
    in_space = not s.static and table is None and normal is None and "plane" not in found.rope
    load = _load(s, found, density.value, measured.weight, lies=table is not None)
    if load is None and stretch is not None and measured.weight is None:
        load = _stretching_load(found, density.value, length.value)
    rod = in_space and stretch is None and _can_be_rod(s, found)
    stretches = stretch is not None
    start = (
        Start({"points": "recording"}, [])
        if s.static
        else _laid(s, found)
        if table
        else _start(s, found, rod, stretches)
    )
    return RopeModel(
        marked,
        [s.recording.markers[k] for k in order],
        length,
        density,
        flat=normal if s.static else None,
        in_space=in_space,
        rod=rod,
        start=start if pushed is None else start._replace(said=[pushed]),
        estimated=rod and _estimates_hand(takes, found),
        load=load,
        weighed=measured.weight is not None,
        table=table,
        stretch=stretch,
    )


def _unloaded(own: Marked, first: Stretch) -> Marked:
    """The markers of a recording where they are along a rope that stretches when it is shortest."""
    here = stretching(own.take.seen, own.held.order)
    arcs = own.arcs / (1.0 + first.by) if here is None else own.arcs[0] + here.arcs
    return replace(own, arcs=arcs)


def _load(s: Seen, found: Held, density: float, weight: float | None, lies: bool) -> Load | None:
    """What hangs at the free end: as weighed, or as the motion of a rope in the air shows it."""
    if weight is not None:
        at = free_end(found)
        if at is None:
            raise RecordingError("weight", "hangs at a free end, and both ends are held", weight, "leave it out")
        return Load(at, weight, weight / density, weighed=True) if weight else None
    load = None if s.static or lies else loaded_end(s, found)
    return None if load is None else Load(load[0], load[1] * density, load[1])


def _stretching_load(found: Held, density: float, length: float) -> Load | None:
    """What likely stretches a rope with a free end: a mass there, to begin with three times that of the rope."""
    at, meters = free_end(found), 3.0 * length
    return None if at is None else Load(at, meters * density, meters, within=UNSEEN)


def _length(s: Seen, longest: Marked, measured: Measured, stretch: Stretch | None) -> Known:
    """m, from what was measured, what the file tells, or the distances between markers."""
    last = float(longest.arcs[-1])
    if measured.length is not None:
        if measured.length < 0.8 * last:
            problem = f"is shorter than the {last:.4g} m from the first to the last marker"
            raise RecordingError("length", problem, measured.length, "give the length of the whole rope in m")
        said = "where the markers are along the rope: the first one is taken to be at its start"
        return Known(measured.length, True, said)
    told = s.recording.metadata.get("length_m")
    if isinstance(told, int | float) and told >= 0.8 * last:
        return Known(float(told), True, "whether the length that the file tells runs from the first to the last marker")
    markers, order = longest.take.seen.recording.markers, longest.held.order
    a, b = markers[order[0]], markers[order[-1]]
    sum_of = f"the length: the sum of the distances from {a} to {b}"
    if s.static:
        return Known(last, False, f"{sum_of}, to 1 %. Measure it, and give --length")
    if stretch is not None:
        said = (
            f"the length without load: from {a} to {b} it is {100.0 * stretch.by:.2g} % more at times. The "
            "shortest one is taken, and fitted too. Measure it, and give --length"
        )
        return Known(last, False, said)
    said = (
        f"{sum_of}, which noise makes too long and bends make too short. "
        "It is fitted too. The rope beyond these markers is not seen: the model ends there. Measure it, and give "
        "--length"
    )
    return Known(last + longest.held.leads.get("end", 0.0), False, said)


def _density(s: Seen, measured: Measured) -> Known:
    """kg/m, from what was measured or what the file tells; else 1."""
    told = s.recording.metadata.get("linear_density_kg_per_m")
    if measured.density is not None:
        said = "the mass of the markers: weigh the rope with them, or add them as [[scene.point_mass]]"
        return Known(measured.density, True, said)
    if isinstance(told, int | float):
        return Known(float(told), False, "the mass of the markers; the density is the file's")
    said = (
        "the density: the motion shows only the ratios of stiffness and drag to it. It is set to 1 kg/m, so rope_EI is "
        "EI/density in m^4/s^2. Weigh the rope and give --density"
    )
    return Known(1.0, False, said)


def _can_be_rod(s: Seen, found: Held) -> bool:
    """Whether a rod can be held like this. One that turns freely has no single rest, since it may also turn about its
    own axis; so it must hang straight there, from its start."""
    if found.leads:
        return False
    from_start = [grip["at"] for grip in found.grips] == ["start"] and not found.rope.get("pinned")
    return not (s.rest and turns_freely(found)) or (from_start and _straight(s, found.order) is not None)


def turns_freely(found: Held) -> bool:
    """Whether nothing holds a direction of the rope."""
    clamped = "clamp_start" in found.rope or "clamp_end" in found.rope
    return not clamped and all(len(grip["markers"]) == 1 and "direction" not in grip for grip in found.grips)


def _start(s: Seen, found: Held, rod: bool, stretches: bool) -> Start:
    """How a motion begins: that of a rope that stretches through its markers, since a straight one has no load."""
    as_recorded = {"points": "recording"}
    if s.rest and not (rod and turns_freely(found)):
        return Start(as_recorded, [f"it rests for the first {s.rest:.2g} s"])
    way = None if stretches else _straight(s, found.order)
    if s.rest:
        return Start({"direction": way}, [f"it hangs straight and rests for the first {s.rest:.2g} s"])
    if not lets_go(s, found.order):
        said = ["it moves at the first frame: place and speed at the start are those of the markers"]
        return Start(as_recorded | {"velocity": "recording"}, said)
    said = ["at the first frame it moves no faster than its noise: it starts from rest"]
    if way is None:
        return Start(as_recorded, said)
    first = mean_position(s.recording.positions)[found.order[0]].tolist()
    said.append("at the first frame it is straight within its noise")
    return Start({"start": first, "direction": way}, said)


def _laid(s: Seen, found: Held) -> Start:
    """How the motion of a rope on a table begins. Friction keeps what noise adds to its shape, so places at rest are
    averaged."""
    if not s.rest:
        said = ["it moves at the first frame: place and speed at the start are those of the markers"]
        return Start({"points": "recording", "velocity": "recording"}, said)
    rests, way = f"it rests for the first {s.rest:.2g} s", _straight(s, found.order)
    if way is not None:
        return Start({"direction": way}, [f"{rests}, straight"])
    return Start({"points": "recording", "velocity": "recording", "smoothing": round(s.rest, 4)}, [rests])


def _straight(s: Seen, order: tuple[int, ...]) -> list[float] | None:
    """The direction from the first marker along a rope that is straight, within its noise, while it rests; or at the
    first frame, if the first marker stays in place."""
    r = s.recording
    if not s.rest and order[0] not in s.still:
        return None
    first = mean_position(r.positions)[order[0]]
    x = r.positions[0, list(order)]
    if s.rest:
        x = mean_position(r.positions[r.times < r.times[0] + s.rest])[list(order)]
        first = x[0]
    if np.isnan(x).any():
        return None
    off = x - first
    way = np.linalg.svd(off, full_matrices=False)[2][0]
    way *= np.sign(way @ off[-1])
    return snapped(way) if np.abs(off - np.outer(off @ way, way)).max() < 4.0 * s.noise else None


def _estimates_hand(takes: Sequence[Take], found: Held) -> bool:
    """Whether the fit is to estimate the true motion of what moves the rope, from one marker at each end: where the
    noise of the markers is what the fit will leave, and where that takes minutes."""
    markers = [name for grip in found.grips for name in grip["markers"]]
    frames = sum(int(np.sum(take.seen.recording.times < last_fitted(take))) for take in takes)
    noisy = all(take.seen.noise > LEAST_SIGMA for take in takes)
    return noisy and bool(markers) and markers == found.alone and 3 * len(markers) * frames <= NUMBERS


def last_fitted(take: Take) -> float:
    """The end of the part of a motion that is fitted, s."""
    s, times = take.seen, take.seen.recording.times
    start, stop = float(times[0]), float(times[-1])
    return round(start + s.rest + min(FITTED * (stop - start - s.rest), LONGEST), 4)
