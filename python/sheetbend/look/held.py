"""What holds a rope in a recording: ends that stay, markers that move one, a hand's rigid body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from .hand import LEAD_SD, SHIFT_SD, TILT_SD, entry
from .line import chain, plane, snapped, tangent
from .seen import CALM, Seen, fixtures, motion_of
from .text import joined

NAMES = ("hand", "grip", "wrist", "clamp", "vise", "fixture", "robot", "holder", "finger")
SMOOTHING, ALONE = 0.06, 0.12  # s, of recorded grips; of one that has one marker
DRAGS = 0.2  # s, of a hand that drags a rope over a table: friction keeps how its noise turns the rope
STIFF = 0.75  # of the next chord's: how much the direction at an end varies at most in a clamp; a pin has 1 or more
NEAR = 1.5  # times the distance of neighbors on the rope: how near its first marker is to the second
AWAY = 4.0  # times the distance of neighbors on the rope: a rigid body so far from all of them is not on it
PARTS = 2.0  # of these distances: by so much that of such a body changes at least
TURNS = 2.0  # times what it does move: how far a marker in a clamp would move if the rope turned there
UNSURE = 0.6  # times the noise: so much motion cannot be told from it
LEAST = 1e-4  # m, taken as the noise where there is less
BEYOND = 0.1  # of what the other end moves: an end that moves less, and does not stay, is beside a clamp
FIRST = 0.03  # s: an end that moves so much earlier than the other one moves the rope
HIGHER = 0.1  # of the distance of the ends: so much higher is the one that holds the rope, where neither stays


@dataclass
class Held:
    """How the ends of a rope are held.

    Attributes:
        order: markers on the rope, from its start to its end; of a grip of two markers the inner one alone.
        rope: keys of the rope.
        grips: tables of its grips.
        angles: ends whose clamps may turn by an angle that is fitted.
        alone: names of markers that move an end, which turns there.
        leads: m, by end, from what holds the rope to the marker next to it.
        priors: standard deviations of the rope's quantities that say how a hand holds it; zero is expected.
        notes, unknown: sentences about what is seen, and what is not known.
    """

    order: tuple[int, ...]
    rope: dict[str, Any] = field(default_factory=dict)
    grips: list[dict[str, Any]] = field(default_factory=list)
    angles: list[str] = field(default_factory=list)
    alone: list[str] = field(default_factory=list)
    leads: dict[str, float] = field(default_factory=dict)
    priors: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)


Hands = tuple[tuple[int, ...], ...]
"""Markers of the rigid bodies that hold a rope: none, one, or one at each end."""


def parts(s: Seen) -> tuple[Hands, tuple[int, ...]]:
    """Markers of the hands' rigid bodies, and those of the rope in order."""
    count = len(s.recording.markers)
    known = named(s)
    away = {k for b in s.bodies if not known & set(b) and _away(s, b) for k in b}
    near_rope = [b for b in s.bodies if not away & set(b)]
    near_rope += [] if s.static else fixtures(s.apart, s.still)
    hands = [b for b in near_rope if known & set(b)] or [b for b in near_rope if count - len(away) - len(b) >= 3]
    chosen = _at_the_ends(s, hands, away)
    order = _rest(s, chosen, away)
    for i, hand in enumerate(chosen):
        chosen[i], order = _with_own(s, hand, order)
    return tuple(chosen), order


def _rest(s: Seen, hands: Sequence[tuple[int, ...]], away: set[int]) -> tuple[int, ...]:
    """The markers of the rope in order."""
    left = set(range(len(s.recording.markers))) - away - {k for hand in hands for k in hand}
    return chain(s.apart, tuple(sorted(left)))


def _at_the_ends(s: Seen, bodies: Sequence[tuple[int, ...]], away: set[int]) -> list[tuple[int, ...]]:
    """The first body, and another one that is nearer to the other end of the rope."""
    for other in bodies[1:]:
        pair = [bodies[0], other]
        order = _rest(s, pair, away)
        if len(order) >= 3:
            near = [int(np.argmin([s.apart[list(body), end].min() for end in (order[0], order[-1])])) for body in pair]
            if near[0] != near[1]:
                return pair
    return list(bodies[:1])


