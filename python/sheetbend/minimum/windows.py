"""Short windows that a fit goes through first: pieces of every motion from its scene's start on.

Over a long motion the cost is rugged far from its minimum; over a short window from the same start it is smooth, and a
run of it costs less. Which lengths help follows from the motion: parts of its duration, each some times the one before,
and where small displacements grow, the times at which they have grown by some more orders of magnitude (`growth`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..errors import InputError
from ..problem.problem import FitProblem
from .approach import Approach, Tally
from .growth import ROUGH, Growth
from .progress import Observer, Progress

SHARES = (1 / 27, 1 / 9, 1 / 3)  # of the longest motion
GROWN = (30.0, 1e3, ROUGH)
FRAMES = 6  # that the shortest window holds of every motion
ROWS = 2  # residuals for each parameter
APART = 1.3  # factor between neighbors
TOLERANCE, STEPS = 1e-2, 40  # of the cost, and at most: a window's minimum is only a start
BACK = 0.1  # of the length: where windows so little longer diverge, there is no way on


def chosen(problem: FitProblem, growths: Sequence[Growth]) -> tuple[float, ...]:
    """Lengths of windows in s, increasing; none for static experiments or short recordings.

    Args:
        growths: of the problem's motions where the fit starts.
    """
    moving = [(e, r) for e, r in zip(problem.experiments, problem.recordings, strict=True) if not e.static]
    if not moving:
        return ()
    spans = [r.times - e.t0 for e, r in moving]
    longest = max(float(t[-1]) for t in spans)
    least = max(float(t[min(FRAMES, len(t)) - 1]) for t in spans)
    grown = [until for limit in GROWN for g in growths if (until := g.below(limit)) is not None]
    # Past the frame at this time, since a window ends before its own length.
    safe = min(grown, default=np.inf)
    wanted = [share * longest for share in SHARES if share * longest < safe] + grown
    lengths: list[float] = []
    for length in sorted(wanted):
        far_enough = not lengths or length > APART * lengths[-1]
        if least < length < longest / APART and far_enough and _determined(problem, length):
            lengths.append(float(length))
    return tuple(lengths)


def cut(problem: FitProblem, length: float, corrected: bool = False) -> FitProblem:
    """The problem with the first `length` s of every motion from its scene's start on, markers that scenes follow taken
    for the truth, or corrected as in the problem itself.

    Raises:
        InputError: a motion has no fitted frame there.
    """
    pieces = []
    for e, recording in zip(problem.experiments, problem.recordings, strict=True):
        last = e.t0 + length
        if not e.static and not (recording.times < last).any():
            fix = "make it longer, or leave it out"
            raise InputError("windows", f"hold no fitted frame of '{e.name}'", length, fix)
        pieces.append(recording if e.static else recording.piece(None, last))
    return problem.on(pieces) if corrected else problem.uncorrected(pieces)


def along(
    whole: FitProblem,
    lengths: Sequence[float],
    u: np.ndarray,
    tally: Tally,
    part_of: Callable[[FitProblem, float], FitProblem] | None = None,
) -> Iterator[tuple[float, Approach]]:
    """Window after window, each with a walk that begins where the one before was left, for the caller to walk, as do
    starts that are estimated; where one diverges at the values of the one before, one in between comes first. The
    length of the whole motion is infinite. Where there is no way on, the whole motion comes last, with an infinite cost
    or not.

    Args:
        part_of: makes the problem of a window; `cut` by default.
    """
    longest = max(float(r.times[-1]) - e.t0 for e, r in zip(whole.experiments, whole.recordings, strict=True))
    ahead, reached, made, before = [*lengths], 0.0, part_of or cut, whole
    while ahead:
        part = whole if math.isinf(ahead[0]) else made(whole, ahead[0])
        walk = Approach(part.follow(before), u, tally)
        if math.isfinite(walk.cost):
            reached, before = ahead.pop(0), part
            yield reached, walk
            u = walk.u
            continue
        upto = min(ahead[0], longest)
        between = 0.5 * (reached + upto)
        if upto - reached < BACK * upto or not holds_frames(whole, between):
            yield math.inf, Approach(whole.follow(before), u, tally)
            return
        ahead.insert(0, between)


def through(whole: FitProblem, lengths: Sequence[float], u: np.ndarray, observe: Observer) -> np.ndarray:
    """(free,) where walks through windows end, for a walk on the whole motion to begin at."""
    for length, walk in along(whole, [*lengths, math.inf], u, Tally()):
        if math.isinf(length):
            return walk.u
        for _ in walk.steps(STEPS, TOLERANCE):
            observe(Progress(walk.iterations, walk.cost, walk.u.copy(), length))
    raise AssertionError("the whole motion comes last")


def holds_frames(problem: FitProblem, length: float) -> bool:
    """Whether every motion has two fitted frames within `length` s."""
    pairs = zip(problem.experiments, problem.recordings, strict=True)
    return all(e.static or bool((r.times < e.t0 + length).sum() >= 2) for e, r in pairs)


def _determined(problem: FitProblem, length: float) -> bool:
    rows = sum(
        e.rows_each * int(r.mask[r.times < e.t0 + length].sum() if not e.static else r.mask.sum())
        for e, r in zip(problem.experiments, problem.recordings, strict=True)
    )
    return rows >= ROWS * len(problem.parameters.free)
