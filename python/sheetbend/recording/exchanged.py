"""Labels that two neighbors on a line or a sheet exchange, told by the distances to their other neighbors.

Where frames are far apart in time, markers go farther from one frame to the next than they are from each other, and no
extrapolation tells an exchange (`relabeled`). But a marker on a rope or a cloth is never much farther from its
neighbors than the material between them is long. So of two labelings of a pair, a frame costs as much as distances are
too long in it, and a change from one labeling to the other as much as it makes the markers jump: the cheapest path
through all frames (Viterbi) says when the two have each other's label. A change needs a frame in which the line from
one to the other turns by more than 90 degrees. A cloth that unfolds, whose distances are as much too long, has none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays.shortest_tree import tree
from ..arrays.timeseries import stretches
from ..arrays.types import Array

FEWEST, MANY = 20, 300  # frames at least, and those that tell distances at most
PAIRS = 10_000_000  # of markers in these frames, at most: distances then take 0.3 GB
TOO_LONG = 1.25  # times its median: a distance between neighbors that material allows at most
JUMP = 0.1  # weight of a jump, squared over the distance between neighbors
CHANGE = 0.3  # of a path, for each change
GAIN = 1.5  # by which a path with changes is at least cheaper: three frames with one distance twice as long
RIGHT = 0.5  # of a frame's cost, at most, that the exchange leaves on average
LEFT = 0.25  # of the cost of these frames, at most, that the exchange leaves


def put_back_neighbors(t: Array, positions: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Positions (frames, markers, 3) m, and a sentence on each piece of time in which two neighbors had each other's
    label."""
    count = positions.shape[1]
    if len(t) < FEWEST or count < 4:
        return positions, []
    x, said = positions.copy(), list[str]()
    most = max(FEWEST, min(MANY, PAIRS // count**2))
    some = x[:: -(-len(x) // most)]
    distance = np.linalg.norm(some[:, :, None] - some[:, None], axis=3)
    if not np.isfinite(distance).any(axis=0).all():
        return positions, []
    apart = np.nanmedian(distance, axis=0)
    if not apart[~np.eye(count, dtype=bool)].all():
        return positions, []
    joined, _ = tree(apart, tuple(range(count)))
    for a in range(count):
        for b in sorted(k for k in joined[a] if k > a):
            beside = [(j, k) for j, other in ((a, b), (b, a)) for k in joined[j] - {other} or {_next(apart, j, other)}]
            for first, last in _pieces(x, a, b, beside, apart):
                x[first : last + 1, [a, b]] = x[first : last + 1, [b, a]]
                said.append(
                    f"{names[a]} and {names[b]} have each other's label from {t[first]:.4g} to {t[last]:.4g} s, or "
                    "their distances to their neighbors would be far too long: put back"
                )
    return x, said


def _next(apart: Array, a: int, b: int) -> int:
    """The nearest marker to a beside b: at an end too, a marker that is elsewhere has distances that are too long."""
    return int(np.argmin(np.where(np.isin(np.arange(len(apart)), (a, b)), np.inf, apart[a])))


def _pieces(x: Array, a: int, b: int, beside: list[tuple[int, int]], apart: Array) -> list[tuple[int, int]]:
    """First and last frames of the pieces in which markers a and b have each other's label."""
    cost = np.zeros((2, len(x)))
    for k, other in beside:
        for labeling, own in enumerate((k, b if k == a else a)):
            off = np.linalg.norm(x[:, own] - x[:, other], axis=1) / apart[k, other]
            cost[labeling] += np.nan_to_num(np.maximum(off - TOO_LONG, 0.0) ** 2)
    if (cost[0] > cost[1]).sum() < 2:
        return []
    size = apart[a, b] ** 2
    same, crossed = np.zeros(len(x)), np.zeros(len(x))
    seen: dict[int, Array] = {}
    for f in range(len(x)):
        now = {k: x[f, k] for k in (a, b) if np.isfinite(x[f, k, 0])}
        for k, place in now.items():
            other = b if k == a else a
            if k in seen and other in seen:
                same[f] += JUMP * float(np.sum((place - seen[k]) ** 2)) / size
                crossed[f] += JUMP * float(np.sum((place - seen[other]) ** 2)) / size
        seen |= now
    crossed[~_turns(x[:, b] - x[:, a])] = np.inf
    best, came = np.array([cost[0, 0], cost[1, 0] + CHANGE]), np.zeros((len(x), 2), int)
    for f in range(1, len(x)):
        stay, change = best + same[f], best[::-1] + crossed[f] + CHANGE
        came[f] = np.where(stay <= change, [0, 1], [1, 0])
        best = np.minimum(stay, change) + cost[:, f]
    state = np.zeros(len(x), int)
    state[-1] = int(best[1] < best[0])
    for f in range(len(x) - 1, 0, -1):
        state[f - 1] = came[f, state[f]]
    return [
        (i, j - 1)
        for i, j in stretches(state)
        if j - i < len(x)  # labels that are exchanged in all frames are not found
        and (before := cost[0, i:j].sum()) - cost[1, i:j].sum() > GAIN
        and cost[1, i:j].sum() < LEFT * before
        and cost[1, i:j].mean() < RIGHT  # else one of them is elsewhere
    ]


def _turns(line: Array) -> NDArray[np.bool_]:
    """(frames,) whether a line (frames, 3), NaN where an end is lost, turns by more than 90 degrees between the frames
    about each in which it is seen."""
    found, seen = np.zeros(len(line), bool), np.flatnonzero(np.isfinite(line[:, 0]))
    turned = (line[seen[1:]] * line[seen[:-1]]).sum(axis=1) < 0.0
    for before, here in zip(seen[:-1][turned], seen[1:][turned], strict=True):
        found[before + 1 : here + 1] = True
    return found
