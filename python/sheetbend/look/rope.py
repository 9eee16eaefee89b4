"""A rope in a recording: its markers in order, what holds it, and how it is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays.timeseries import mean_position
from ..errors import RecordingError
from .beginning import lets_go, quiet_frame
from .end_load import loaded_end
from .held import Hands, Held, gripping, held, parts
from .line import plane, snapped, tangent
from .marked import Marked, marked_by, said_of
from .one_rope import check_one_rope
from .released import released
from .seen import Seen
from .take import Description, Measured, Take, max_gap
from .text import joined, table
from .unseen import free_from

Array = np.ndarray
SUBSTEP = 1 / 500  # s, at most
BENDING = 0.15  # of the length: bending length (EI/(density g))^(1/3) at the start
SEGMENTS = 40  # of a rope, at least
FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most; the next third is predicted
CLAMP_SD = 0.2  # rad, of the direction of a clamp, read off the first markers
LENGTH_SD = 0.01  # relative, of a length that is a sum of distances between markers
SET_MODES, SET_SD = (1, 2, 3, 4), 10.0  # of the rest curvature of shapes at rest; 1/m, that of mode k over k^1.5
ROUND = 0.75  # GJ/EI of a round solid section with a Poisson ratio of 1/3
LEAST_SIGMA = 1e-4  # m, of the markers of a motion: a model misses by as much
NUMBERS = 1500  # of a hand's motion, three for every fitted frame: so many are estimated in minutes
LEAST_HELD = 30  # frames before a rope is let go
LEAST_FREE = 0.2  # of a recording: how much is left at least where its beginning is cut off
HOLDER_SD = 0.5  # rad, of a clamp of a shape at rest, read off the markers of the same shape

TWIST = (
    "the torsional stiffness and its damping: a motion hardly shows them. They follow the bending stiffness, times "
    f"{ROUND}, and its damping, as in a solid round section"
)
WITHOUT_TWIST = (
    "its twist: the rope turns in space, where [[scene.rope]] damps a bend that turns, too, so rope_bend_damping comes "
    "out too small, by a fifth in one example. A [[scene.rod]] does not; write one where the damping matters"
)
SPIN = (
    "whether the hand lets the rope spin about its own axis, as a swivel does. It is taken not to (`hold_roll`): where "
    "a bend goes round, every section then bends back and forth, which damps. One that spins with its bend "
    "is damped less, and the damping would come out too small, by a fifth in one example. If it can spin, remove "
    "`hold_roll`"
)
UNLOADED = (
    "the shape that the rope has without load. Shapes at rest under its weight hardly tell it from the stiffness, "
    "which is fitted beside four modes of a rest curvature. If the rope is straight without load, remove `set_modes` "
    "and [parameters.rope_set_...]"
)


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A rope; None where fewer than three markers are in a line."""
    s = takes[0].seen
    r = s.recording
    hands, order = parts(s)
    hand = tuple(k for body in hands for k in body)
    if len(order) < 3:
        return None
    if len(hand) + len(order) < len(r.markers):
        return _without_others(takes, measured, [r.markers[k] for k in sorted((*hand, *order))])
    if not s.static and len(takes) == 1 and (let_go := released(s, order)) is not None:
        return _while_held(takes[0], measured, let_go)
    check_one_rope(s, order)
    found = _holding(s, hands, order)
    if len(found.order) < 3:
        return None
    pushed = None
    if s.rest and not s.static and not found.grips and len(takes) == 1:
        takes, pushed = _free(takes[0], found)
        s, r = takes[0].seen, takes[0].seen.recording
    marked = marked_by(takes, found, _holding)
    longest = max(marked, key=lambda own: own.arcs[-1])
    length, measured_length, said_length = _length(s, longest, measured)
    if not measured_length:
        length += found.leads.get("end", 0.0)
    density, said_density = _density(s, measured)
    names = r.markers
    far = f"{min(marked[0].arcs[-1], length):.4g} m"
    notes = [f"a rope through {joined(names[k] for k in order)}; {far} of it are free"]
    if s.static:
        notes = [f"a rope through {joined(names[k] for k in order)}, {far} from the first to the last"]
    flat = plane(r.positions[:, list(order)], length) if s.static else None
    in_space = not s.static and plane(r.positions[:, list(order)], length) is None
    kind = "rod" if in_space and _can_be_rod(s, found) else "rope"
    unknown = [said_length, said_density, *found.unknown, *([] if flat is None else [UNLOADED])]
    estimated = kind == "rod" and _estimates_hand(takes, found)
    if found.alone:
        unknown.append(_true_motion(found, estimated))
    if in_space:
        unknown.append(TWIST if kind == "rod" else WITHOUT_TWIST)
    # beside a hand that holds its direction a rope bends within a few hundredths of its length
    least = 2 * SEGMENTS if any(len(grip["markers"]) > 1 for grip in found.grips) else SEGMENTS
    segments = int(min(max(least, 2 * (len(order) - 1)), 100))
    rope: dict[str, Any] = {"name": "rope", "length": length, "segments": segments, "density": density}
    rope |= {"EI": density * 9.81 * (BENDING * length) ** 3, "points": "recording"}
    why = {"EI": "a guess to start from"} | ({} if measured_length else {"length": "not known well: see above"})
    why["density"] = "kg/m" if measured.density is not None else "kg/m, not known: see above"
    if s.static:
        rope |= {} if flat is None else {"clamp_angles": True, "plane": flat, "set_modes": list(SET_MODES)}
    else:
        rope |= {"bend_damping": 0.01, "drag_linear": 0.1 * density}
        if kind == "rod":
            rope |= {"GJ": ROUND * rope["EI"], "twist_damping": rope["bend_damping"]}
            if _turns_freely(found) and not found.rope.get("pinned"):
                rope |= _without_spin(s, found)
                why["hold_roll"] = "the hand lets it turn, but not spin about its own axis"
                unknown.append(SPIN)
        begins = _beginning(s, found, rope, kind == "rod")
        notes += begins if pushed is None else [pushed]
    lines = takes[0].scene_lines
    if not s.static:
        step = float(np.median(np.diff(r.times)))
        lines += table("[solver]", {"substeps": max(1, int(np.ceil(step / SUBSTEP - 1e-9)))}, {"substeps": "per frame"})
    lines += table(f"[[scene.{kind}]]", rope | found.rope, why)
    lines += table(f"[scene.{kind}.markers]  # arc lengths in m", marked[0].placed(length))
    load = None if s.static else loaded_end(s, found)
    if load is not None:
        at, mass = load[0], load[1] * density
        notes.append(f"its free end carries a mass, some {load[1]:.2g} times that of 1 m of the rope: it is fitted")
        unknown.append(
            "how the mass at the free end is attached: it is a point at the last marker, which turns freely. If you "
            "weighed it, correct `mass` in [[scene.point_mass]] and remove [parameters.end_mass]"
        )
        lines += table("[[scene.point_mass]]", {"name": "end", "particle": f"rope:{at}", "mass": mass}, {"mass": "kg"})
    for grip in found.grips:
        lines += table(f"[[scene.{kind}.grip]]", grip | ({"smoothing": 0.0} if estimated else {}))
    for here in marked:
        take, r = here.take, here.take.seen.recording
        own = _recording(take, flat, "points" in rope) | {"driven_sigma": "estimate" if estimated else None}
        driving = [r.markers.index(name) for grip in here.held.grips for name in grip["markers"]]
        if estimated:
            own["fit"][0] = quiet_frame(take.seen, driving)
        own["max_gap"] = max_gap(r.times, r.mask[:, driving])
        why = {
            "driven_sigma": "the fit estimates the hand's true motion",
            "fit": "begins where noise moves the hand's marker least from its place at rest" if estimated else "",
            "held_out": "predicted, not fitted",
            "max_gap": "s, for which a marker of a grip is lost: closed by a cubic",
        }
        lines += table("[[recording]]", own, why) + (here.lines(length, estimated) if here is not marked[0] else [])
    for name, limits in _parameters(s.static, density, length, flat is not None, kind == "rod").items():
        lines += table(f"[parameters.{name}]", limits)
    if load is not None:
        lines += table("[parameters.end_mass]", {"lower": 0.2 * mass, "upper": 5.0 * mass})
    for name, sd in found.priors.items():
        lines += table(f"[parameters.rope_{name}]", {"prior": [0.0, sd]})
    for at in found.angles:
        lines += table(f"[parameters.rope_{at}_angle]", {"prior": [0.0, CLAMP_SD]}, {"prior": "rad"})
    if not measured_length:
        prior = {"prior": [length, LENGTH_SD]}
        # a motion shows the length of a rope far better than a sum of distances; a shape at rest does not
        lines += (
            table("[given.rope_length]", {"sd": LENGTH_SD}) if s.static else table("[parameters.rope_length]", prior)
        )
    own_markers, held_there = said_of(marked)
    notes, unknown = notes + own_markers, unknown + held_there
    if s.static and len(takes) > 1:
        lines += table("[fit]", {"leave_one_out": True}, {"leave_one_out": "predicts each shape from the others"})
    return Description("a rope" + (" at rest" if s.static else ""), [*notes, *found.notes], unknown, lines)