def _with_own(s: Seen, hand: tuple[int, ...], order: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """A hand and the rope, where one of the hand's markers may be the rope's own."""
    if len(hand) <= 3 or len(order) < 3:
        return hand, order
    # the rope's own first marker keeps its place in the hand too
    near = NEAR * float(np.median([s.apart[a, b] for a, b in pairwise(order)]))
    of_body = {name.split(":")[0] for name in (s.recording.markers[k] for k in hand) if ":" in name}
    of_body -= {s.recording.markers[k].split(":")[0] for k in order}
    # what carries the name of the body, or is its place, is no marker on the rope
    solid = [k for k in hand if s.recording.markers[k].split(":")[0] not in of_body]
    pairs = [(at, k) for at in (0, -1) for k in solid if s.apart[order[at], k] <= near]
    if pairs:
        at, own = min(pairs, key=lambda pair: _slack(s, order[pair[0]], pair[1]))
        hand = tuple(k for k in hand if k != own)
        order = (own, *order) if at == 0 else (*order, own)
    return hand, order


def _away(s: Seen, body: tuple[int, ...]) -> bool:
    """Whether a rigid body is far from every other marker, at a distance that changes, as one that no rope is fixed
    to."""
    others = [k for k in range(len(s.recording.markers)) if k not in body]
    if len(others) < 3:
        return False
    spacing = float(np.median(np.sort(s.apart[np.ix_(others, others)], axis=1)[:, 1]))
    beside = s.apart[np.ix_(body, others)]
    if beside.min() <= AWAY * spacing:
        return False
    i, j = np.unravel_index(int(beside.argmin()), beside.shape)
    x = s.recording.positions
    distance = np.linalg.norm(x[:, body[i]] - x[:, others[j]], axis=1)
    return float(np.nanmax(distance) - np.nanmin(distance)) > PARTS * spacing


def _slack(s: Seen, a: int, b: int) -> float:
    """How much the distance of two markers varies, relative to itself."""
    d = np.linalg.norm(s.recording.positions[:, a] - s.recording.positions[:, b], axis=1)
    return float(np.nanstd(d) / np.nanmean(d))


def named(s: Seen) -> set[int]:
    """Markers whose names say that they are on what holds the rope."""
    return {k for k, n in enumerate(s.recording.markers) if any(word in n.lower() for word in NAMES)}


def gripping(s: Seen) -> set[int]:
    """Markers that hold something, by their names or by the file."""
    return named(s) | set(s.recording.clamped)


def held(s: Seen, hands: Hands, order: tuple[int, ...], lies: bool = False) -> Held:
    """What holds a rope that moves, or is moved over a table, whose markers are given in order."""
    still, clamped = set(s.still), gripping(s)
    found = Held(order)
    ends = {"start": order[0], "end": order[-1]}
    taken = [at for at, k in ends.items() if k in still or k in clamped]
    by_hand: list[str] = []
    for hand in hands:
        by_hand.append(_of_hand(s, hand, found, by_hand, lies))
    taken = [at for at in taken if at not in by_hand]
    if not taken and not by_hand:
        taken = [_guessed(s, found, lies)]
    for at in taken:
        way = order if at == "start" else order[::-1]
        if way[0] in still:
            _still_end(s, found, at, way)
        elif way[1] in clamped:
            _gripped_end(s, found, at, way)
        else:
            _led_end(s, found, at, way)
    _clamp_angles(s, found)
    return found


def _still_end(s: Seen, found: Held, at: str, way: tuple[int, ...]) -> None:
    """An end that stays: in a clamp that reaches over some markers, in one at the first marker, or pinned."""
    x, names = s.recording.positions, s.recording.markers
    within = _clamped_until(s, way)
    if within:
        outward = x[:, way[within]] - x[:, way[0]]
        outward = np.nanmean(outward, axis=0) / np.linalg.norm(np.nanmean(outward, axis=0))
        found.rope[f"clamp_{at}"] = snapped(outward if at == "start" else -outward)
        found.order = tuple(j for j in found.order if j not in way[:within])
        found.notes.append(
            f"{joined(names[j] for j in way[: within + 1])} stay in place: a clamp, and the rope is free from "
            f"{names[way[within]]} on"
        )
        found.unknown.append(
            f"where the clamp ends: the rope is taken to be free from {names[way[within]]} on. EI goes with the "
            "third or fourth power of the free length: measure from where the clamp ends, and correct `markers`"
        )
        return
    direction = _kept_direction(x, at, way)
    if direction is not None:
        found.rope[f"clamp_{at}"] = direction
        found.notes.append(f"{names[way[0]]} stays in place and the rope keeps its direction there: a clamp")
        found.unknown.append(
            f"where the clamp ends: at {names[way[0]]}, it is taken. EI goes with the third or fourth power of the "
            f"free length: measure how far {names[way[0]]} is from where the clamp ends"
        )
    else:
        found.rope.setdefault("pinned", []).append(0 if at == "start" else -1)
        found.notes.append(f"{names[way[0]]} stays in place and the rope turns there: it is pinned")
        found.unknown.append(
            f"whether {names[way[0]]} is where the rope is held: if a clamp holds it farther out, EI comes out wrong. "
            "Put a marker where the clamp ends"
        )


def _gripped_end(s: Seen, found: Held, at: str, way: tuple[int, ...]) -> None:
    """An end that two markers hold."""
    names = s.recording.markers
    pair = [names[j] for j in (way[:2] if at == "start" else way[1::-1])]
    found.grips.append({"at": at, "markers": pair, "smoothing": SMOOTHING})
    found.order = tuple(j for j in found.order if j != way[0])
    found.notes.append(
        f"{pair[0]} and {pair[1]} are gripped: they give the place and the direction, and the rope is free "
        f"from {names[way[1]]} on"
    )
    found.unknown.append(f"whether the rope runs through {pair[0]} and {pair[1]}, as is assumed")


def _led_end(s: Seen, found: Held, at: str, way: tuple[int, ...]) -> None:
    """An end that moves with its one marker."""
    name = s.recording.markers[way[0]]
    grip: dict[str, Any] = {"at": at, "markers": [name], "smoothing": ALONE}
    direction = _kept_direction(s.recording.positions, at, way)
    if direction is not None:
        grip["direction"] = direction
        found.notes.append(f"{name} moves the rope, which keeps its direction there: the hand does not turn")
    else:
        found.alone.append(name)
        found.notes.append(f"{name} moves the rope, which turns there")
        found.unknown.append(
            f"whether the hand turns the rope at {name}: one marker gives no direction, so the end turns "
            "freely. If it is gripped firmly, record a second marker in the hand, and name both in `markers`"
        )
    found.grips.append(grip)


def _clamped_until(s: Seen, way: tuple[int, ...]) -> int:
    """How many markers after the first one at an end stay too, where they would move if the rope turned there."""
    x = s.recording.positions
    moved = np.sqrt(np.maximum(np.nansum(np.nanvar(x[:, list(way)], axis=0), axis=1) - 3.0 * s.noise**2, 0.0))
    within = 0
    while within + 3 < len(way) and way[within + 1] in s.still:
        within += 1
    if not within:
        return 0
    turning = moved[within + 1] * s.apart[way[0], way[within]] / s.apart[way[0], way[within + 1]]
    return within if turning > TURNS * max(moved[within], UNSURE * s.noise) else 0


def _clamp_angles(s: Seen, found: Held) -> None:
    """Let clamps turn in the plane of the motion, where it has one: three markers show their direction poorly."""
    clamped = [at for at in ("start", "end") if f"clamp_{at}" in found.rope]
    order = list(found.order)
    flat = plane(s.recording.positions[:, order], float(s.apart[np.ix_(order, order)].max())) if clamped else None
    if flat is not None:
        found.rope |= {"clamp_angles": True, "plane": flat}
        found.angles += clamped
    if clamped:
        kept = "the mean over time is taken" if flat is None else "it is fitted, as an angle in the plane of the motion"
        found.unknown.append(f"the exact direction of the clamp, which the first markers show poorly: {kept}")


def _of_hand(s: Seen, hand: tuple[int, ...], found: Held, held_before: Sequence[str], lies: bool) -> str:
    """Add the grip of a hand's body; returns the end that it holds, which none held before."""
    r, order = s.recording, found.order
    x = r.positions[r.mask[:, list(hand)].any(axis=1)]
    center = np.nanmean(x[:, list(hand)], axis=1)
    reach = [float(np.nanmean(np.linalg.norm(x[:, k] - center, axis=1))) for k in (order[0], order[-1])]
    at, k = ("start", order[0]) if reach[0] <= reach[1] else ("end", order[-1])
    if at in held_before:
        at, k = ("end", order[-1]) if at == "start" else ("start", order[0])
    name, all_of = r.markers[k], joined(r.markers[j] for j in hand)
    how = "stay in place, on a body" if set(hand) <= set(s.still) else "move as one rigid body,"
    way = order if at == "start" else order[::-1]
    where = entry(s, hand, way[:1] if lies else way)  # a lead is told by a rope that hangs
    grip: dict[str, Any] = {"at": at, "markers": [r.markers[j] for j in hand], "position": where.place}
    if where.lead:
        found.notes.append(f"{all_of} {how} which holds the rope some {where.lead:.2g} m from {name}")
        found.unknown.append(
            f"where the rope leaves the hand, and in which direction: as the next markers swing, {where.lead:.2g} "
            f"m from {name}. Both are fitted: the whole rope is rope_length + rope_{at}_lead long. Measure the length "
            "from the hand to that marker, and give it as `lead` with a narrower prior. If the rope is tied there and "
            "turns freely, rope_EI becomes as small as it can, and says nothing about the rope"
        )
        found.leads[at] = grip["lead"] = where.lead
        found.rope |= {"tilts": True, "shifts": True}
        found.priors |= {f"{at}_tilt_{j}": TILT_SD for j in (1, 2)}
        found.priors |= {f"{at}_shift_{j}": SHIFT_SD * where.lead for j in (1, 2)}
        found.priors[f"{at}_lead"] = LEAD_SD * where.lead
    else:
        found.notes.append(f"{all_of} {how} which holds the rope near {name}")
        found.unknown.append(
            f"in which direction the rope leaves the hand, and where: that of its first markers, at {name}"
            + (f". The direction is fitted (`tilts`). Put {name} where the hand ends" if lies else "")
        )
    if lies:
        found.rope["tilts"] = True
        found.priors |= {f"{at}_tilt_{j}": TILT_SD for j in (1, 2)}
    found.grips.append(grip | {"smoothing": DRAGS if lies else SMOOTHING})
    return at


def _guessed(s: Seen, found: Held, lies: bool) -> str:
    """The end that is taken as the held one where none stays: the one that moves first, the upper one, or the one that
    moves less; on a table the one that moves more."""
    r, (first, last) = s.recording, (found.order[0], found.order[-1])
    starts = [_leaves(s, k) for k in (first, last)]
    height = mean_position(r.positions) @ (-s.gravity / np.linalg.norm(s.gravity))
    rise = height[first] - height[last]
    spread = np.nanvar(r.positions, axis=0).sum(axis=1)
    k, other = (first, last) if starts[0] < starts[1] else (last, first)
    apart = abs(rise) > HIGHER * float(s.apart[first, last])
    # a lower end that moves first, and more than the upper one, was let go
    let_go = apart and height[k] < height[other] and spread[k] > spread[other]
    leads = bool(s.rest) and abs(starts[0] - starts[1]) > FIRST and not let_go
    if leads:
        why = "moves first"
        found.notes.append(f"{r.markers[k]} is the end that moves first")
    elif apart:
        k, why = (first if rise > 0 else last), "is the upper end"
    else:
        k = first if (spread[first] > spread[last]) == lies else last
        why = f"moves {'more' if lies else 'less'} than the other end"
    found.unknown.append(
        f"what holds the rope: no marker stays or has a name such as hand or grip. {r.markers[k]} is taken, because it "
        f"{why}"
    )
    other = last if k == first else first
    if spread[k] < BEYOND**2 * spread[other] and not lies and not leads:
        share = np.sqrt(spread[k] / spread[other])
        found.unknown.append(
            f"what holds the rope beyond {r.markers[k]}, which moves by only {share:.0%} of what {r.markers[other]} "
            f"does: it is likely a clamp that no marker shows. The model lets the rope turn at {r.markers[k]}, and EI "
            "then comes out wrong. Put a marker where the clamp ends"
        )
    return "start" if k == first else "end"


def _leaves(s: Seen, k: int) -> float:
    """s, when a marker leaves where it was while all rested."""
    t = s.recording.times - s.recording.times[0]
    x, _ = motion_of(s.recording)
    off = np.linalg.norm(x[:, k] - mean_position(x[t <= 0.5 * s.rest])[k], axis=1)
    gone = np.flatnonzero(np.nan_to_num(off) > CALM * max(s.noise, LEAST))
    return float(t[gone[0]]) if len(gone) else float("inf")


def _kept_direction(x: Array, at: str, way: tuple[int, ...]) -> list[float] | None:
    """The mean direction of travel at an end, where it varies much less than that of the first chord; else None."""
    some = x[np.linspace(0, len(x) - 1, min(len(x), 80)).astype(int)]
    ways = np.array([tangent(frame, way) for frame in some if np.isfinite(frame[list(way[:3])]).all()])
    if not len(ways):
        return None
    chord = some[:, way[1]] - some[:, way[0]]
    chord = chord[np.isfinite(chord[:, 0])]
    chord = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    spread = [float(np.sqrt(v.var(axis=0).sum())) for v in (ways, chord)]
    if not spread[0] < STIFF * spread[1]:
        return None
    mean = ways.mean(axis=0)
    along = mean / max(float(np.linalg.norm(mean)), 1e-12)
    return snapped(along if at == "start" else -along)


def between_grips(s: Seen) -> bool:
    """Whether two or more markers hold a rope at each end."""
    _, order = parts(s)
    held_by = gripping(s) - set(s.still)
    return len(order) >= 7 and {*order[:2], *order[-2:]} <= held_by
