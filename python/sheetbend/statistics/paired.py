"""Which of two predictions of the same data is better, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from .intervals import critical_t

FEWEST = 4  # independent stretches below which no interval is given
MOST = 24  # stretches of one recording


@dataclass(frozen=True)
class Paired:
    """Root mean square errors of two predictions of the same frames.

    Attributes:
        first, second: m.
        ratio: second over first.
        lower, upper: 95 % interval of the ratio; None where there are too few independent stretches.
        stretches: number of stretches that were taken as independent.
        worse: share of the frames in which the second errs more.
    """

    first: float
    second: float
    ratio: float
    lower: float | None
    upper: float | None
    stretches: int
    worse: float

    @property
    def clear(self) -> bool:
        """Whether the interval leaves out 1: one of the two is better."""
        return self.lower is not None and self.upper is not None and not self.lower <= 1.0 <= self.upper


def paired(series: Sequence[tuple[Array, Array]]) -> Paired:
    """Compare two predictions frame by frame.

    What both find hard or easy in a frame falls out of the difference. Neighboring frames err alike: each recording is
    cut into stretches that are twice as long as the difference of the squared errors stays correlated. The interval is
    that of the jackknife over these stretches (B. Efron and C. Stein, Ann. Statist. 9, 1981), of the logarithm of the
    ratio, with Student's t.

    Args:
        series: by recording two (frames,) arrays, mean squared errors of the first and the second prediction, m^2.

    Raises:
        ValueError: no frames, or arrays of different length.
        MissingExtraError: scipy is not installed.
    """
    if not series or any(len(a) != len(b) or not len(a) for a, b in series):
        raise ValueError("no frames, or not the same of both")
    parts = [piece for a, b in series for piece in _stretches(np.asarray(a, float), np.asarray(b, float))]
    sums = np.array([[a.sum(), b.sum(), len(a)] for a, b in parts])
    first, second, count = sums.sum(axis=0)
    tiny = np.finfo(float).tiny

    def log_ratio(of: Array) -> float:
        return 0.5 * math.log(max(of[1], tiny) / max(of[0], tiny))

    value, n = log_ratio(sums.sum(axis=0)), len(parts)
    lower = upper = None
    if n >= FEWEST:
        without = np.array([log_ratio(sums.sum(axis=0) - own) for own in sums])
        error = math.sqrt((n - 1) / n * float(((without - without.mean()) ** 2).sum()))
        reach = critical_t(n - 1) * error
        lower, upper = math.exp(value - reach), math.exp(value + reach)
    rms = (math.sqrt(first / count), math.sqrt(second / count))
    worse = sum(int((b > a).sum()) for a, b in series) / int(count)
    return Paired(*rms, math.exp(value), lower, upper, n, worse)


def _stretches(a: Array, b: Array) -> list[tuple[Array, Array]]:
    """Pieces of one recording that err independently of each other."""
    length = 2.0 * _correlated(b - a)
    count = int(min(max(len(a) / length, 1.0), MOST))
    return list(zip(np.array_split(a, count), np.array_split(b, count), strict=True))


def _correlated(series: Array) -> float:
    """Frames over which a series stays correlated: 1 + 2 sum of its autocorrelation, up to where that first is not
    positive."""
    off = series - series.mean()
    power = float(off @ off)
    if not power > 0.0 or len(series) < 3:
        return 1.0
    total = 1.0
    for lag in range(1, len(series) // 2):
        correlation = float(off[lag:] @ off[:-lag]) / power
        if correlation <= 0.0:
            break
        total += 2.0 * correlation
    return total
