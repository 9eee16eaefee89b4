"""A rope in a recording: its markers in order, what holds it, and how it is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays.timeseries import mean_position
from ..errors import RecordingError
from .end_load import free_end
from .falls import falls
from .held import Hands, Held, held, parts
from .line import chain, snapped, tangent, turns_sharply
from .lying import table_under
from .marked import marked_by
from .one_rope import check_one_rope
from .released import released
from .rope_model import model_of
from .rope_sections import lines_of
from .rope_words import notes_of, unknown_of
from .seen import Seen
from .slid import Slip, slid
from .take import Description, Measured, Take
from .text import joined
from .unseen import freed

STANDS = 0.3  # of its length: by so much the free end of a rope is above the other one that cannot hang
FLIES = 1.2  # of its length: so far an end goes of a rope that no clamp keeps upright
LEAST_HELD = 30  # frames before a rope is let go, or before or after it slides through a hand
SLIDES = 0.2  # s, that a slip takes at most


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A rope; None where fewer than three markers are in a line."""
    s = takes[0].seen
    hands, order = parts(s)
    own = sorted((*(k for body in hands for k in body), *order))
    if len(order) < 3 or (not s.static and set(order) <= set(s.still)) or _of_a_body(s, order):  # or those of a clamp
        return None
    if len(own) < len(s.recording.markers):
        return _without_others(takes, measured, [s.recording.markers[k] for k in own])
    if not s.static and len(takes) == 1 and (let_go := released(s, order)) is not None:
        return _while_held(takes[0], measured, let_go)
    check_one_rope(s, order)
    table = table_under(s, order)
    if table is not None and table.seen.up != s.up:
        lying = describe([replace(take, seen=replace(take.seen, up=table.seen.up)) for take in takes], measured)
        hangs = f"it does not fall along {'xyz'[s.up]}: give --up {'xyz'[s.up]} if it hangs, as between two hands"
        return None if lying is None else lying._replace(notes=[*lying.notes, hangs])
    hanging = measured.weight is not None

    def holding(s: Seen, hands: Hands, order: tuple[int, ...]) -> Held:
        return _at_rest(s, order, hanging) if s.static else held(s, hands, order, lies=table is not None)

    found = holding(s, hands, order)
    if len(found.order) < 3:
        return None
    guessed = s.up_by == "guess" and s.recording.gravity is None  # and not turned already
    if guessed and table is None and not s.static and _upside_down(s, found, order):
        turned = describe([replace(take, seen=take.seen.upside_down()) for take in takes], measured)
        up = "xyz"[s.up]
        stands = f"with {up} up, it would stand on what holds it or fall upward: give --up {up} if it stands there"
        return None if turned is None else turned._replace(up=f"-{up}", notes=[*turned.notes, stands])
    if len(takes) == 1 and table is None and (slip := slid(s, found)) is not None:
        return _held_fast(takes[0], measured, slip)
    pushed = None
    if s.rest and not s.static and not found.grips and len(takes) == 1:
        free = freed(takes[0], found.order, "rope")
        if free is not None:
            takes, pushed = [free.take], free.said
            found.unknown.append(free.unknown)
    rope = model_of(marked_by(takes, found, holding), order, measured, pushed, table)
    kind = "a rope at rest" if s.static else "a rope on a table" if table is not None else "a rope"
    driving = tuple(name for here in rope.marked for grip in here.held.grips for name in grip["markers"])
    above = "xyz"[s.up] if table is not None and s.up_by == "guess" else None
    return Description(kind, notes_of(rope), unknown_of(rope), lines_of(rope), above, driving)


def _of_a_body(s: Seen, order: tuple[int, ...]) -> bool:
    """Whether some of the markers are on a rigid body, as on a box that is pushed: the line through them turns back,
    as no rope between them does."""
    return any(set(body) <= set(order) and turns_sharply(s.apart, chain(s.apart, body)) for body in s.bodies)


def _upside_down(s: Seen, found: Held, order: tuple[int, ...]) -> bool:
    return _stands(s, found) or (_flies(s, found) and falls(s, order) < 0)


def _stands(s: Seen, found: Held) -> bool:
    """Whether the free end of a rope that something moves, or that turns on a pin, is above the other one: it hangs."""
    free = free_end(found)
    if free is None or not (found.grips or "pinned" in found.rope):
        return False
    mean = mean_position(s.recording.positions)[list(found.order)]
    length = float(s.along(found.order)[-1])
    rise = (mean[0] - mean[-1]) @ s.gravity / np.linalg.norm(s.gravity)
    return bool((rise if free == "end" else -rise) > STANDS * length)


def _flies(s: Seen, found: Held) -> bool:
    """Whether a rope turns where it is held, or an end of it goes far, as that of no rod that stands in a clamp."""
    order = list(found.order)
    far = np.linalg.norm(np.nanmax(s.recording.positions, axis=0) - np.nanmin(s.recording.positions, axis=0), axis=1)
    turns = bool(found.alone) or "pinned" in found.rope
    return turns or float(far[order].max()) > FLIES * float(s.along(order)[-1])


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


def _held_fast(take: Take, measured: Measured, slip: Slip) -> Description | None:
    """The rope before it slides out of a hand, or after it where that is more than twice as long: after it, a motion
    does not begin at rest, and markers tell poorly how it begins."""
    r, what = (
        take.seen.recording,
        f"slides out of the hand ({slip.hand}) by {1e3 * slip.by:.2g} mm at {slip.time:.3g} s",
    )
    first, last = float(r.times[0]), float(r.times[-1])
    before = 2.0 * (slip.time - first) > last - slip.time
    part = r.piece(first, slip.time) if before else r.piece(min(slip.time + SLIDES, last), last)
    if len(part.times) < LEAST_HELD:
        raise RecordingError("markers", f"are on a rope that {what}", slip.hand, "grip it firmly, and record it again")
    found = describe([replace(take, seen=take.seen.of(part))], measured)
    if found is not None:
        found.notes.append(f"the rope {what}: only the time {'before' if before else 'after'} that is used")
    return found


def _at_rest(s: Seen, order: tuple[int, ...], hanging: bool) -> Held:
    """Both ends of a shape at rest in clamps, or the upper one alone."""
    mean = mean_position(s.recording.positions)
    clamps = {"clamp_start": snapped(tangent(mean, order)), "clamp_end": snapped(-tangent(mean, order[::-1]))}
    notes = ["nothing moves: a shape at rest"]
    if hanging:
        upper, free = ("start", "end") if (mean[order[-1]] - mean[order[0]]) @ s.gravity > 0 else ("end", "start")
        del clamps[f"clamp_{free}"]
        first = s.recording.markers[order[0 if upper == "start" else -1]]
        notes.append(f"its upper end, {first}, is held, and the other one hangs, as --weight says")
        return Held(
            order, clamps, notes=notes, unknown=[f"how {first} is held: in a clamp there, whose angle is fitted"]
        )
    unknown = [
        "how the ends are held: both are taken as clamps at the first and last marker, whose angles are fitted. If the "
        "lower one hangs free, give what it carries with --weight, in kg (0 if nothing)"
    ]
    return Held(order, clamps, notes=notes, unknown=unknown)
