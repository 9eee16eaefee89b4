"""The sections of a configuration that describe a rope, its recordings, and what is fitted."""

from __future__ import annotations

from typing import Any

import numpy as np

from .beginning import quiet_frame
from .held import Held
from .line import snapped
from .lying import RADIUS
from .marked import Marked
from .rope_model import LEAST_SIGMA, ROUND, RopeModel, last_fitted
from .seen import Seen
from .take import Take, max_gap
from .text import table

SUBSTEP = 1 / 500  # s, at most
BENDING = 0.15  # of the length: bending length (EI/(density g))^(1/3) at the start
SEGMENTS, MOST_SEGMENTS = 40, 100  # of a rope, at least and at most
FRICTION = 0.1  # on a table, at the start: a rope that sticks shows a fit no way
CLAMP_SD = 0.2  # rad, of the direction of a clamp, read off the first markers
LENGTH_SD = 0.01  # relative, of a length that is a sum of distances between markers
SET_MODES, SET_SD = (1, 2, 3, 4), 10.0  # of the rest curvature of shapes at rest; 1/m, that of mode k over k^1.5
HOLDER_SD = 0.5  # rad, of a clamp of a shape at rest, read off the markers of the same shape


def lines_of(rope: RopeModel) -> list[str]:
    """The configuration without its head."""
    return [*_scene(rope), *_recordings(rope), *_parameters(rope), *_fit(rope)]


def _scene(rope: RopeModel) -> list[str]:
    """The solver, the rope with its markers, and what holds and loads it."""
    r = rope.seen.recording
    lines = rope.marked[0].take.scene_lines
    if not rope.seen.static:
        step = float(np.median(np.diff(r.times)))
        solver: dict[str, Any] = {"substeps": max(1, int(np.ceil(step / SUBSTEP - 1e-9)))}
        solver |= {"method": "implicit", "integrator": "bdf1"} if rope.table is not None else {}
        lines += table("[solver]", solver, {"substeps": "per frame"})
    lines += table(f"[[scene.{rope.kind}]]", _rope(rope), _why(rope))
    lines += table(f"[scene.{rope.kind}.markers]  # arc lengths in m", rope.marked[0].placed(rope.length.value))
    if rope.load is not None:
        point = {"name": "end", "particle": f"rope:{rope.load.at}", "mass": rope.load.mass}
        lines += table("[[scene.point_mass]]", point, {"mass": "kg"})
    if (under := rope.table) is not None:
        shape = {"name": "table", "shape": "plane", "point": under.point, "normal": under.up.tolist()}
        touch = {"of": "rope", "collider": "table", "friction": FRICTION, "radius": RADIUS, "settle": True}
        lines += table("[[scene.collider]]", shape, {"point": "m, below the lowest markers by a radius"})
        lines += table("[[scene.contact]]", touch, {"friction": "a guess to start from", "radius": "m, not known"})
    for grip in rope.held.grips:
        lines += table(f"[[scene.{rope.kind}.grip]]", grip | ({"smoothing": 0.0} if rope.estimated else {}))
    return lines


def _rope(rope: RopeModel) -> dict[str, Any]:
    """Keys of the rope."""
    length, density, start = rope.length.value, rope.density.value, rope.start.keys
    EI = density * 9.81 * (BENDING * length) ** 3
    keys: dict[str, Any] = {"name": "rope", "length": length, "segments": _segments(rope), "density": density}
    keys |= {"EI": EI, "points": start.get("points")}
    if rope.flat is not None:
        keys |= {"clamp_angles": True, "plane": rope.flat, "set_modes": list(SET_MODES)}
    if not rope.seen.static:
        keys |= {"bend_damping": None if rope.table else 0.01, "drag_linear": 0.1 * density}
    if rope.stretch is not None:
        keys |= {"EA": _tension(rope), "stretch_damping": 0.01}
    if rope.rod:
        keys |= {"GJ": ROUND * EI, "twist_damping": keys["bend_damping"]}
    if rope.keeps_roll:
        keys |= _without_spin(rope.seen, rope.held)
    keys |= start | rope.held.rope
    if "clamp_start" in keys and "direction" in start:
        keys["clamp_start"] = start["direction"]
    return keys


def _tension(rope: RopeModel) -> float:
    """N, of an axial stiffness that its weight and load stretch by as much as is seen."""
    hangs = rope.density.value * rope.length.value + (0.0 if rope.load is None else rope.load.mass)
    return 9.81 * hangs / rope.stretch.by if rope.stretch is not None else float("inf")


def _why(rope: RopeModel) -> dict[str, str]:
    """Comments on these keys."""
    why = {"EI": "a guess to start from", "density": "kg/m" if rope.density.measured else "kg/m, not known: see above"}
    if not rope.length.measured:
        why["length"] = "not known well: see above"
    if rope.keeps_roll:
        why["hold_roll"] = "the hand lets it turn, but not spin about its own axis"
    return why


def _segments(rope: RopeModel) -> int:
    """Twice as many where a hand holds the direction: beside it, a rope in the air bends within a few hundredths of its
    length."""
    held = rope.table is None and any(len(grip["markers"]) > 1 for grip in rope.held.grips)
    least = 2 * SEGMENTS if held else SEGMENTS
    return min(max(least, 2 * (len(rope.markers) - 1)), MOST_SEGMENTS)


def _without_spin(s: Seen, found: Held) -> dict[str, Any]:
    """The ends that do not spin, and the first axis of their sections: the direction in which the rope points least,
    since it may not come to lie along it."""
    at = [grip["at"] for grip in found.grips]
    near = found.order[:2] if at[0] == "start" else found.order[-2:]
    chords = s.recording.positions[:, near[1]] - s.recording.positions[:, near[0]]
    chords = chords[np.isfinite(chords).all(axis=1)]
    return {"hold_roll": at, "director": snapped(np.linalg.svd(chords, full_matrices=False)[2][-1])}


