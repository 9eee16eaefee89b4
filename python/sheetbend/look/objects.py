"""Whether a recording shows one object, or several that nothing seen joins.

Markers at a typical spacing are one group. A wider gap parts two groups: it is one between what holds an object and the
object, or between two objects.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np

from ..arrays.shortest_tree import tree
from ..errors import RecordingError
from .held import gripping
from .seen import RIGID, Seen, distances, fixtures, in_line, is_sheet, rigid
from .text import joined

Group = tuple[int, ...]
FEWEST = 3  # markers that make an object
GAP = 2.5  # times the widest spacing in two groups, from which on a distance between them is none along an object
BESIDE = 1.9  # the same of two lines of markers that are beside each other all along
LEVEL = 1.25  # times the median of their distances from each other: how far such lines are from each other at most
LONG = 1.5  # times this median: how long they are at least
LOOSE = 0.02  # of their distance: by so much that of two objects changes, a standard deviation
BOTH = 1.5  # times the distance to the nearest object: what is nearer to another one may hold this one too
COUNTS = {2: "two", 3: "three", 4: "four"}


def check_one_object(s: Seen) -> None:
    """Refuse a recording of several objects that no model joins; several cloths are drafted together.

    Raises:
        RecordingError: the markers are those of several ropes, beams, bodies or pendulums, or of a rope and a cloth.
    """
    if s.static:
        _check_one_at_rest(s)
        return
    _check_one_pivot(s)
    groups = _groups(s)
    kinds = {group: _kind(s, group) for group in groups}
    objects = _parted(s, [group for group in groups if kinds[group] == "bends"])
    bodies = [group for group in groups if kinds[group] == "body"]
    wide = {k for group in groups if _is_sheet(s, group) for k in group}  # several rows of a cloth may look like one
    sheets = [bool(wide & set(own)) for own in objects]
    what = "ropes, or of one with a long part that no marker shows"
    if not objects:
        objects, what = bodies, "rigid bodies with nothing seen between them"
    elif any(sheets):
        what = "objects: ropes and cloths"
    elif beams := [body for body in bodies if _on_its_own(s, body, objects, groups, kinds)]:
        objects, what = [*objects, *beams], "objects: ropes and beams"
    elif s.sheet:  # rows of a cloth that are far apart, or one rope far from a body that is no hand of it
        objects = [*objects, *bodies] if len(objects) == 1 else []
        what = "objects: a rope and rigid bodies"
    if len(objects) < 2 or (sheets and all(sheets)):
        return
    whole = _with_holders(s, objects, groups)
    more = ""
    if "one" in what:
        more = "; of one rope, record markers between them"
    if "bodies" in what:
        more = "; of bodies on a hinge, write the configuration by hand, see docs/configuration.md"
    raise _several(s, whole, what, more)


def _check_one_at_rest(s: Seen) -> None:
    """Refuse several ropes at rest; markers on what holds a rope lie on no line."""
    groups = _groups(s)
    lines = [group for group in groups if not fixtures(s.apart, group)]
    if len(lines) > 1 and not any(_is_sheet(s, group) for group in groups):
        what = "ropes at rest, or of one with a long part that no marker shows"
        raise _several(s, _with_holders(s, lines, groups), what, "; of one rope, record markers between them")


def _check_one_pivot(s: Seen) -> None:
    """Refuse several pendulums: all that moves keeps its distance from something that stays, and not from the others.

    Of one pendulum with several arms, the outer ones do not keep it from what stays.
    """
    moving = [k for k in range(len(s.recording.markers)) if k not in s.still]
    keeps = np.nanstd(distances(s.recording.positions), axis=0) <= np.maximum(RIGID * s.noise, 1e-3 * s.apart)
    if s.sheet or not s.still or not keeps[np.ix_(moving, s.still)].any(axis=1).all():
        return
    found, left = list[Group](), list(moving)
    while left:
        own = [k for k in left if keeps[left[0], k]]
        left = [k for k in left if k not in own]
        pivots = [k for k in s.still if keeps[own, k].all()]
        found.append((*sorted(pivots, key=lambda k: float(s.apart[own, k].max()))[:1], *own))
    if len(found) > 1:
        raise _several(s, found, "pendulums that swing apart from each other", "")


def _several(s: Seen, objects: Sequence[Group], what: str, more: str) -> RecordingError:
    names = s.recording.markers
    fix = "draft one at a time, with --markers " + " or --markers ".join(f"'{_pattern(names, own)}'" for own in objects)
    got = "; and ".join(joined(names[k] for k in own) for own in objects)
    return RecordingError("markers", f"are those of {COUNTS.get(len(objects), len(objects))} {what}", got, fix + more)


def _groups(s: Seen) -> list[Group]:
    """Groups of three or more markers between which the shortest tree through all has gaps, without those that hold."""
    holds = gripping(s)
    everyone = tuple(k for k in range(len(s.recording.markers)) if k not in holds)
    if len(everyone) < 2 * FEWEST:
        return []
    neighbors, _ = tree(s.apart, everyone)
    edges = sorted((float(s.apart[a, b]), a, b) for a, near in neighbors.items() for b in near if a < b)
    of, widest = {k: [k] for k in everyone}, dict.fromkeys(everyone, 0.0)
    connected = {k: [k] for k in everyone}
    for length, a, b in edges:
        parts = [connected[a], connected[b]]
        spacing = max(widest[k] for part in parts for k in part)
        if min(map(len, parts)) < FEWEST or length <= _gap(s, parts) * spacing:
            for k in parts[0] + parts[1]:
                widest[k] = max(spacing, length)
            together = of[a] + of[b]
            of |= dict.fromkeys(together, together)
        whole = parts[0] + parts[1]
        connected |= dict.fromkeys(whole, whole)
    return sorted({tuple(sorted(own)) for own in of.values() if len(own) >= FEWEST})


def _gap(s: Seen, parts: Sequence[Sequence[int]]) -> float:
    """Times the spacing, from which on a distance between two parts is a gap."""
    return BESIDE if not s.sheet and _beside(s, *parts) else GAP


def _kind(s: Seen, group: Group) -> str:
    """How a group moves: it "stays", is one rigid "body" or a straight "bar", or "bends"."""
    if set(group) <= set(s.still):
        return "stays"
    own = s.recording.noise()[list(group)]
    noise = float(np.nanmax(own)) if np.isfinite(own).any() else s.noise
    if not rigid(s.recording.positions[:, list(group)], noise):
        return "bends"
    return "bar" if in_line(s.apart[np.ix_(group, group)]) else "body"


def _is_sheet(s: Seen, group: Group) -> bool:
    place = {k: i for i, k in enumerate(group)}
    bodies = [own for body in s.bodies if (own := [place[k] for k in body if k in place])]
    still = [place[k] for k in s.still if k in place]
    return is_sheet(s.recording.positions[:, list(group)], s.apart[np.ix_(group, group)], bodies, still)


def _on_its_own(
    s: Seen, body: Group, objects: Sequence[Group], groups: Sequence[Group], kinds: Mapping[Group, str]
) -> bool:
    """Whether a body is nearer to a group that stays than both are to other objects, as the end of a beam to its
    clamp."""

    def far(one: Group, others: Sequence[Group]) -> float:
        return min(float(s.apart[np.ix_(one, other)].min()) for other in others)

    clamps = [group for group in groups if kinds[group] == "stays"]
    return any(far(body, [clamp]) < min(far(body, objects), far(clamp, objects)) for clamp in clamps)


def _parted(s: Seen, groups: Sequence[Group]) -> list[Group]:
    """Groups that bend, one for all that may be parts of one object."""
    left, found = list(groups), list[Group]()
    while left:
        own = left.pop(0)
        while more := [other for other in left if not _apart(s, own, other)]:
            left = [other for other in left if other not in more]
            own = tuple(sorted({*own, *(k for other in more for k in other)}))
        found.append(own)
    return found


def _apart(s: Seen, one: Group, other: Group) -> bool:
    """Whether two groups are two objects: one alone is a sheet, their distance changes or is longer than both, or they
    are two lines beside each other."""
    if _is_sheet(s, one) != _is_sheet(s, other):
        return True
    i, j = np.unravel_index(int(s.apart[np.ix_(one, other)].argmin()), (len(one), len(other)))
    a, b = one[i], other[j]
    x = s.recording.positions
    changes = np.nanstd(np.linalg.norm(x[:, a] - x[:, b], axis=1)) > LOOSE * s.apart[a, b]
    longer = max(tree(s.apart, own)[1] for own in (one, other))
    return bool(changes or s.apart[a, b] > longer or _beside(s, one, other))


def _beside(s: Seen, one: Sequence[int], other: Sequence[int]) -> bool:
    """Whether two lines of markers are beside each other all along, as two ropes on one bar."""
    across = s.apart[np.ix_(one, other)]
    gaps = np.concatenate([across.min(axis=0), across.min(axis=1)])
    long = all(s.apart[np.ix_(own, own)].max() > LONG * np.median(gaps) for own in (one, other))
    return bool(long and gaps.max() < LEVEL * np.median(gaps))


def _with_holders(s: Seen, objects: Sequence[Group], groups: Sequence[Group]) -> list[Group]:
    """Each object with the markers beside it that may hold it: of several groups of these, each holds the nearest
    one."""
    whole = [set(own) for own in objects]
    left = set(range(len(s.recording.markers))) - set[int]().union(*whole)
    holders = [group for group in groups if left.issuperset(group)]
    holders += [(k,) for k in left.difference(*holders)]
    for group in holders:
        far = [float(s.apart[np.ix_(group, own)].min()) for own in objects]
        shared = BOTH if len(holders) < len(objects) else 1.0
        for own, away in zip(whole, far, strict=True):
            if away <= shared * min(far):
                own.update(group)
    return [tuple(sorted(own)) for own in whole]


def _pattern(names: Sequence[str], own: Sequence[int]) -> str:
    """What --markers takes for these markers: the beginnings of names that no other marker has, with *."""
    others = [name for k, name in enumerate(names) if k not in set(own)]
    found = list[str]()
    for name in (names[k] for k in own):
        if any(fnmatchcase(name, pattern) for pattern in found):
            continue
        plain = re.sub(r"[\[\]*,?]", "?", name)
        begins = (f"{plain[:length]}*" for length in range(1, len(plain)))
        short = (p for p in begins if not any(fnmatchcase(other, p) for other in others))
        pattern = next(short, plain)
        alone = sum(fnmatchcase(names[k], pattern) for k in own) == 1
        found.append(plain if alone else pattern)
    return ",".join(found)
