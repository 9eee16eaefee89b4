"""A beam in a recording: one body that stays and one that swings, with nothing seen between them.

The frequency f of a uniform beam tells EI/density (Rayleigh: omega = 1.8751^2 sqrt(EI/(density L^4))), and with it how
far gravity bends it: by 12.36 g/(8 omega^2) at its end, which turns by 12.36 g/(6 omega^2 L). So the direction of the
clamp follows from where the end rests.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.rigid import rigid_motion
from ..arrays.timeseries import default_max_gap, interpolate, mean_position
from ..arrays.types import Array
from ..recording.oscillation import along, dominant_direction, first_frequency
from .line import snapped
from .seen import Seen
from .take import Description, Measured, Take
from .text import joined, table

FIRST_MODE = 1.8751**4
FITTED, PREDICTED = 3.0, 8.0  # periods
SWINGS = 0.02  # of all its motion: so much of it follows the first turning point of a beam; of a door that closes, none
AT_REST = 0.05  # of the first amplitude: how little the end moves in the last fifth, to count as a shape at rest
LENGTH_SD = 0.05  # relative, of a length between the middles of two groups of markers
LOSS = 0.1


@dataclass(frozen=True)
class Beam:
    """What a recording of a beam shows.

    Attributes:
        start, resting: s, of the first turning point, and from which time on it counts as at rest (or None).
        frequency: Hz.
        clamp, end: (3,) m.
        length: m.
        normal: (3,) of the plane in which it swings.
        way, tip: (3,) unit directions at the clamp and at the end at rest.
        offsets: (markers, 3) m from the end, along the beam, across, and in the plane.
        load: (3,) m, how far the end is from its rest at the start.
    """

    start: float
    resting: float | None
    frequency: float
    clamp: Array
    end: Array
    length: float
    normal: Array
    way: Array
    tip: Array
    offsets: Array
    load: Array


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A beam that is clamped at a group of markers and seen at its other end; None for other recordings."""
    s = takes[0].seen
    r = s.recording
    if len(takes) > 1 or len(s.bodies) != 1:
        return None
    tip = s.bodies[0]
    base = tuple(sorted({*s.still, *(k for k in s.loose if k in r.clamped)}))
    if len(base) < 2 or len(base) + len(tip) < len(r.markers):
        return None
    beam = _beam_of(s, base, tip, measured.length)
    if beam is None:
        return None
    notes = [
        f"{joined(r.markers[k] for k in base)} stay in place, {joined(r.markers[k] for k in tip)} move as one body",
        f"they swing at {beam.frequency:.4g} Hz, from a turning point at {beam.start:.4g} s",
    ]
    unknown = [
        "where the clamp is: below the middle of the markers that stay"
        + (
            ""
            if measured.length is not None
            else ", and the end at the middle of those that move. The length between "
            "them is uncertain by 5 %, and EI goes with its fourth power: measure it, and give --length"
        ),
        "the direction of the clamp, and how high the end is: both are fitted",
        "what bent the beam before it was let go: a force at its end is fitted",
        "what else moves with the end, and"
        + (
            " the density: it is 1 kg/m here, and EI is EI/density"
            if measured.density is None
            else " the markers' mass"
        ),
    ]
    return Description("a beam clamped at one end", notes, unknown, _lines(takes[0], tip, beam, measured))