def _without_others(takes: Sequence[Take], measured: Measured, kept: list[str]) -> Description | None:
    """The rope alone, where a rigid body far from it is in the same recording."""
    alone = [
        replace(take, seen=take.seen.of(take.seen.recording.select(kept)))
        if set(kept) <= set(take.seen.recording.markers)
        else take
        for take in takes
    ]
    found = describe(alone, measured)
    if found is not None:
        others = [name for name in takes[0].seen.recording.markers if name not in kept]
        found.notes.append(f"{joined(others)} move as a rigid body far from the rope: they are left out")
    return found


def _while_held(take: Take, measured: Measured, let_go: float) -> Description | None:
    """The rope up to the time, s, at which it is let go, where that is long enough to tell something."""
    r = take.seen.recording
    if (r.times < let_go).sum() < LEAST_HELD:
        return None
    found = describe([replace(take, seen=take.seen.of(r.piece(float(r.times[0]), let_go)))], measured)
    if found is not None:
        found.notes.append(
            f"it falls freely from {let_go:.3g} s on: what holds it lets go, and only the time before is used"
        )
    return found


def _free(take: Take, found: Held) -> tuple[list[Take], str | None]:
    """The part of a recording in which a rope moves freely that rested before, though nothing that holds it moves, and
    what is said of it."""
    s, r = take.seen, take.seen.recording
    start = free_from(r, s.rest, found.order)
    if start + LEAST_FREE * float(r.times[-1] - r.times[0]) > r.times[-1]:
        return [take], None
    found.unknown.append(
        f"whether anything still touches the rope after {start:.4g} s. If so, let `fit` in [[recording]] begin later"
    )
    said = (
        f"it rests for the first {s.rest:.2g} s and then moves, though what holds it stays: something that no marker "
        f"shows pushes it, or bends it and lets go. The fit begins at {start:.4g} s, where it moves fastest for the "
        "first time, with the places and speeds of the markers"
    )
    return [replace(take, seen=replace(s, recording=r.piece(start), rest=0.0))], said