def _recordings(rope: RopeModel) -> list[str]:
    """Each recording, with what differs from the first one."""
    lines: list[str] = []
    for here in rope.marked:
        lines += _recording(rope, here)
        if here is not rope.marked[0]:
            lines += here.lines(rope.length.value, rope.estimated)
    return lines


def _recording(rope: RopeModel, here: Marked) -> list[str]:
    take, r = here.take, here.take.seen.recording
    driving = [r.markers.index(name) for grip in here.held.grips for name in grip["markers"]]
    entries = _entries(rope, take)
    why = {"held_out": "predicted, not fitted", "max_gap": "s, for which a marker of a grip is lost: closed by a cubic"}
    if rope.estimated:
        entries["fit"][0] = quiet_frame(take.seen, driving)
        entries["driven_sigma"] = "estimate"
        why["fit"] = "begins where noise moves the hand's marker least from its place at rest"
        why["driven_sigma"] = "the fit estimates the hand's true motion"
    entries["max_gap"] = max_gap(r.times, r.mask[:, driving])
    return table("[[recording]]", entries, why)


def _entries(rope: RopeModel, take: Take) -> dict[str, Any]:
    """Keys of a recording: how it is read, compared and divided."""
    s, r, flat = take.seen, take.seen.recording, rope.flat
    entries: dict[str, Any] = dict(take.reading)
    if s.static:
        axes = "".join(axis for k, axis in enumerate("xyz") if flat is None or abs(flat[k]) < 0.99)
        return entries | {"static": True, "sigma": max(s.noise, 0.007 * float(np.nanmax(s.apart))), "axes": axes}
    start, stop, last = float(r.times[0]), float(r.times[-1]), last_fitted(take)
    if s.rest and rope.table is not None:
        start += 0.5 * s.rest
    elif s.rest and "points" in rope.start.keys:
        entries["start"] = "equilibrium"
    entries["fit"] = [start, last]
    entries["held_out"] = [last, round(min(stop, last + 0.5 * (last - start)), 4) + 1e-3]
    moves = "".join(
        axis
        for axis, size in zip("xyz", np.nanmax(r.positions, (0, 1)) - np.nanmin(r.positions, (0, 1)), strict=True)
        if size
    )
    return entries | {"sigma": max(s.noise, LEAST_SIGMA), "axes": None if moves == "xyz" else moves}


def _parameters(rope: RopeModel) -> list[str]:
    """What is fitted, with bounds and priors."""
    lines: list[str] = []
    for name, limits in _limits(rope).items():
        lines += table(f"[parameters.{name}]", limits)
    if rope.load is not None and not rope.load.weighed:
        mass, within = rope.load.mass, rope.load.within
        lines += table("[parameters.end_mass]", {"lower": mass / within, "upper": mass * within})
    for name, sd in rope.held.priors.items():
        lines += table(f"[parameters.rope_{name}]", {"prior": [0.0, sd]})
    for at in rope.held.angles:
        lines += table(f"[parameters.rope_{at}_angle]", {"prior": [0.0, CLAMP_SD]}, {"prior": "rad"})
    if not rope.length.measured:
        # a motion shows the length of a rope far better than a sum of distances; a shape at rest does not
        if rope.seen.static:
            lines += table("[given.rope_length]", {"sd": LENGTH_SD})
        else:
            sd = LENGTH_SD if rope.stretch is None else max(LENGTH_SD, 0.5 * rope.stretch.by)
            lines += table("[parameters.rope_length]", {"prior": [rope.length.value, sd]})
    return lines


def _limits(rope: RopeModel) -> dict[str, dict[str, Any]]:
    """What is fitted of the rope itself, and its bounds."""
    density = rope.density.value
    scale = density * 9.81 * rope.length.value**3
    found: dict[str, dict[str, Any]] = {"rope_EI": {"lower": 1e-7 * scale, "upper": 10.0 * scale}}
    if not rope.seen.static:
        if rope.table is None:
            found["rope_bend_damping"] = {"lower": 1e-5, "upper": 1.0}
        found["rope_drag_linear"] = {"lower": 1e-4 * density, "upper": 10.0 * density}
    if rope.stretch is not None:
        found["rope_EA"] = {"lower": 0.01 * _tension(rope), "upper": 1000.0 * _tension(rope)}
        found["rope_stretch_damping"] = {"lower": 1e-5, "upper": 1.0}
    if rope.table is not None:
        found["table_friction"] = {"lower": 0.01, "upper": 2.0}
    if rope.rod:
        found["rope_GJ"] = {"tied_to": "rope_EI", "factor": ROUND}
        found["rope_twist_damping"] = {"tied_to": "rope_bend_damping"}
    if rope.flat is not None:
        found |= {f"rope_set_{k}": {"prior": [0.0, round(SET_SD / k**1.5, 4)]} for k in SET_MODES}
        for end in (end for end in ("start", "end") if f"clamp_{end}" in rope.held.rope):
            found[f"rope_{end}_angle"] = {"private": True, "lower": -0.785, "upper": 0.785, "prior": [0.0, HOLDER_SD]}
    return found


def _fit(rope: RopeModel) -> list[str]:
    """How several shapes at rest judge each other."""
    if not rope.seen.static or len(rope.marked) == 1:
        return []
    return table("[fit]", {"leave_one_out": True}, {"leave_one_out": "predicts each shape from the others"})