def _beam_of(s: Seen, base: tuple[int, ...], tip: tuple[int, ...], length: float | None) -> Beam | None:
    x, t = s.recording.positions, s.recording.times
    x = interpolate(t, x, t, "cubic", default_max_gap(t))
    whole = np.isfinite(x[:, list(tip), 0]).all(axis=1)
    if not whole.any():
        return None
    x, t = x[whole], t[whole]
    swing = along(x[:, list(tip)], dominant_direction(x[:, list(tip)]))
    start = turning(t, swing)
    free = t >= start  # before it the beam is held, and a step hides the frequency
    frequency = first_frequency(t[free], swing[free])
    last = float(t[-1])
    if frequency is None or start + (FITTED + 1) / frequency > last or np.ptp(swing[free]) < SWINGS * np.ptp(swing):
        return None
    late = t > max(start, last - max(2.0 / frequency, 0.2 * (last - start)))
    rest = mean_position(x[late])[list(tip)]
    end, clamp = rest.mean(axis=0), np.nanmean(mean_position(x)[list(base)], axis=0)
    turns, _, _ = rigid_motion(np.concatenate([rest[None], x[free][:, list(tip)]]))
    axes = np.stack([turns[:, a, b] - turns[:, b, a] for a, b in ((2, 1), (0, 2), (1, 0))], axis=1)
    up = -s.gravity / np.linalg.norm(s.gravity)
    normal = np.linalg.svd(axes, full_matrices=False)[2][0]
    normal = np.array(snapped(normal * np.sign(normal @ np.cross(up, end - clamp) or 1.0)))
    normal /= np.linalg.norm(normal)
    clamp = clamp + normal * ((end - clamp) @ normal)
    chord = (end - clamp) / np.linalg.norm(end - clamp)
    reach = float(np.linalg.norm(end - clamp)) if length is None else length
    clamp = end - reach * chord
    weight = float(np.linalg.norm(s.gravity - (s.gravity @ chord) * chord)) * FIRST_MODE / (2 * np.pi * frequency) ** 2
    side = np.sign(np.cross(normal, chord) @ up)
    way = _turned(chord, normal, side * weight / (8.0 * reach))
    end_way = _turned(way, normal, -side * weight / (6.0 * reach))
    frame: Array = np.stack([end_way, normal, np.cross(end_way, normal)])
    first = x[np.flatnonzero(free)[0], list(tip)].mean(axis=0) - end
    calm = float(np.std(swing[late])) < AT_REST * float(np.abs(swing[free] - swing[late].mean()).max())
    resting = float(t[late][0]) if calm else None
    return Beam(start, resting, frequency, clamp, end, reach, normal, way, end_way, (rest - end) @ frame.T, first)


def _lines(take: Take, tip: tuple[int, ...], beam: Beam, measured: Measured) -> list[str]:
    r, length, step = take.seen.recording, beam.length, take.step
    own = {"clamp_angles": True, "plane": beam.normal.tolist()}
    EI, lines = model(take, measured, beam.frequency, length, beam.clamp, beam.way, 10, 50, own)
    force = 3.0 * EI / length**3 * beam.load
    axis = int(np.argmax(np.abs(force)))
    lines += let_go([float(force[k]) if k == axis else 0.0 for k in range(3)])
    for name in ("tip_along", "tip_up"):
        lines += table(f"[scene.quantities.{name}]", {"scale": 1e-3}, {"scale": "m, of all markers' offsets"})
    lines += table("[[recording]]", {"name": "swing"} | _swing(take, beam) | _seen(take, tip, beam))
    if beam.resting is not None:
        still: dict[str, Any] = {
            "name": "rest",
            **take.reading,
            "leave_out": ["pull"],
            "static": True,
        }
        still["fit"] = [beam.resting, float(r.times[-1]) + 1e-4]
        seen = _seen(take, tip, beam)
        seen["sigma"] /= np.sqrt(max(1.0, FITTED / beam.frequency / step))  # it weighs as much as the swing's frames
        lines += table("[[recording]]", still | seen, {"static": "the mean of the last frames"})
    spread = {"prior": [0.0, 0.1 * length]}
    parameters: dict[str, dict[str, Any]] = {
        "beam_EI": {},
        "beam_loss_factor": {},
        f"pull_{'xyz'[axis]}": {"private": True},
    }
    parameters |= {"beam_start_angle": {"prior": [0.0, 0.1]}, "tip_along": spread, "tip_up": spread}
    for name, entries in parameters.items():
        lines += table(f"[parameters.{name}]", entries)
    if measured.length is None:
        lines += table("[given.beam_length]", {"sd": LENGTH_SD}, {"sd": "relative: it counts in the intervals"})
    return lines


