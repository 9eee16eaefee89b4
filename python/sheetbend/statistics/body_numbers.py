"""What data tell of a body of which they do not tell all numbers, in words a person understands.

A body moves as ten numbers say in which the equations of motion are linear: its mass, its first moments (mass times
center), and its moments and products of inertia about the origin of its frame. Mass, center and principal moments,
which are fitted, are not linear in these. About a fixed axis motion shows three of the ten at most, the moment of
inertia about the axis and two first moments across it, and each of these depends on several of the fitted numbers. A
step of these that moves nothing is then no product of powers, and says nothing to anybody. So what is known is looked
for among the ten, and beside them among the other parameters that take part.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.rotations import cross_matrix
from ..arrays.types import Array
from .gauge import RANK_TOLERANCE, Gauge, NullSpace, signed_sum

KINDS = ("mass", "center", "inertia", "axes_turn")
_SEEN = 1e-4  # of the body's largest column, both for natural steps: what is below comes from joints that give a little
_SAME = 1e-3  # parts below this of what a step moves are rounding
_NAMED = 2e-3  # coefficients below this are left out of a sum


@dataclass(frozen=True, eq=False)
class BodyNumbers:
    """The ten numbers of a body, and how they follow from its fitted parameters.

    Attributes:
        members: the free parameters among mass, center, principal moments and axes.
        steps: (members,) a natural step of each, in internal coordinates.
        labels: of the ten.
        values: (10,) kg, kg m and kg m^2.
        slope: (10, members) their derivative in internal coordinates.
        sizes: (10,) what they are counted against.
    """

    members: tuple[str, ...]
    steps: Array
    labels: tuple[str, ...]
    values: Array
    slope: Array
    sizes: Array


def ten_numbers(p: Array, principal: Array) -> Array:
    """(10,) from mass, center, principal moments and the turn of the axes (10,), which may be complex, with the axes
    (3, 3) before they are turned."""
    frame = principal.astype(p.dtype)
    for axis in range(3):
        K = cross_matrix(np.eye(3)[axis])
        frame = (np.eye(3) + np.sin(p[7 + axis]) * K + (1.0 - np.cos(p[7 + axis])) * K @ K) @ frame
    c = p[1:4]
    about = frame * p[4:7] @ frame.T + p[0] * (np.eye(3) * (c @ c) - np.outer(c, c))
    return np.concatenate([p[:1], p[0] * c, np.diag(about), about[[0, 0, 1], [1, 2, 2]]])


def labels_of(body: str) -> tuple[str, ...]:
    first = [f"{body}_mass * {body}_center_{a}" for a in "xyz"]
    moments = [f"the moment of inertia of {body} about {a}" for a in "xyz"]
    products = [f"its product of inertia {ab}" for ab in ("xy", "xz", "yz")]
    return (f"{body}_mass", *first, *moments, *products)


def in_ten_numbers(
    space: NullSpace,
    rows: Array,
    names: Sequence[str],
    internal: Array,
    log: Sequence[bool],
    bodies: Iterable[BodyNumbers],
) -> NullSpace:
    """The same null space, in which what is known of bodies is said in their ten numbers.

    Args:
        rows: (rows, p) the Jacobian that the null space is of, in units of the standard deviation that is left.
        internal: (p,) where it was taken.
    """
    gauges, left = list(space.gauges), list(bodies)
    while left:
        body = left.pop()
        mine = _touching(gauges, body)
        while beside := [b for b in left if set(b.members) & {name for g in mine for name in g.members}]:
            body = _joined([body, *beside])
            left = [b for b in left if b not in beside]
            mine = _touching(gauges, body)
        if all(log[names.index(name)] for g in mine for name in g.members):
            continue  # products of powers are exact
        taking_part = {name for g in mine for name in g.members}
        others = sorted(taking_part - set(body.members), key=names.index)
        words = _known(body, rows, names, internal, log, others)
        members = tuple(name for name in names if name in taking_part)
        gauges = [g for g in gauges if g not in mine] + [Gauge(members, (), words)]
    return replace(space, gauges=tuple(gauges))


def _touching(gauges: Sequence[Gauge], body: BodyNumbers) -> list[Gauge]:
    return [g for g in gauges if set(g.members) & set(body.members)]


def _joined(bodies: Sequence[BodyNumbers]) -> BodyNumbers:
    """The numbers of several bodies side by side."""
    members = tuple(dict.fromkeys(m for b in bodies for m in b.members))
    slope = np.zeros((sum(len(b.labels) for b in bodies), len(members)))
    first = 0
    for b in bodies:
        slope[first : first + len(b.labels), [members.index(m) for m in b.members]] = b.slope
        first += len(b.labels)
    steps = {m: step for b in bodies for m, step in zip(b.members, b.steps, strict=True)}
    return BodyNumbers(
        members,
        np.array([steps[m] for m in members]),
        tuple(label for b in bodies for label in b.labels),
        np.concatenate([b.values for b in bodies]),
        slope,
        np.concatenate([b.sizes for b in bodies]),
    )


def _known(
    body: BodyNumbers, rows: Array, names: Sequence[str], internal: Array, log: Sequence[bool], others: Sequence[str]
) -> str:
    """What is known, in words, of the numbers of bodies and of other parameters."""
    columns = [names.index(name) for name in (*body.members, *others)]
    own, count = len(body.labels), len(body.members)
    steps = np.concatenate([body.steps, np.ones(len(others))])
    labels, sizes = (*body.labels, *others), np.concatenate([body.sizes, np.ones(len(others))])
    value = np.concatenate([body.values, [1.0 if log[c] else internal[c] for c in columns[count:]]]) / sizes
    moves = np.zeros((len(labels), len(columns)))  # by natural steps, in sizes
    moves[:own, :count] = body.slope * body.steps / body.sizes[:, None]
    moves[range(own, len(labels)), range(count, len(columns))] = 1.0
    seen, unseen = _split(rows[:, columns] * steps, count)
    if not len(seen):
        return "nothing is known of their mass, center and inertia"
    away = moves @ unseen
    varied = np.abs(moves).max(axis=1) > _SAME**2
    sure = np.flatnonzero(varied & (np.abs(away).max(axis=1, initial=0.0) < _SAME))
    chosen = _independent(moves, sure.tolist(), len(seen))
    parts = [labels[j] for j in chosen]
    if len(chosen) < len(seen):
        alike = _scaled_alike(away, value, varied)
        ratios = np.array([moves[j] / value[j] - moves[alike[0]] / value[alike[0]] for j in alike[1:]])
        known = np.vstack([moves[chosen], ratios.reshape(-1, len(columns))])
        if np.linalg.matrix_rank(known, _SAME) == len(seen):
            parts.append(f"the ratios between {_listed([labels[j] for j in alike])}")
        else:
            parts = _sums(moves, seen, labels, sizes)
    words = _listed(parts)
    about = " (moments of inertia are about the origin of the body's frame)" if "moment of inertia" in words else ""
    return f"only {words} {'are' if len(parts) > 1 or 'ratios' in words else 'is'} known{about}"


def _split(J: Array, count: int) -> tuple[Array, Array]:
    """Directions (seen, columns) that rows see, and those (columns, unseen) that they do not, of natural steps where
    these are the longest. Of the first `count` columns those that are small beside their largest count as unseen."""
    size = np.linalg.norm(J, axis=0)
    heard = size > 0.0
    heard[:count] = size[:count] > max(_SEEN * size[:count].max(initial=0.0), 1.0)
    if not heard.any():
        return np.zeros((0, len(size))), np.eye(len(size))
    triangle = np.linalg.qr(J[:, heard] / size[heard], mode="r")
    _, values, right = np.linalg.svd(triangle)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    seen, null = np.zeros((rank, len(size))), np.eye(len(size))[:, ~heard]
    seen[:, heard] = right[:rank] * size[heard]
    free = np.zeros((len(size), len(right) - rank))
    free[heard] = (right[rank:] / size[heard]).T
    return seen, np.hstack([null, free / np.abs(free).max(axis=0)])


def _independent(moves: Array, candidates: Sequence[int], most: int) -> list[int]:
    chosen: list[int] = []
    for j in candidates:
        if len(chosen) < most and np.linalg.matrix_rank(moves[[*chosen, j]], _SAME) > len(chosen):
            chosen.append(j)
    return chosen


def _scaled_alike(away: Array, value: Array, varied: Array) -> list[int]:
    """Numbers that what is unseen multiplies by one factor, the most that there are."""
    told = np.flatnonzero(np.logical_and(varied, np.abs(value) > _SAME))
    by = away[told] / value[told, None]
    groups = [told[np.abs(by - own).max(axis=1) < _SAME] for own in by if np.abs(own).max() > _SAME]
    return max(([int(j) for j in g] for g in groups), key=len, default=[])


def _sums(moves: Array, seen: Array, labels: Sequence[str], sizes: Array) -> list[str]:
    """What is known as sums of few numbers."""
    known = seen @ np.linalg.pinv(moves, _SAME) / sizes
    for row in range(len(known)):
        pivot = int(np.argmax(np.abs(known[row] * sizes)))
        known[row] /= known[row, pivot]
        for other in range(len(known)):
            if other != row:
                known[other] -= known[other, pivot] * known[row]
    for row in known:
        row[np.abs(row * sizes) < _NAMED * np.abs(row * sizes).max()] = 0.0
    found = []
    for row in known:
        order = [j for j in np.argsort(-np.abs(row * sizes)) if row[j] != 0.0]
        found.append(signed_sum([labels[j] for j in order], row[order]))
    return found


def _listed(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
