"""A rope in a recording: the order of its markers, what holds it, and how it is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import RecordingError
from ..arrays.timeseries import mean_position
from .seen import Seen, chain
from .text import joined, table

if TYPE_CHECKING:
    from .draft import Take

Array = np.ndarray
Description = tuple[str, list[str], list[str], list[str]]
HELD_NAMES = ("hand", "grip", "wrist", "clamp", "robot", "holder", "finger")
SUBSTEP = 1 / 500  # s, at most
SMOOTHING = 0.06  # s, of recorded grips
BENDING = 0.15  # of the length: bending length (EI/(density g))^(1/3) at the start
EARLY = 0.05  # s, in which the speed at the first frame is looked for
BRANCHED = 1.1  # times the shortest tree: how much longer the line through all markers of a branched cable is
FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most; the next third is predicted
STIFF = 0.75  # of the next chord's: how much the direction at an end varies at most in a clamp; a pin has 1 or more


def describe(takes: Sequence[Take], density: float | None) -> Description | None:
    """A rope; None where fewer than three markers are in a line."""
    first = takes[0].seen
    r = first.recording
    body, order = _parts(first)
    if len(order) < 3:
        return None
    _unbranched(first, order)
    names = r.markers
    arc = _arcs(takes, order)
    length, said_length = _length(first, float(arc[-1]))
    if not first.static and _even(arc, first.noise):
        arc = np.median(np.diff(arc)) * np.arange(len(arc))
        length = max(length, float(arc[-1])) if "length_m" in r.metadata else float(arc[-1])
    arc = np.minimum(arc, length)
    weight, said_density = _density(first, density)
    notes = [f"a rope through {joined(names[k] for k in order)}, {float(arc[-1]):.4g} m from the first to the last"]
    unknown = [said_length, said_density]
    held, notes_held, unknown_held = _held(first, body, order)
    notes, unknown = notes + notes_held, [*unknown, *unknown_held]
    static = first.static
    flat = _plane(r.positions[:, list(order)], length) if static else None
    rope: dict[str, Any] = {"name": "rope", "length": length, "segments": _segments(len(order)), "density": weight}
    rope["EI"] = weight * 9.81 * (BENDING * length) ** 3
    rope["points"] = "recording"
    rope["markers"] = {names[k]: float(s) for k, s in zip(order, arc, strict=True)}
    why = {"EI": "a guess to start from", "markers": "arc lengths in m"}
    if not static:
        rope |= {"bend_damping": 0.01, "drag_linear": 0.1 * weight}
        if _lets_go(first, order):
            way = _straight(first, order)
            if way is not None:
                del rope["points"]
                rope |= {"start": np.nan_to_num(mean_position(r.positions)[order[0]]).tolist(), "direction": way}
                notes.append("at the first frame it is straight, as far as its noise tells")
            notes.append("at the first frame it moves no faster than its noise tells: it starts from rest")
        elif not first.rest:
            rope["velocity"] = "recording"
    if static and flat is not None:
        rope |= {"clamp_angles": True, "plane": flat, "set_modes": [1]}
    lines = [] if r.gravity is not None else table("[scene]", {"gravity": first.gravity.tolist()})
    if not static:
        step = float(np.median(np.diff(r.times)))
        lines += table("[solver]", {"substeps": max(1, int(np.ceil(step / SUBSTEP - 1e-9)))}, {"substeps": "per frame"})
    lines += table("[[scene.rope]]", rope | held.get("rope", {}), why)
    for grip in held.get("grips", []):
        lines += table("[[scene.rope.grip]]", grip)
    for take in takes:
        lines += table("[[recording]]", _recording(take, flat), {"held_out": "predicted, not fitted"})
    for name, limits in _parameters(static, weight, length, flat is not None).items():
        lines += table(f"[parameters.{name}]", limits)
    if static and len(takes) > 1:
        lines += table("[fit]", {"leave_one_out": True}, {"leave_one_out": "predicts each shape from the others"})
    return "a rope" + (" at rest" if static else ""), notes, unknown, lines


def _parts(s: Seen) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Markers of the hand's rigid body, and those of the rope in order."""
    r, count = s.recording, len(s.recording.markers)
    named = {k for k, n in enumerate(r.markers) if any(word in n.lower() for word in HELD_NAMES)}
    hands = [b for b in s.bodies if named & set(b)] or ([b for b in s.bodies if count - len(b) >= 3][:1])
    hand = hands[0] if hands else ()
    return hand, chain(s.apart, tuple(k for k in range(count) if k not in hand))