def _holding(s: Seen, hands: Hands, order: tuple[int, ...]) -> Held:
    return _at_rest(s, order) if s.static else held(s, hands, order)


def _at_rest(s: Seen, order: tuple[int, ...]) -> Held:
    """Both ends of a shape at rest in clamps."""
    mean = mean_position(s.recording.positions)
    clamps = {"clamp_start": snapped(tangent(mean, order)), "clamp_end": snapped(-tangent(mean, order[::-1]))}
    unknown = ["how the ends are held: both are taken as clamps at the first and last marker, whose angles are fitted"]
    return Held(order, clamps, notes=["nothing moves: a shape at rest"], unknown=unknown)


def _length(s: Seen, longest: Marked, measured: Measured) -> tuple[float, bool, str]:
    """m, whether it was measured, and what is said of it."""
    last = float(longest.arcs[-1])
    if measured.length is not None:
        if measured.length < 0.8 * last:
            problem = f"is shorter than the {last:.4g} m from the first to the last marker"
            raise RecordingError("length", problem, measured.length, "give the length of the whole rope in m")
        return measured.length, True, "where the markers are along the rope: the first one is taken to be at its start"
    told = s.recording.metadata.get("length_m")
    if isinstance(told, int | float) and told >= 0.8 * last:
        return float(told), True, "whether the length that the file tells runs from the first to the last marker"
    markers, order = longest.take.seen.recording.markers, longest.held.order
    a, b = markers[order[0]], markers[order[-1]]
    return (
        last,
        False,
        f"the length: the sum of the distances from {a} to {b}, which noise makes too long and bends make too short. "
        "It is fitted too. The rope beyond these markers is not seen: the model ends there. Measure it, and give "
        "--length"
        if not s.static
        else f"the length: the sum of the distances from {a} to {b}, to 1 %. Measure it, and give --length",
    )


