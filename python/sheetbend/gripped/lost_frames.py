"""Frames that a recorder of a gripped rope lost without a mark: it repeats the frame before in their place, or counts
on as if there had been none.

A repeated frame is stamped later than what it shows, and is left out. A frame that is missing makes all markers step
about twice as far from one frame to the next, which no rope does; the times after it are then moved on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import stretches
from ..arrays.types import Array
from ..recording.recording import Recording

REPEATS = 5  # frames in a row, from which on it is frozen tracking or a file that was made from fewer frames
MOVES = 2e-3  # m, that a marker goes at least before or after a repeated frame: of a rope at rest frames may be equal
BESIDE = 3  # steps before and after, whose medians tell the usual velocity
FARTHER = 1.6  # a step over the usual one, from which on a frame is missing in it
FASTER = 1.4  # the same over the one before and over the one after: a rope that starts or stops loses no frame
ALIKE = 0.8  # of the markers that move, which have to step as far as all together, within `OFF`
OFF = 0.4  # of a step
CLEAR = 0.1  # error of the ratio by noise, at most: a slow motion does not show a missing frame, nor need it
MOST = 0.1  # s, that is missing at most: in longer gaps a motion may have gone anywhere


def on_time(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording without repeated frames and with times that count the missing ones, and words on both; the same
    object where there are none."""
    repeated = _repeated(recording.positions)
    kept = np.flatnonzero(~repeated)
    times, positions = recording.times[kept], recording.positions[kept]
    missing = _missing(times, positions)
    if not (repeated.any() or missing.any()):
        return recording, ()
    step = float(np.median(np.diff(times)))
    words = []
    if repeated.any():
        words.append(
            f"{_counted(int(repeated.sum()))} the one before ({_frames_in_words(recording, np.flatnonzero(repeated))})"
        )
    if missing.any():
        where = kept[1:][missing > 0]
        lost = int(missing.sum())
        count = f"{lost} frame was" if lost == 1 else f"{lost} frames were"
        words.append(f"{count} lost before {_frames_in_words(recording, where)}: later times count them")
    later = step * np.concatenate([[0], np.cumsum(missing)])
    return replace(recording, times=times + later, positions=positions), tuple(words)


def _counted(frames: int) -> str:
    return "1 frame that is left out repeats" if frames == 1 else f"{frames} frames that are left out repeat"


def _frames_in_words(recording: Recording, frames: NDArray[np.int64]) -> str:
    first = f"frame {frames[0]} ({recording.times[frames[0]]:.4g} s)"
    return first if len(frames) == 1 else f"{first} and {len(frames) - 1} later"


def _repeated(positions: Array) -> NDArray[np.bool_]:
    """(frames,) in which everything repeats in the midst of a motion, a few frames in a row."""
    step = np.diff(positions, axis=0)
    same = ((step == 0.0) | np.isnan(step)).all(axis=(1, 2)) & np.isfinite(step).any(axis=(1, 2))
    size = np.nan_to_num(np.linalg.norm(step, axis=2)).max(axis=1, initial=0.0)
    repeated = np.zeros(len(positions), dtype=bool)
    for first, last in stretches(same):
        if first == 0 or last == len(same) or last - first + 1 >= REPEATS:
            continue  # it may rest before and after
        onward = np.nansum(step[first - 1] * step[last]) > 0.0  # not where it turns back
        if onward and max(size[first - 1], size[last]) > MOVES:
            repeated[first + 1 : last + 1] = True
    return repeated


def _missing(times: Array, positions: Array) -> NDArray[np.int64]:
    """(steps,) how many frames are missing in each step."""
    apart = np.diff(times)
    none = np.zeros(len(apart), dtype=np.int64)
    if len(apart) < 2 * BESIDE + 1:
        return none
    usual_step = float(np.median(apart))
    velocity = np.diff(positions, axis=0) / apart[:, None, None]
    usual = _usual(velocity)
    along, size = np.nansum(velocity * usual, axis=2), np.nansum(usual * usual, axis=2)
    ratio = along.sum(axis=1) / np.maximum(size.sum(axis=1), np.finfo(float).tiny)
    off = velocity - usual
    noise = 1.4826 * float(np.nanmedian(np.abs(off)))  # of a velocity; steps of a smooth motion hardly differ otherwise
    clear = noise < CLEAR * np.sqrt(size.sum(axis=1))
    moving = size > (4.0 * noise) ** 2
    each = along / np.maximum(size, np.finfo(float).tiny)
    alike = np.abs(each - ratio[:, None]) < OFF * np.maximum(ratio, 1.0)[:, None]
    together = (alike & moving).sum(axis=1) >= ALIKE * np.maximum(moving.sum(axis=1), 2)
    count = np.rint((ratio - 1.0) * apart / usual_step).astype(np.int64)
    found = (ratio > FARTHER) & _faster(velocity) & clear & together & (count * usual_step <= MOST)
    return np.where(found, count, none)


def _usual(velocity: Array) -> Array:
    """(steps, markers, 3) the medians of the steps beside each, itself left out; zero where nothing is seen."""
    none = np.full((BESIDE, *velocity.shape[1:]), np.nan)
    each = np.lib.stride_tricks.sliding_window_view(np.concatenate([none, velocity, none]), 2 * BESIDE + 1, axis=0)
    others = np.delete(each, BESIDE, axis=-1)
    seen = np.isfinite(others).any(axis=-1)
    middle = np.zeros(velocity.shape)
    middle[seen] = np.nanmedian(others[seen], axis=-1)
    return middle


def _faster(velocity: Array) -> NDArray[np.bool_]:
    """(steps,) than both neighbors."""
    size = np.concatenate([[0.0], np.sqrt(np.nansum(np.square(velocity), axis=(1, 2))), [0.0]])
    return np.asarray(size[1:-1] > FASTER * np.maximum(size[:-2], size[2:]))