def _unbranched(s: Seen, order: tuple[int, ...]) -> None:
    """Refuse markers whose shortest tree has a node with three arms of two or more, and is much shorter than any line
    through them: a branched cable."""
    tree: dict[int, set[int]] = {order[0]: set()}
    total = 0.0
    while len(tree) < len(order):
        pairs = [(float(s.apart[a, b]), a, b) for a in tree for b in order if b not in tree]
        distance, a, b = min(pairs)
        tree[a].add(b)
        tree[b] = {a}
        total += distance
    forks = [k for k, near in tree.items() if sum(len(tree[j]) > 1 for j in near) >= 3]
    line = sum(float(s.apart[a, b]) for a, b in pairwise(order))
    if forks and line > BRANCHED * total:
        raise RecordingError(
            "markers",
            "lie along a cable that branches, and one rope cannot go through all of them",
            f"branches near {joined(s.recording.markers[k] for k in forks)}",
            "give a recording of one branch, or write one [[scene.rod]] for each, see docs/configuration.md",
        )


def _arcs(takes: Sequence[Take], order: tuple[int, ...]) -> Array:
    """(markers,) m along the rope: no chord is longer than its arc, so the longest ones count, less their noise."""
    pairs = list(pairwise(order))
    chords = np.max([[take.seen.apart[a, b] for a, b in pairs] for take in takes], axis=0)
    noise = max(take.seen.noise for take in takes)
    if takes[0].seen.static:
        return np.concatenate([[0.0], np.cumsum(chords)])
    # 98 % of the frames: that is two standard deviations above the true chord where the rope is straight
    return np.concatenate([[0.0], np.cumsum(np.maximum(chords - 2.0 * np.sqrt(2.0) * noise, 0.5 * chords))])


def _even(arc: Array, noise: float) -> bool:
    """Whether all markers are as far from the next one, to twice the noise: then their median distance is closer."""
    gaps = np.diff(arc)
    return bool(len(gaps) >= 4 and np.all(np.abs(gaps - np.median(gaps)) < 2.0 * noise))


def _lets_go(s: Seen, order: tuple[int, ...]) -> bool:
    """Whether the speeds at the first frame are within what noise makes of none: the rope is let go there. The slope
    of a parabola through N frames in the time T has the standard deviation sigma sqrt(192 / N) / T at its end."""
    r = s.recording
    t = r.times - r.times[0]
    early = np.flatnonzero(t <= EARLY)
    x = r.positions[early][:, list(order)]
    x = x[:, np.isfinite(x).all(axis=(0, 2))]
    if len(early) < 6 or not x.shape[1] or not s.noise:
        return False
    slope = np.linalg.lstsq(np.vander(t[early], 3, increasing=True), x.reshape(len(early), -1), rcond=None)[0][1]
    return bool(np.abs(slope).max() < 4.0 * s.noise * np.sqrt(192 / len(early)) / t[early[-1]])


def _straight(s: Seen, order: tuple[int, ...]) -> list[float] | None:
    """The direction from the first marker, if it stays in place, along a rope that is straight at the first frame."""
    x = s.recording.positions[0, list(order)]
    if order[0] not in s.still or np.isnan(x).any():
        return None
    off = x - mean_position(s.recording.positions)[order[0]]
    way = np.linalg.svd(off, full_matrices=False)[2][0]
    way *= np.sign(way @ off[-1])
    return _snapped(way) if np.abs(off - np.outer(off @ way, way)).max() < 4.0 * s.noise else None


