"""A beam in a recording of one marker that moves along one coordinate, as a laser on the beam reads.

The beam itself is not seen. Its free length and the place of the marker must be given. The frequency tells EI over the
density, as in `cantilever`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import timeseries
from ..arrays.types import Array
from ..errors import RecordingError
from ..recording.oscillation import first_frequency
from .cantilever import let_go, model, turning
from .seen import Seen
from .take import Description, Measured, Take
from .text import table

STRAIGHT = 0.02  # of the motion along one coordinate: how much a marker that one sensor sees moves along the others
FEWEST, FITTED, PREDICTED = 5.0, 10.0, 20.0  # periods
SHARE = 2 / 3  # of a short recording that is fitted
STILL, GONE = 0.02, 0.2  # of the largest deflection: by how much a beam has moved just after its release
HELD = 0.3  # of the largest deflection: how far a beam at rest is bent at least that something holds
FINEST = 2e-3  # of the amplitude: the least sigma, of what a uniform beam misses


class Swing(NamedTuple):
    """What the marker and a ruler show.

    Attributes:
        axis, way: 0, 1 or 2, along which the marker moves, and along which the beam is taken to point.
        start: s, of the motion; at the release if `held`, else at a turning point.
        frequency: Hz.
        length, at: m, of the beam, and from its clamp to the marker.
        rest, load: m, the coordinate of the marker about which it swings, and how far from it the marker starts.
    """

    axis: int
    way: int
    start: float
    held: bool
    frequency: float
    length: float
    at: float
    rest: float
    load: float


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A clamped beam that swings along one coordinate of its only marker; None for other recordings."""
    s = takes[0].seen
    r = s.recording
    axis = _axis(s)
    if len(takes) > 1 or axis is None:
        return None
    if not r.mask.all():
        got = "; ".join([f"{np.count_nonzero(~r.mask)} of {len(r.times)} frames", *r.mends])
        fix = "leave these frames out of the file; the others keep their times"
        raise RecordingError("markers", "are lost in some frames of a beam that one marker shows", got, fix)
    swing = r.positions[:, 0, axis] - np.median(r.positions[len(r.times) // 2 :, 0, axis])
    start, held = _start(s, swing)
    free = r.times >= start
    frequency = first_frequency(r.times[free], swing[free])
    if frequency is None or start + FEWEST / frequency > r.times[-1]:
        return None
    length, at = _given(measured)
    late = free & (r.times > 0.5 * (start + r.times[-1]))
    rest = float(r.positions[late, 0, axis].mean())
    load = float(r.positions[np.flatnonzero(free)[0], 0, axis]) - rest
    way = _across(s, axis)
    beam = Swing(axis, way, start, held, frequency, length, at, rest, load)
    notes = [
        f"{r.markers[0]} moves along {'xyz'[axis]} alone and swings at {frequency:.4g} Hz, from "
        f"{'its release' if held else 'a turning point'} at {start:.4g} s on: a beam that is clamped at one end, seen "
        f"{1e3 * at:.4g} mm from its clamp"
    ]
    unknown = [
        f"which way the beam points: along {'xyz'[way]} is taken. Only how it lies to gravity counts, so change "
        "`direction`, `clamp_start` and `plane` if the beam hangs down or stands up",
        f"the beam itself: its length, {1e3 * length:.4g} mm, and the place of the marker are taken as given. EI goes "
        "with the fourth power of the length",
        "where the sensor reads zero: fitted as `zero`, so the sag by the weight is not used",
        "what bent the beam before it was let go: a force at its end is fitted, and other shapes at the start are not",
        "the mass of anything at its end, and"
        + (
            " the density: it is 1 kg/m here, and EI is EI/density"
            if measured.density is None
            else " how uniform the beam is"
        ),
    ]
    return Description("a beam clamped at one end, seen at one point", notes, unknown, _lines(takes[0], measured, beam))


def _axis(s: Seen) -> int | None:
    """The coordinate along which the only marker moves; None where there are more markers, or it moves along others."""
    if len(s.recording.markers) != 1 or s.static:
        return None
    moved = np.nanstd(s.recording.positions[:, 0], axis=0)
    *others, axis = np.argsort(moved)
    return int(axis) if moved[axis] > 0 and moved[others].max() <= STRAIGHT * moved[axis] + s.noise else None


def _start(s: Seen, swing: Array) -> tuple[float, bool]:
    """s, when the beam is at rest and bent, and whether something holds it until then. A release is better than a
    turning point: what bent the beam also tells how much of its higher modes swings."""
    times, most = s.recording.times, float(np.abs(swing).max())
    bent = float(np.median(swing[times <= times[0] + s.rest]))
    if not s.rest or abs(bent) < HELD * most:
        return turning(times, swing), False
    off = np.sqrt(np.abs(swing - bent) / most)  # grows like the time after the release
    gone = int(np.argmax(off > np.sqrt(GONE)))
    still = int(np.flatnonzero(off[:gone] < np.sqrt(STILL))[-1])
    slope, at_zero = (
        np.polyfit(times[still + 1 : gone + 1], off[still + 1 : gone + 1], 1) if gone > still + 1 else (0, 0)
    )
    release = -at_zero / slope if slope > 0 else times[still]
    return float(np.clip(release, times[still - 1] if still else times[0], times[still + 1])), True


def _given(measured: Measured) -> tuple[float, float]:
    """m, of the beam and from its clamp to the marker."""
    if measured.length is None:
        fix = (
            "give the free length of the beam, from the clamp to its end in m, and with --at where the marker is. If "
            "it is the bob of a pendulum, give its pivot too, as a marker that stays"
        )
        raise RecordingError("length", "is needed of a beam that one marker shows", None, fix)
    if measured.at is None:
        fix = "give how far the marker or the laser's spot is from the clamp along the beam, in m"
        raise RecordingError("at", "is needed of a beam that one marker shows", None, fix)
    if measured.at > measured.length:
        fix = f"give at most the length, {measured.length:g} m: both count from the clamp"
        raise RecordingError("at", "is beyond the end of the beam", measured.at, fix)
    return measured.length, measured.at


def _across(s: Seen, axis: int) -> int:
    """An axis that is across the motion, and level where one is."""
    return next(k for k in (0, 1, 2) if k not in (axis, s.up))


def _lines(take: Take, measured: Measured, beam: Swing) -> list[str]:
    r, axis, start, frequency, length = take.seen.recording, beam.axis, beam.start, beam.frequency, beam.length
    direction, out = np.eye(3)[beam.way], np.eye(3)[axis]
    normal = np.cross(out, direction)  # so that direction x normal = out
    clamp = r.positions[:, 0].mean(axis=0) - beam.at * direction
    clamp[axis] = beam.rest
    own = {"plane": normal.tolist()}
    EI, lines = model(take, measured, frequency, length, clamp, direction, 12, 100, own)
    step = take.step
    there = (3.0 * length * beam.at**2 - beam.at**3) / (2.0 * length**3)  # of the end's deflection, under a force there
    lines += let_go((3.0 * EI / length**3 * beam.load / there * out).tolist())
    lines += table("[scene.quantities.zero]", {"scale": 1e-3}, {"scale": "m, of the sensor's zero"})
    if beam.held:
        lines += table("[scene.quantities.clock]", {"unit": "s", "scale": step}, {"unit": "of when it is let go"})
    last = start + min(FITTED / frequency, SHARE * (float(r.times[-1]) - start))
    entries: dict[str, Any] = {**take.reading, "start": "equilibrium", "start_time": start}
    entries |= {"time_offset": "clock", "fit": [start + 2.0 * step, last]} if beam.held else {"fit": [start, last]}
    entries |= {"held_out": [last, min(last + PREDICTED / frequency, float(r.times[-1]) - 3.0 * step)]}
    noise = float(np.nan_to_num(timeseries.noise(r.times, r.positions[..., [axis]])[0]))  # the others may have none
    entries |= {"sigma": max(noise, FINEST * abs(beam.load)), "axes": "xyz"[axis]}
    entries |= {
        "offsets": {r.markers[0]: ["", "", "zero"]},
        "marker": [{"marker": r.markers[0], "arc_length": beam.at}],
    }
    lines += table("[[recording]]", entries)
    for fitted in ("beam_EI", "beam_loss_factor", f"pull_{'xyz'[axis]}", "zero"):
        lines += table(f"[parameters.{fitted}]", {})
    if beam.held:
        lines += table("[parameters.clock]", {"prior": [0.0, step]}, {"prior": "mean and sd, s"})
    return lines
