"""Pieces of one marker's path under several names: what a motion capture system that knows no label calls a marker
that it lost and found again.

A piece goes on a path that ended before it begins, if both, led on along their last and first speeds, meet half-way.
They must meet nearer to each other than half of the distance to any other marker.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays.types import Array

LONGEST = 0.5  # s, for which a marker is lost, at most
LED = 0.05  # s, over which a speed is taken
NEAR = 0.5  # of the distance to the next marker


def joined(
    times: Array, positions: Array, names: Sequence[str], unnamed: Sequence[bool]
) -> tuple[Array, tuple[str, ...], dict[str, list[str]]]:
    """Positions (frames, markers, 3), names, and what was joined to each: pieces under names that mean nothing are put
    behind the paths that they go on.

    Args:
        unnamed: (markers,) whether a name was made up by the system.
    """
    x = positions.copy()
    kept = {k: [k] for k in range(len(names))}
    spans = {k: _span(x[:, k]) for k in kept if unnamed[k]}
    links = sorted((found, a, b) for b in spans for a in spans if (found := _gap(times, x, spans, a, b)) is not None)
    after: dict[int, int] = {}
    for _, a, b in links:
        if a not in after and b not in after.values():
            after[a] = b
    for first in sorted(set(after) - set(after.values())):
        at = first
        while at in after:
            at = after[at]
            seen = np.isfinite(x[:, at, 0])
            x[seen, first] = x[seen, at]
            kept[first].append(at)
            del kept[at]
    more = {names[k]: [names[j] for j in pieces[1:]] for k, pieces in kept.items() if len(pieces) > 1}
    return x[:, list(kept)], tuple(names[k] for k in kept), more


def _span(x: Array) -> tuple[int, int]:
    seen = np.flatnonzero(np.isfinite(x[:, 0]))
    return int(seen[0]), int(seen[-1])


def _gap(times: Array, x: Array, spans: dict[int, tuple[int, int]], a: int, b: int) -> float | None:
    """m between the ends of path a and of piece b, led on to half-way; None where b does not go on a."""
    last, first = spans[a][1], spans[b][0]
    gap = times[first] - times[last]
    if not 0.0 < gap <= LONGEST:
        return None
    ahead = _led(times, x[:, a], times[last] - LED, times[last], last, 0.5 * gap)
    back = _led(times, x[:, b], times[first], times[first] + LED, first, -0.5 * gap)
    found = float(np.linalg.norm(ahead - back))
    others = np.delete(x[[last, first]], [a, b], axis=1) - x[[last, first], [a, b]][:, None]
    nearest = np.linalg.norm(others, axis=2)
    nearest = nearest[np.isfinite(nearest)]
    return found if not len(nearest) or found < NEAR * nearest.min() else None


def _led(times: Array, x: Array, start: float, stop: float, at: int, by: float) -> Array:
    """(3,) where a marker seen in frame `at` is after `by` s, at its mean speed from start to stop."""
    near = (times >= start - 1e-9) & (times <= stop + 1e-9) & np.isfinite(x[:, 0])
    if near.sum() < 2:
        return x[at]
    t = times[near] - times[at]
    speed = np.polynomial.polynomial.polyfit(t, x[near], 1)[1]
    return np.asarray(x[at] + by * speed)