def _length(s: Seen, last: float) -> tuple[float, str]:
    told = s.recording.metadata.get("length_m")
    if isinstance(told, int | float) and told >= 0.8 * last:
        return float(told), "whether the length that the file tells runs from the first to the last marker"
    return last, "what hangs beyond the last marker: the rope is taken to end there; correct `length` if it goes on"


def _density(s: Seen, given: float | None) -> tuple[float, str]:
    told = s.recording.metadata.get("linear_density_kg_per_m")
    if given is not None:
        return given, "the mass of the markers: weigh the rope with them, or hang them on as [[scene.point_mass]]"
    if isinstance(told, int | float):
        return float(told), "the mass of the markers; the density is the file's"
    return 1.0, (
        "the density: motion alone tells stiffness and drag over density. It is 1 kg/m here, so rope_EI is EI/density "
        "in m^4/s^2; weigh the rope and give --density"
    )


def _segments(markers: int) -> int:
    return int(min(max(40, 2 * (markers - 1)), 100))


def _held(s: Seen, hand: tuple[int, ...], order: tuple[int, ...]) -> tuple[dict[str, Any], list[str], list[str]]:
    """Keys of the rope and its grips, what was seen, and what is not known. The order is turned so that the held end
    comes first."""
    r = s.recording
    names, still, clamped = r.markers, set(s.still), set(r.clamped)
    first, last = order[0], order[-1]
    rope: dict[str, Any] = {}
    grips: list[dict[str, Any]] = []
    notes: list[str] = []
    unknown: list[str] = []
    if s.static:
        ways = [_tangent(mean_position(r.positions), order), _tangent(mean_position(r.positions), order[::-1])]
        rope = {"clamp_start": _snapped(ways[0]), "clamp_end": _snapped(-ways[1])}
        unknown.append("how the ends are held: both are taken as clamps whose angles are fitted")
        return {"rope": rope}, ["nothing moves: a shape at rest"], unknown
    held = [k for k in (first, last) if k in still or k in clamped]
    if hand:
        center = np.nanmean(r.positions[:, list(hand)], axis=1)
        at = min((first, last), key=lambda k: float(np.nanmean(np.linalg.norm(r.positions[:, k] - center, axis=1))))
        notes.append(f"{joined(names[k] for k in hand)} move as one rigid body, which holds the rope near {names[at]}")
        grips.append(
            {
                "at": "start" if at == first else "end",
                "markers": [names[k] for k in hand],
                "position": r.positions[0, at].tolist() if not np.isnan(r.positions[0, at]).any() else None,
                "smoothing": SMOOTHING,
            }
        )
        unknown.append("in which direction the rope leaves the hand: that of its first markers at the start is taken")
        held = [k for k in held if k != at]
    elif not held:
        height = np.nanmean(r.positions, axis=0) @ (-s.gravity / np.linalg.norm(s.gravity))
        reach = float(s.apart[first, last])
        if abs(height[first] - height[last]) > 0.1 * reach:
            held = [first if height[first] > height[last] else last]
            unknown.append(f"what holds the rope: {names[held[0]]}, the upper end, is taken as the held one")
        else:
            spread = np.nanvar(r.positions, axis=0).sum(axis=1)
            held = [first if spread[first] < spread[last] else last]
            unknown.append(f"what holds the rope: {names[held[0]]}, the end that moves less, is taken as the held one")
    for k in held:
        end, way = ("start", order) if k == first else ("end", order[::-1])
        if k in still:
            stays, along = _direction_stays(r.positions, way)
            if stays:
                rope[f"clamp_{end}"] = _snapped(along if end == "start" else -along)
                notes.append(f"{names[k]} stays in place and the rope keeps its direction there: a clamp")
            else:
                rope.setdefault("pinned", []).append(0 if end == "start" else -1)
                notes.append(f"{names[k]} stays in place and the rope turns there: it is pinned")
            continue
        inner = way[1]
        if inner in clamped:
            pair = [names[k], names[inner]] if end == "start" else [names[inner], names[k]]
            grips.append({"at": end, "markers": pair, "smoothing": SMOOTHING})
            notes.append(f"{names[k]} and {names[inner]} are gripped: they give the place and the direction")
            continue
        grips.append({"at": end, "markers": [names[k]], "smoothing": SMOOTHING})
        notes.append(f"{names[k]} moves the rope")
        unknown.append(
            f"whether the hand turns the rope at {names[k]}: one marker gives no direction, the end turns freely"
        )
    return {"rope": rope, "grips": grips}, notes, unknown


