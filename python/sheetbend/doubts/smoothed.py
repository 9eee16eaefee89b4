"""Whether recorded markers were filtered.

Software of motion capture often smooths markers before it writes them. That takes noise away, and motion with it: a
rope that swings down looks damped. Two signs are asked together. The recording has far less noise between neighboring
frames than its sigma says. And the simulated markers, filtered in the same way, explain what the fit leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..optional import require
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..recording.recording import Recording
from ..statistics.least_squares import left_by, spanned
from .told import Told

FEWEST = 16  # frames
QUIET = 0.1  # of sigma squared: more noise than that no filter would have left
EVEN = 1e-3  # of the interval between frames: how much it may vary
CUTOFFS = tuple(0.03 * 1.25**k for k in range(15))  # of half the frame rate
WINDOWS = (3, 5, 7, 9, 13, 17, 25, 35)  # frames
BENDS = 70.0  # variance of fourth differences of white noise


def smoothed(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of the filters that explain most of what the i-th recording's markers are missed by at u (free,), one
    of each kind; none where the recording is not even in time, or as noisy as its sigma says."""
    e, recording = problem.experiment_at(i, u), problem.recordings[i]
    axes = ["xyz".index(a) for a in e.axes]
    if e.is_cloud or e.loss != "squares" or not _quiet(recording, axes, e.sigma):
        return []
    try:
        shown = problem.simulate_one(i, u)[..., axes]
    except SheetbendError:
        return []
    frames, seen = np.nonzero(recording.mask)
    _, r, J = problem.evaluate(u)  # known already
    first = problem.core.first_rows[i]
    own = slice(first, first + len(frames) * len(axes))
    mine = J[own]
    q = spanned(mine[:, mine.any(axis=0)])  # parameters of other motions have zeros
    left = left_by(q, r[own])
    found = []
    for label, says, filters in (
        ("cut-off", _cut_off, _low_passes(recording)),
        ("mean", _width, _means(len(recording.times))),
    ):
        best, most = None, 0.0
        for size, smooth in filters:
            column = ((smooth(shown) - shown)[frames, seen] / e.sigma).ravel()
            beside = left_by(q, column)
            along, inner = float(beside @ left), float(beside @ beside)
            if along < 0.0 and along**2 > most * inner:
                most, best = along**2 / inner, column / size
        if best is not None:
            found.append(Told(i, "", label, "", (0.0, ""), best, slice(0, len(best)), missing=says))
    return found


def _quiet(recording: Recording, axes: list[int], sigma: float) -> bool:
    """Whether the markers bend less from frame to frame than white noise of this sigma would make them."""
    steps = np.diff(recording.times)
    if len(recording.times) < FEWEST or np.ptp(steps) > EVEN * float(steps.mean()):
        return False
    x = recording.positions[..., axes]
    bends = np.diff(x, n=4, axis=0)
    bends = bends[np.isfinite(bends)]
    return bends.size > 0 and float(np.mean(bends**2)) < QUIET * sigma**2 * BENDS


Filters = Iterator[tuple[float, Callable[[Array], Array]]]
"""Filters, and the size of each: to first order, what one changes goes with it. So recordings that were filtered alike
share one direction, whichever filter explains most of each."""


def _low_passes(recording: Recording) -> Filters:
    """Butterworth filters of second order, forward and backward, of size 1/Hz^4: what one changes goes with the fourth
    power of frequency over cut-off."""
    signal, nyquist = require("scipy.signal", "fit"), 0.5 / float(np.diff(recording.times).mean())
    for part in CUTOFFS:
        sections = signal.butter(2, part, output="sos")
        yield (part * nyquist) ** -4, partial(signal.sosfiltfilt, sections, axis=0)


def _cut_off(size: float) -> str:
    return f"the markers were filtered, with a cut-off near {short(size**-0.25, 2)} Hz"


def _means(frames: int) -> Filters:
    """Means over some of so many frames, of size frames^2: what one changes goes with the square of its width."""
    for width in (w for w in WINDOWS if w < frames):
        yield width**2, partial(_mean, width=width)


def _width(size: float) -> str:
    return f"the markers were averaged over about {short(size**0.5, 2)} frames"


def _mean(x: Array, width: int) -> Array:
    half = width // 2
    ends = np.concatenate([2 * x[:1] - x[half:0:-1], x, 2 * x[-1:] - x[-2 : -half - 2 : -1]])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(ends, width, axis=0).mean(axis=-1))
