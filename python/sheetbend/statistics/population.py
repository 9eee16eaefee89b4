"""The mean and the spread of a parameter over specimens, from one estimate with its error for each (random effects).

y_i = mean + b_i + e_i, with b_i of variance tau^2 between specimens and e_i of the known variance v_i of its estimate.
tau^2 is estimated by restricted maximum likelihood (REML; Harville 1977, J. Am. Stat. Assoc. 72, 320). The interval of
the mean is that of Knapp and Hartung (2003, Statistics in Medicine 22, 2693), which counts that tau^2 is estimated, but
never narrower than with the variances as they are told. That of tau holds the values for which the weighted sum of
squares is one that chance explains (Q-profile: Viechtbauer 2007, Statistics in Medicine 26, 37).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..optional import require
from .intervals import LEVEL, critical_t

_WIDEST = 1e3  # of the standard deviation of the estimates: where the upper end of tau is looked for


@dataclass(frozen=True)
class Population:
    """The population of values (n,) with known variances.

    Attributes:
        mean, mean_interval: of the population, with its 95 % interval.
        spread, spread_interval: standard deviation between specimens (tau), with its 95 % interval.
        share: part of the variance of the estimates that is between specimens (I^2), 0 to 1.
        count: how many.
    """

    mean: float
    mean_interval: tuple[float, float]
    spread: float
    spread_interval: tuple[float, float]
    share: float
    count: int


def population(values: Array, variances: Array) -> Population:
    """Mean and spread between specimens.

    Args:
        values: (n,) estimates, n at least 3.
        variances: (n,) of their errors, positive.

    Raises:
        InputError: shapes or signs are wrong, or there are too few.
        MissingExtraError: SciPy is not installed.
    """
    y, v = np.asarray(values, dtype=float), np.asarray(variances, dtype=float)
    if y.ndim != 1 or y.shape != v.shape or len(y) < 3:
        raise InputError("values", "must be three or more, with a variance each", (y.shape, v.shape), "give (n,)")
    if not (np.isfinite(y).all() and np.isfinite(v).all() and (v > 0).all()):
        raise InputError("variances", "must be positive, and all finite", v, "leave out estimates without an interval")
    special, optimize = require("scipy.special", "fit"), require("scipy.optimize", "fit")
    scale = float(np.std(y, ddof=1)) or float(np.sqrt(v.mean()))
    n = len(y)

    def weighed(tau2: float) -> tuple[Array, float, float]:
        w = 1.0 / (v + tau2)
        mean = float(w @ y / w.sum())
        return w, mean, float(w @ (y - mean) ** 2)

    def deviance(log_tau2: float) -> float:
        w, _, Q = weighed(math.exp(log_tau2))
        return float(Q - np.log(w).sum() + math.log(w.sum()))

    logs = np.linspace(2 * math.log(1e-6 * scale), 2 * math.log(10 * scale), 60)
    start = int(np.argmin([deviance(x) for x in logs]))
    ends = (logs[max(start - 1, 0)], logs[min(start + 1, len(logs) - 1)])
    best = optimize.minimize_scalar(deviance, bounds=ends, method="bounded", options={"xatol": 1e-10})
    tau2 = 0.0 if start == 0 else math.exp(float(best.x))
    w, mean, Q = weighed(tau2)
    reach = critical_t(n - 1) * math.sqrt(max(Q / (n - 1), 1.0) / float(w.sum()))

    def end(probability: float) -> float:
        """tau^2 at which Q is that quantile of chi square; 0 where it is below at once."""
        wanted = float(special.chdtri(n - 1, 1.0 - probability))
        if weighed(0.0)[2] <= wanted:
            return 0.0
        return float(optimize.brentq(lambda t: weighed(t)[2] - wanted, 0.0, (_WIDEST * scale) ** 2))

    lower, upper = end(0.5 + LEVEL / 2), end(0.5 - LEVEL / 2)
    typical = (n - 1) * float((1 / v).sum()) / float((1 / v).sum() ** 2 - (1 / v**2).sum())
    return Population(
        mean,
        (mean - reach, mean + reach),
        math.sqrt(tau2),
        (math.sqrt(lower), math.sqrt(upper)),
        tau2 / (tau2 + typical),
        n,
    )