def _density(s: Seen, measured: Measured) -> tuple[float, str]:
    told = s.recording.metadata.get("linear_density_kg_per_m")
    if measured.density is not None:
        return (
            measured.density,
            "the mass of the markers: weigh the rope with them, or add them as [[scene.point_mass]]",
        )
    if isinstance(told, int | float):
        return float(told), "the mass of the markers; the density is the file's"
    return 1.0, (
        "the density: the motion shows only the ratios of stiffness and drag to it. It is set to 1 kg/m, so rope_EI is "
        "EI/density in m^4/s^2. Weigh the rope and give --density"
    )


def _estimates_hand(takes: Sequence[Take], found: Held) -> bool:
    """Whether the fit is to estimate the true motion of what moves the rope, from one marker at each end: where the
    noise of the markers is what the fit will leave, and where that takes minutes."""
    markers = [name for grip in found.grips for name in grip["markers"]]
    frames = sum(int(np.sum(take.seen.recording.times < _last_fitted(take))) for take in takes)
    noisy = all(take.seen.noise > LEAST_SIGMA for take in takes)
    return noisy and bool(markers) and markers == found.alone and 3 * len(markers) * frames <= NUMBERS


def _true_motion(found: Held, estimated: bool) -> str:
    what = f"the true motion of {joined(found.alone)}: its noise shakes the rope, which looks like damping. "
    if estimated:
        return what + (
            "The fit estimates it (`driven_sigma`), which takes minutes. `smoothing = 0.12` in the grip instead of "
            "`driven_sigma` in [[recording]] takes an eighth of the time, and the damping is known half as well"
        )
    return what + (
        "It is smoothed; `smoothing = 0` with `driven_sigma` in [[recording]] estimates it, which takes longer"
    )


def _turns_freely(found: Held) -> bool:
    """Whether nothing holds a direction of the rope."""
    clamped = "clamp_start" in found.rope or "clamp_end" in found.rope
    return not clamped and all(len(grip["markers"]) == 1 and "direction" not in grip for grip in found.grips)


def _without_spin(s: Seen, found: Held) -> dict[str, Any]:
    """The ends that do not spin, and the first axis of their sections: the direction in which the rope points least,
    since it may not come to lie along it."""
    at = [grip["at"] for grip in found.grips]
    near = found.order[:2] if at[0] == "start" else found.order[-2:]
    chords = s.recording.positions[:, near[1]] - s.recording.positions[:, near[0]]
    chords = chords[np.isfinite(chords).all(axis=1)]
    return {"hold_roll": at, "director": snapped(np.linalg.svd(chords, full_matrices=False)[2][-1])}


