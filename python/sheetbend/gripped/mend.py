"""Mends a single recording of a gripped rope: lost frames, exchanged neighbors or labels, markers seen elsewhere, and
tracking that froze or wrote zeros.

All but the usual lengths of links are found from the recording alone. Two neighbors are exchanged at a frame at which
the direction from one to the other turns round, and throughout where the line through all markers is then shorter,
unless the rope folds back at its grip (`end_links`). A marker is elsewhere between two jumps that no rope makes, and
frozen where its numbers repeat exactly although the frame before or after shows it moving.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import mean_position, stretches
from ..arrays.types import Array
from ..recording.leaps import elsewhere, leaps, least_leap
from ..recording.recording import Recording
from ..recording.relabeled import put_back
from .end_links import EndLink, end_link
from .lost_frames import on_time

Mask = NDArray[np.bool_]

TURNED = -0.5  # cosine of the angle by which two neighbors turn from frame to frame when they are exchanged
STRETCHED = 2.0  # by which their distance changes at most in that
FORGOTTEN = 0.1  # s, after which directions are not compared any more
SHORTER = 0.8  # links in another order over given, below which markers are taken in that order; at an end `end_links`
REPEATS, LASTS = 5, 0.05  # frames and s of equal numbers that count as frozen
STEP = 5e-3  # m, that a frozen marker goes at once before or after
HELD = 10  # more such times: then the file was made from fewer frames, and nothing froze


def mended(
    recording: Recording, inner: tuple[int, int], usual: Array | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """The recording with exchanged neighbors back in place and impossible samples not seen (NaN), and what was done.

    Args:
        recording: of a rope with its gripped markers named.
        inner: numbers of the two inner gripped markers.
        usual: (markers - 1,) m, lengths of the links in other recordings of the rope (`usual_links`).

    Returns:
        The recording, the same object where nothing was wrong, and a sentence on each thing that was.
    """
    recording, told = on_time(recording)
    times, tracks = recording.times, range(recording.positions.shape[1])
    least, lost = _least_jump(times, recording.positions), _written_as_zeros(recording)
    positions, words = _in_order(recording, inner, usual)
    words = [*told, *_each(recording, lost, "lay exactly at the origin"), *words]
    frozen = np.stack([_frozen(times, positions[:, k]) for k in tracks], axis=1) & ~_resting(positions)[:, None]
    frozen |= _stopped(times, positions)[:, None]
    positions[frozen] = np.nan
    stray = np.stack([elsewhere(times, positions[:, k], least) for k in tracks], axis=1)
    positions[stray] = np.nan
    words += _each(recording, frozen, "stood still although the rope moved")
    words += _each(recording, stray, "jumped elsewhere")
    if not words:
        return recording, ()
    return replace(recording, positions=positions), tuple(words)


def steadied_order(recording: Recording) -> tuple[Array, Mask]:
    """Positions (frames, markers, 3) m with the same order of neighbors in all frames, that of most frames, and NaN in
    place of zeros; (pairs, frames) where a pair was exchanged for that."""
    positions = np.where(_written_as_zeros(recording)[:, :, None], np.nan, recording.positions)
    wrong = np.zeros((positions.shape[1] - 1, len(positions)), dtype=bool)
    least = _least_jump(recording.times, positions)
    for k in range(len(wrong)):
        state = _turned(recording.times, positions[:, k], positions[:, k + 1], least)
        wrong[k] = state if 2 * state.sum() <= len(state) else ~state
        _exchange(positions, k, wrong[k])
    return positions, wrong


def _in_order(recording: Recording, inner: tuple[int, int], usual: Array | None) -> tuple[Array, list[str]]:
    """Positions (frames, markers, 3) m with neighbors exchanged back in place, and words on each exchange."""
    positions, wrong = steadied_order(recording)
    positions, words = put_back(recording.times, positions, recording.markers)  # of markers that are no neighbors
    of = {inner[0] - 1: " of the first grip", inner[1]: " of the last grip"}
    names = {k: f"{a} and {b}{of.get(k, '')}" for k, (a, b) in enumerate(pairwise(recording.markers))}
    exchanged, ends = _throughout(positions, inner, usual)
    for k in exchanged:
        wrong[k] = ~wrong[k]
    for k in np.flatnonzero(wrong.any(axis=1)).tolist():
        or_else = f" (or the rope folds back there: {ends[k].words})" if k in ends and not ends[k].clear else ""
        words.append(f"{names[k]} were exchanged {_when(recording, wrong[k])}, and are put back{or_else}")
    for k, end in ends.items():
        if end.in_order:
            or_else = "" if end.clear else ", or they were exchanged throughout"
            words.append(f"the rope folds back at {names[k]}, which stay as they are{or_else}: {end.words}")
    return positions, words


def _turned(times: Array, first: Array, second: Array, least: float) -> Mask:
    """(frames,) whether two neighbors (frames, 3) are the other way round than in the first frame. The place halfway
    between them does not jump where they are exchanged, as it does where one of them is seen elsewhere."""
    along, middle = second - first, 0.5 * (first + second)
    seen = np.flatnonzero(np.isfinite(along[:, 0]))
    distance = np.maximum(np.linalg.norm(along[seen], axis=1), np.finfo(float).tiny)
    d = along[seen] / distance[:, None]
    turned = np.zeros(len(times), dtype=int)
    turned[seen[1:]] = (
        ((d[1:] * d[:-1]).sum(axis=1) < TURNED)
        & (np.abs(np.diff(np.log(distance))) < np.log(STRETCHED))
        & (np.diff(times[seen]) <= FORGOTTEN)
        & (np.linalg.norm(leaps(times[seen], middle[seen]), axis=1) <= least)
    )
    return np.asarray(np.cumsum(turned) % 2 == 1)


def _throughout(positions: Array, inner: tuple[int, int], usual: Array | None) -> tuple[list[int], dict[int, EndLink]]:
    """Exchanges pairs of neighbors back that are so in all frames, by their first markers, as long as the line through
    all markers becomes clearly shorter about them; and the links behind pairs at an end whose order was in question."""
    distance = mean_position(np.linalg.norm(positions[:, :, None] - positions[:, None], axis=3))
    order = list(range(positions.shape[1]))
    done: list[int] = []
    last = len(order) - 2
    ends = {k: end_link(positions, outer, inner, usual) for k, outer in ((0, 0), (last, last + 1))}

    def gain(k: int) -> float:
        """By how much the links beside a pair become shorter when it is exchanged; 0 where that is not clear."""
        a, b = order[k], order[k + 1]
        before, after = order[k - 1 : k] if k else [], order[k + 2 : k + 3]
        given = sum(distance[c, a] for c in before) + sum(distance[b, c] for c in after)
        exchanged = sum(distance[c, b] for c in before) + sum(distance[a, c] for c in after)
        if before and after:
            return float(given - exchanged) if exchanged < SHORTER * given else 0.0
        link = ends[k] if k not in done else None
        return float(given - exchanged) if link is not None and not link.in_order else 0.0

    while True:
        gains = [gain(k) for k in range(len(order) - 1)]
        best = int(np.argmax(gains))
        if gains[best] <= 0.0:
            return done, {k: link for k, link in ends.items() if link is not None}
        order[best], order[best + 1] = order[best + 1], order[best]
        _exchange(positions, best, np.ones(len(positions), dtype=bool))
        done.append(best)


def _exchange(positions: Array, k: int, which: Mask) -> None:
    """Exchange markers k and k + 1 in some frames."""
    frames = np.flatnonzero(which)[:, None]
    positions[frames, [k, k + 1]] = positions[frames, [k + 1, k]]


def _written_as_zeros(recording: Recording) -> Mask:
    """(frames, markers) written as zeros."""
    least = _least_jump(recording.times, recording.positions)
    tracks = range(recording.positions.shape[1])
    return np.stack([_at_origin(recording.positions[:, k], least) for k in tracks], axis=1)


def _at_origin(track: Array, least: float) -> Mask:
    """(frames,) where the positions (frames, 3) are zero and those beside far from it: how some software writes markers
    that it does not see."""
    zero = (track == 0.0).all(axis=1)
    lost, far = np.zeros(len(track), dtype=bool), np.linalg.norm(track, axis=1) > least
    for first, end in stretches(zero):
        lost[first:end] = any(far[i] for i in (first - 1, end) if 0 <= i < len(track))
    return lost


def _frozen(times: Array, track: Array) -> Mask:
    """(frames,) where the positions (frames, 3) of a moving marker repeat."""
    step = np.linalg.norm(np.diff(track, axis=0), axis=1)
    frozen, count = np.zeros(len(times), dtype=bool), 0
    for first, last in stretches(step == 0.0):
        around = step[[i for i in (first - 1, last) if 0 <= i < len(step)]]
        long = last - first + 1 >= REPEATS and times[last] - times[first] >= LASTS
        if long and (around > STEP).any():
            frozen[first + 1 : last + 1] = True
            count += 1
    return frozen if count <= HELD else np.zeros_like(frozen)


def _resting(positions: Array) -> Mask:
    """(frames,) before and after the motion, in which every marker that is seen repeats."""
    resting = np.zeros(len(positions), dtype=bool)
    for first, last in stretches(_same(positions)):
        if first == 0 or last == len(positions) - 1:
            resting[first : last + 1] = True
    return resting


def _stopped(times: Array, positions: Array) -> Mask:
    """(frames,) at the end, in which every marker repeats although the frame before shows one moving: no rope stops at
    once."""
    stopped, runs = np.zeros(len(times), dtype=bool), stretches(_same(positions))
    if not runs or len(runs) > HELD:
        return stopped
    first, last = runs[-1]
    long = last - first + 1 >= REPEATS and times[last] - times[first] >= LASTS
    if last == len(times) - 1 and first > 0 and long:
        step = np.linalg.norm(positions[first] - positions[first - 1], axis=1)
        stopped[first + 1 :] = (step > STEP).any()
    return stopped


def _same(positions: Array) -> Mask:
    """(steps,) in which every marker that is seen repeats."""
    step = np.diff(positions, axis=0)
    return np.asarray(((step == 0.0) | np.isnan(step)).all(axis=(1, 2)))


def _least_jump(times: Array, positions: Array) -> float:
    """m, between two frames, that no marker makes."""
    chords = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    length = float(np.nansum(mean_position(chords)))
    return least_leap(times, length)


def _each(recording: Recording, where: Mask, what: str) -> list[str]:
    """Words on samples (frames, markers) that are not used; markers with the same frames share a sentence."""
    names: dict[str, list[str]] = {}
    for k in np.flatnonzero(where.any(axis=0)):
        names.setdefault(_when(recording, where[:, k]), []).append(recording.markers[k])
    count = len(recording.markers)
    return [
        f"{', '.join(those) if len(those) < count else 'all markers'} {what} {when}: not used there"
        for when, those in names.items()
    ]


def _when(recording: Recording, frames: Mask) -> str:
    """Where frames are marked: a phrase."""
    if frames.all():
        return "throughout"
    if frames.sum() == 1:
        (only,) = np.flatnonzero(frames)
        return f"in frame {only} ({recording.times[only]:.4g} s)"
    first, end = zip(*stretches(frames), strict=True)
    start, stop = recording.times[first[0]], recording.times[end[-1] - 1]
    if len(first) == 1 and end[0] == len(frames):
        return f"from frame {first[0]} ({start:.4g} s) on"
    times = "" if len(first) == 1 else f"{len(first)} times "
    return f"{times}from frame {first[0]} to {end[-1] - 1} ({start:.4g} to {stop:.4g} s)"