def _tangent(x: Array, order: tuple[int, ...]) -> Array:
    """Unit direction at the first of the markers (markers, 3), from the parabola through the first three seen."""
    own = x[[k for k in order if not np.isnan(x[k, 0])][:3]]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(own, axis=0), axis=1))])
    slope = np.linalg.lstsq(np.vander(s, 3, increasing=True), own, rcond=None)[0][1]
    return np.asarray(slope / np.linalg.norm(slope))


def _direction_stays(x: Array, order: tuple[int, ...]) -> tuple[bool, Array]:
    """Whether the direction at an end varies much less than that of the first chord, and its mean."""
    some = x[np.linspace(0, len(x) - 1, min(len(x), 80)).astype(int)]
    ways = np.array([_tangent(frame, order) for frame in some if np.isfinite(frame[list(order[:3])]).all()])
    chord = some[:, order[1]] - some[:, order[0]]
    chord = chord[np.isfinite(chord[:, 0])]
    chord = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    mean = ways.mean(axis=0)
    spread = [float(np.sqrt(v.var(axis=0).sum())) for v in (ways, chord)]
    return spread[0] < STIFF * spread[1], mean / np.linalg.norm(mean)


def _snapped(direction: Array) -> list[float]:
    """A direction, that of a coordinate axis where it is within some 15 degrees of it."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) > 0.97:
        return (np.sign(direction[k]) * np.eye(3)[k]).tolist()
    return [round(float(v), 4) for v in direction]


def _plane(x: Array, length: float) -> list[float] | None:
    """Unit normal of the plane that all markers stay in; None where there is none."""
    flat = x.reshape(-1, 3)
    flat = flat[~np.isnan(flat[:, 0])]
    _, spread, axes = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    if len(flat) < 4 or spread[2] / np.sqrt(len(flat)) > 0.02 * length:
        return None
    normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
    return _snapped(normal)


def _recording(take: Take, flat: list[float] | None) -> dict[str, Any]:
    s, r = take.seen, take.seen.recording
    entries: dict[str, Any] = {"file": take.file, "units": take.units}
    if s.static:
        axes = "".join(axis for k, axis in enumerate("xyz") if flat is None or abs(flat[k]) < 0.99)
        span = float(np.nanmax(s.apart))
        return entries | {"static": True, "sigma": max(s.noise, 0.007 * span), "axes": axes}
    start, stop = float(r.times[0]), float(r.times[-1])
    if s.rest:
        entries["start"] = "equilibrium"
    last = start + min(FITTED * (stop - start), s.rest + LONGEST)
    entries["fit"] = [start, round(last, 4)]
    entries["held_out"] = [round(last, 4), round(min(stop, last + 0.5 * (last - start) + s.rest), 4) + 1e-3]
    return entries | {"sigma": max(s.noise, 1e-4)}


def _parameters(static: bool, density: float, length: float, angles: bool) -> dict[str, dict[str, Any]]:
    scale = density * 9.81 * length**3
    found: dict[str, dict[str, Any]] = {"rope_EI": {"lower": 1e-7 * scale, "upper": 10.0 * scale}}
    if not static:
        found["rope_bend_damping"] = {"lower": 1e-5, "upper": 1.0}
        found["rope_drag_linear"] = {"lower": 1e-4 * density, "upper": 10.0 * density}
    if angles:
        found["rope_set_1"] = {"prior": [0.0, 10.0]}
        for end in ("start", "end"):
            found[f"rope_{end}_angle"] = {"private": True, "lower": -0.785, "upper": 0.785, "prior": [0.0, 0.1745]}
    return found
