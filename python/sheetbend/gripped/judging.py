"""Whether a larger model predicts better: by each recording's ratio of errors with and without it.

A mean over recordings is decided by the one that is predicted worst. Ratios count each recording alike: their median
must fall, and so many of them must lie below 1 that luck explains it badly (sign test).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from .beside import beside
from .ladder import TWIST
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .pieces import numbered, problem_of
from .slid import window_of
from .split import split

BETTER = 0.99  # median ratio of errors on what was not fitted, below which a larger model stays
EQUAL = 0.03  # by which the median ratio of models that predict equally well differs from 1
LUCK = 1 / 3  # probability of so many better ones by chance, above which they show nothing
PIECES = 4  # at least, that a verdict rests on
FITTED = 18  # recordings, at most, that rungs are fitted to: their windows are of no more
FAR = 2.0  # error over the median, beyond which a recording does not belong
SPREAD = 4.0  # standard deviations of the logarithms of errors (from their median), likewise
GIVEN = 2  # frames that a prediction starts from
UNSEEN = "none of its free markers is seen where it would be judged"


@dataclass(frozen=True)
class Split:
    """What a model is fitted to, and what decides whether it stays.

    Attributes:
        fitted: motions.
        judged: motions that are predicted from their first frame; none where what is fitted decides.
        since: frames of each of these from which on it is judged. Of a recording that is cut in time the first part is
            predicted too: what slides inside a rope has a history, and a motion cannot start in its middle.
        pieces: in time, by which each is judged, so that few recordings give a verdict too.
        waiting: of many motions, those that are neither fitted nor judged before the fit that counts.
    """

    fitted: tuple[GrippedMotion, ...]
    judged: tuple[GrippedMotion, ...]
    since: tuple[int, ...]
    pieces: int
    waiting: tuple[GrippedMotion, ...] = ()

    @classmethod
    def of(cls, motions: Sequence[GrippedMotion], share: float) -> Split:
        """About that share of the motions, or of the time of each, is judged (`split`). Of the others no more than
        `FITTED` are fitted, spread evenly; the rest waits."""
        fitted, judged = split(motions, share)
        since, waiting = [GIVEN] * len(judged), list[GrippedMotion]()
        if judged and not any(fitted[0] is m for m in motions):
            shown = [len(part.recording.times) for part in fitted]
            halves = [(m, n) for m, n in zip(motions, shown, strict=True) if n < len(m.recording.times)]
            judged, since = [m for m, _ in halves], [n for _, n in halves]
        elif len(fitted) > FITTED:
            chosen = set(np.linspace(0, len(fitted) - 1, FITTED).astype(int).tolist())
            waiting = [m for k, m in enumerate(fitted) if k not in chosen]
            fitted = [m for k, m in enumerate(fitted) if k in chosen]
        pieces = -(-PIECES // max(len(judged), 1))
        return cls(tuple(fitted), tuple(judged), tuple(since), pieces, tuple(waiting))

    @property
    def cut(self) -> bool:
        """Whether parts of the same recordings are fitted and judged."""
        return any(first > GIVEN for first in self.since)

    @property
    def motions(self) -> tuple[GrippedMotion, ...]:
        """Those that are fitted, then those that are judged."""
        return (*self.fitted, *self.judged)

    def each(self, made: Callable[[GrippedMotion], GrippedMotion]) -> Split:
        """The same with something else in place of every motion."""
        parts = (self.fitted, self.judged, self.waiting)
        fitted, judged, waiting = (tuple(made(m) for m in part) for part in parts)
        return replace(self, fitted=fitted, judged=judged, waiting=waiting)

    def without(self, numbers: Collection[int]) -> Split:
        """The same without some of `motions`. If none is left to judge, the last of several fitted ones judges."""
        count = len(self.fitted)
        fitted = tuple(m for k, m in enumerate(self.fitted) if k not in numbers)
        kept = [k for k in range(len(self.judged)) if count + k not in numbers]
        judged, since = tuple(self.judged[k] for k in kept), tuple(self.since[k] for k in kept)
        if self.judged and not judged and len(fitted) > 1:
            fitted, judged, since = fitted[:-1], fitted[-1:], (GIVEN,)
        return replace(self, fitted=fitted, judged=judged, since=since, pieces=-(-PIECES // max(len(judged), 1)))


@dataclass(frozen=True)
class Errors:
    """Mean absolute coordinate errors of predictions, m, infinite where one diverges, NaN where no free marker is seen.

    Attributes:
        fitted: (motions,) of what was fitted.
        judged: (motions, pieces) of what was not; `fitted` itself where all was.
    """

    fitted: Array
    judged: Array

    @classmethod
    def none(cls) -> Errors:
        """Of what was not predicted yet."""
        return cls(np.zeros(0), np.zeros(0))

    @property
    def whole(self) -> Array:
        """(motions,) of `Split.motions`."""
        if self.judged is self.fitted:
            return self.fitted
        seen = [row[~np.isnan(row)] for row in self.judged]
        return np.concatenate([self.fitted, [float(np.mean(row)) if len(row) else np.nan for row in seen]])

    @property
    def typical(self) -> tuple[float, float]:
        """Medians of both."""
        return float(np.median(self.fitted)), float(np.nanmedian(self.judged))


@dataclass(frozen=True)
class Verdict:
    """A larger model beside the smaller one.

    Attributes:
        ratio: median of the errors' ratios on what was not fitted; infinite where it diverges.
        fitted: the same on what was.
        better: number of ratios below 1, of `count`.
        stays: whether the larger model is taken.
    """

    ratio: float
    fitted: float
    better: int
    count: int

    @property
    def stays(self) -> bool:
        luck = sum(comb(self.count, k) for k in range(self.better, self.count + 1)) / 2**self.count
        # one that fits worse than the smaller model ended elsewhere than in its minimum: better on others by chance
        return self.ratio < BETTER and self.fitted <= 1.0 and luck <= LUCK


def verdict(larger: Errors, smaller: Errors) -> Verdict:
    """What the errors say of the larger model."""
    ratios = _ratios(larger.judged, smaller.judged)
    if len(ratios) == 0:
        return Verdict(np.inf, np.inf, 0, 0)
    fitted = _ratios(larger.fitted, smaller.fitted)
    middle = float(np.median(fitted)) if len(fitted) else np.inf
    return Verdict(float(np.median(ratios)), middle, int((ratios < 1.0).sum()), len(ratios))


def _ratios(larger: Array, smaller: Array) -> Array:
    """Of those that one of the two predicts; infinite and zero where the other does not."""
    a, b = np.ravel(larger), np.ravel(smaller)
    known = np.isfinite(a) | np.isfinite(b)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(np.isfinite(b[known]), a[known] / np.where(np.isfinite(b), b, 1.0)[known], 0.0))


def errors_of(model: RopeModel, values: Mapping[str, float], split: Split, threads: int = 1) -> Errors:
    """Errors of predictions from the first frames."""
    reach = values.get(f"{NAME}_length", np.inf)
    motions = [*split.fitted, *split.judged]
    predicted = predict(model, motions, values, threads)
    count = len(split.fitted)
    fitted = np.array([_error(m, x, GIVEN, 1, reach)[0] for m, x in zip(motions[:count], predicted, strict=False)])
    judged = [
        _error(m, x, first, split.pieces, reach)
        for m, x, first in zip(split.judged, predicted[count:], split.since, strict=True)
    ]
    return Errors(fitted, np.array(judged) if judged else fitted)


def _error(motion: GrippedMotion, predicted: Array, first: int, pieces: int, reach: float) -> Array:
    off = np.abs(predicted - motion.recording.positions)
    seen = motion.recording.mask
    if not (off[seen] <= reach).all():  # false where it is not a number
        return np.full(pieces, np.inf)
    parts = np.array_split(np.arange(first, len(off)), pieces)
    tells = np.asarray(seen[:, list(motion.free)].any(axis=1))  # gripped markers are driven by themselves
    return np.array([float(np.mean(off[part][seen[part]])) if tells[part].any() else np.nan for part in parts])


def misfits(errors: Array) -> dict[int, str]:
    """Numbers of recordings that do not belong to the others, and why; at most half of those that can be judged.

    Args:
        errors: (motions,) m; infinite where a prediction diverges, NaN where no free marker is seen.
    """
    finite, unseen = np.isfinite(errors), np.isnan(errors)
    found = {int(k): UNSEEN for k in np.flatnonzero(unseen)}
    if 2 * finite.sum() <= np.count_nonzero(~unseen):
        return found
    found |= {int(k): "its prediction diverges" for k in np.flatnonzero(~finite & ~unseen)}
    middle = float(np.median(errors[finite]))
    logs = np.log(np.maximum(errors[finite], 1e-12) / middle)
    spread = 1.4826 * float(np.median(np.abs(logs)))
    limit = middle * max(FAR, np.exp(SPREAD * spread)) if len(logs) > 2 else np.inf
    for k in np.flatnonzero(finite & (errors > limit)):
        found[int(k)] = f"its error is {errors[k] / middle:.2g} times the median"
    return found


def predict(
    model: RopeModel, motions: Sequence[GrippedMotion], values: Mapping[str, float], threads: int = 1
) -> list[Array]:
    """Whole recordings, open loop from their first frames; NaN where a motion diverges."""
    if not motions:
        return []
    if model.late:
        return predict(replace(model, late=0.0), [m.later(model.late) for m in motions], values, threads)
    if model.beside:
        return _predicted_beside(model, motions, values, threads)
    experiments = [replace(window_of(model, m, None, values), fit=None) for m in motions]
    problem = problem_of(numbered(experiments), (TWIST.parameters[0],), values)
    u = problem.parameters.initial()

    def one(k: int) -> Array:
        out, free = motions[k].recording.filled().positions.copy(), list(motions[k].free)
        try:
            out[:, free] = problem.simulate_one(k, u)
        except SheetbendError:
            out[:, free] = np.nan
        return out

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, range(len(motions))))


def _predicted_beside(
    model: RopeModel, motions: Sequence[GrippedMotion], values: Mapping[str, float], threads: int
) -> list[Array]:
    """The same with markers beside the rope: it starts from where its axis is."""
    off = [beside(model, m, values, model.beside) for m in motions]
    sound = [np.isfinite(by).all() for by in off]
    axes = [m.moved(-by) for m, by, ok in zip(motions, off, sound, strict=True) if ok]
    predicted = iter(predict(replace(model, beside=()), axes, values, threads))
    found = []
    for motion, by, ok in zip(motions, off, sound, strict=True):
        x = next(predicted) if ok else motion.recording.filled().positions.copy()
        x[:, list(motion.free)] += by
        found.append(x)
    return found