def model(
    take: Take,
    measured: Measured,
    frequency: float,
    length: float,
    clamp: Array,
    way: Array,
    segments: int,
    steps: int,
    own: Mapping[str, Any],
) -> tuple[float, list[str]]:
    """EI of a uniform beam of this frequency, and the lines of the scene, its solver and the beam.

    Args:
        steps: in a period.
        own: further keys of the beam.
    """
    density = 1.0 if measured.density is None else measured.density
    EI = density * (2 * np.pi * frequency) ** 2 * length**4 / FIRST_MODE
    rope: dict[str, Any] = {"name": "beam", "length": length, "segments": segments, "density": density, "EI": EI}
    rope |= {"start": clamp.tolist(), "direction": way.tolist(), "clamp_start": way.tolist(), **own}
    rope |= {"loss_factor": LOSS, "loss_frequency": frequency}
    said = "kg/m" if measured.density is not None else "kg/m, not known: see above"
    lines = take.scene_lines
    lines += table(
        "[solver]", {"substeps": max(1, int(np.ceil(take.step * steps * frequency)))}, {"substeps": "per frame"}
    )
    lines += table("[[scene.rope]]", rope, {"EI": "of a uniform beam of this frequency", "density": said})
    return EI, lines


def let_go(force: list[float]) -> list[str]:
    """The lines of a pull (3,) N at the end of the beam that ends at once."""
    pull = {"name": "pull", "particles": ["beam:end"], "force": force, "times": [0.0, 1e-6], "factors": [1.0, 0.0]}
    return table("[[scene.force]]", pull, {"factors": "let go at once"})


def _swing(take: Take, beam: Beam) -> dict[str, Any]:
    stop = beam.start + FITTED / beam.frequency
    last = min(stop + PREDICTED / beam.frequency, float(take.seen.recording.times[-1]))
    entries: dict[str, Any] = {**take.reading, "start": "equilibrium"}
    return entries | {"start_time": beam.start, "fit": [beam.start, stop], "held_out": [stop, last]}


def _seen(take: Take, tip: tuple[int, ...], beam: Beam) -> dict[str, Any]:
    """Keys of a recording that say where its markers are and what counts."""
    names = take.seen.recording.markers
    places = [
        {"marker": names[k], "arc_length": beam.length, "offset": at.tolist(), "normal": beam.normal.tolist()}
        for k, at in zip(tip, beam.offsets, strict=True)
    ]
    axes = "".join(axis for k, axis in enumerate("xyz") if abs(beam.normal[k]) < 0.99)
    offsets = {names[k]: ["tip_along", "", "tip_up"] for k in tip}
    return {"sigma": max(take.seen.noise, 1e-3 * beam.length), "axes": axes, "offsets": offsets, "marker": places}


def turning(times: Array, swing: Array) -> float:
    """s, of the first turning point after the largest speed, where a motion starts from a shape at rest: the vertex of
    the parabola through the three frames about it."""
    speed = np.gradient(swing, times)
    fastest = int(np.argmax(np.abs(speed)))
    after = np.flatnonzero(np.sign(speed[fastest:]) != np.sign(speed[fastest]))
    if not len(after):
        return float(times[-1])
    k = fastest + int(after[0])
    near = range(max(1, k - 2), min(len(times) - 2, k + 2) + 1)
    k = max(near, key=lambda j: float(np.sign(speed[fastest]) * swing[j]), default=k)
    t = times[k - 1 : k + 2] - times[k]
    half_bend, slope, _ = np.polyfit(t, swing[k - 1 : k + 2], 2)
    off = -slope / (2.0 * half_bend) if half_bend else 0.0
    return float(times[k] + np.clip(off, t[0], t[-1]))


def _turned(vector: Array, normal: Array, angle: float) -> Array:
    """A vector across the normal, turned about it."""
    return np.asarray(vector * np.cos(angle) + np.cross(normal, vector) * np.sin(angle))