def _can_be_rod(s: Seen, found: Held) -> bool:
    """Whether a rod can be held like this. One that turns freely has no single rest, since it may also turn about its
    own axis; so it must hang straight there, from its start."""
    if found.leads:
        return False
    from_start = [grip["at"] for grip in found.grips] == ["start"] and not found.rope.get("pinned")
    return not (s.rest and _turns_freely(found)) or (from_start and _straight(s, found.order) is not None)


def _beginning(s: Seen, found: Held, rope: dict[str, Any], rod: bool) -> list[str]:
    """Set how a motion begins; returns what is said of it."""
    if s.rest and not (rod and _turns_freely(found)):
        return [f"it rests for the first {s.rest:.2g} s"]
    if s.rest:
        del rope["points"]
        rope["direction"] = _straight(s, found.order)
        return [f"it hangs straight and rests for the first {s.rest:.2g} s"]
    if not lets_go(s, found.order):
        rope["velocity"] = "recording"
        return ["it moves at the first frame: place and speed at the start are those of the markers"]
    notes = ["at the first frame it moves no faster than its noise: it starts from rest"]
    way = _straight(s, found.order)
    if way is not None:
        del rope["points"]
        rope |= {"start": mean_position(s.recording.positions)[found.order[0]].tolist(), "direction": way}
        if "clamp_start" in found.rope:
            found.rope["clamp_start"] = way
        notes.append("at the first frame it is straight within its noise")
    return notes


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


def _recording(take: Take, flat: list[float] | None, finds_rest: bool) -> dict[str, Any]:
    s, r = take.seen, take.seen.recording
    entries: dict[str, Any] = dict(take.reading)
    if s.static:
        axes = "".join(axis for k, axis in enumerate("xyz") if flat is None or abs(flat[k]) < 0.99)
        return entries | {"static": True, "sigma": max(s.noise, 0.007 * float(np.nanmax(s.apart))), "axes": axes}
    start, stop, last = float(r.times[0]), float(r.times[-1]), _last_fitted(take)
    if s.rest and finds_rest:
        entries["start"] = "equilibrium"
    entries["fit"] = [start, last]
    entries["held_out"] = [last, round(min(stop, last + 0.5 * (last - start)), 4) + 1e-3]
    return entries | {"sigma": max(s.noise, LEAST_SIGMA)}


def _last_fitted(take: Take) -> float:
    """The end of the part of a motion that is fitted, s."""
    s, times = take.seen, take.seen.recording.times
    start, stop = float(times[0]), float(times[-1])
    return round(start + s.rest + min(FITTED * (stop - start - s.rest), LONGEST), 4)


def _parameters(static: bool, density: float, length: float, angles: bool, rod: bool) -> dict[str, dict[str, Any]]:
    scale = density * 9.81 * length**3
    found: dict[str, dict[str, Any]] = {"rope_EI": {"lower": 1e-7 * scale, "upper": 10.0 * scale}}
    if not static:
        found["rope_bend_damping"] = {"lower": 1e-5, "upper": 1.0}
        found["rope_drag_linear"] = {"lower": 1e-4 * density, "upper": 10.0 * density}
    if rod:
        found["rope_GJ"] = {"tied_to": "rope_EI", "factor": ROUND}
        found["rope_twist_damping"] = {"tied_to": "rope_bend_damping"}
    if angles:
        found |= {f"rope_set_{k}": {"prior": [0.0, round(SET_SD / k**1.5, 4)]} for k in SET_MODES}
        for end in ("start", "end"):
            found[f"rope_{end}_angle"] = {"private": True, "lower": -0.785, "upper": 0.785, "prior": [0.0, HOLDER_SD]}
    return found


def between_grips(s: Seen) -> bool:
    """Whether two or more markers hold a rope at each end."""
    _, order = parts(s)
    held_by = gripping(s) - set(s.still)
    return len(order) >= 7 and {*order[:2], *order[-2:]} <= held_by
