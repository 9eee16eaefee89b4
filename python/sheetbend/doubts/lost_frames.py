"""Frames that a recording without time stamps has lost: from the gap on, all of its frames were taken later than told.

The change is that of a late recording (`told.LATER`), but from one frame on. The frame is the one from which on
residuals ask the most for it. They must ask for about a whole number of frames: a recording that is late as a whole, or
has another frame rate, looks like a part of one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.layout import Integers
from .told import LATER, Told

LOST = "frames lost"
MOVING = 0.05  # of what a late recording changes: at least so much before a gap, and behind it
WHOLE = 0.25  # of a frame, or of ten: so near to a whole number


def lost_frames(problem: FitProblem, q: Array, r: Array, told: Sequence[Told]) -> Iterator[Told]:
    """The likeliest gap of each recording whose times were given.

    Args:
        q: (rows, k) what the parameters take up, at right angles.
        r: (rows,) residuals at right angles to these.
        told: `told_numbers`.
    """
    layout, first = problem.rows_layout(), problem.core.first_rows
    for one in told:
        if one.label == LATER:
            i = one.experiment
            rows = np.arange(first[i], first[i + 1])[one.rows]
            frame = layout.frame[rows]
            gap, late = _likeliest(frame, one.column, q[rows], r[rows])
            times = problem.recordings[i].times
            frames = abs(late) / float(np.median(np.diff(times)))
            if frames > 0.5 and abs(frames - round(frames)) < WHOLE * max(1.0, frames / 10):
                yield replace(
                    one,
                    name="",
                    label=f"{LOST} {i}",
                    column=np.where(frame >= gap, one.column, 0.0),
                    missing=_words(problem.experiments[i].name, times, gap),
                    signed=True,
                )


def _likeliest(frame: Integers, column: Array, q: Array, r: Array) -> tuple[int, float]:
    """The frame from which on residuals ask the most for the change, and for how much of it."""

    def summed(each: Array) -> Array:
        sums = np.zeros((int(frame.max()) + 1, *each.shape[1:]))
        np.add.at(sums, frame, each)
        return np.asarray(sums[::-1].cumsum(axis=0)[::-1])

    along, size, taken = summed(column * r), summed(column**2), summed(column[:, None] * q)
    left = size - (taken**2).sum(axis=1)
    moving = (size > MOVING * size[0]) & (size < (1.0 - MOVING) * size[0]) & (left > RANK_TOLERANCE * size)
    explains = np.where(moving, along**2 / np.maximum(left, np.finfo(float).tiny), 0.0)
    gap = int(np.argmax(explains))
    return gap, -float(along[gap] / left[gap]) if moving[gap] else 0.0


def _words(name: str, times: Array, gap: int) -> Callable[[float], str]:
    interval = float(np.median(np.diff(times)))

    def says(late: float) -> str:
        some = f"{short(abs(late) / interval, 2)} of its frames"
        return f"{name} had {f'lost {some}' if late > 0 else f'{some} twice'} before {short(float(times[gap]), 3)} s"

    return says
