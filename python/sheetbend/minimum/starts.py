"""Where a fit starts: points drawn over the range of each parameter, and points that are moved off their bounds.

The points are of a Sobol sequence, which fills the ranges of all parameters together more evenly than independent
draws. A parameter is drawn from its prior where it has one, between its bounds where it has both, and else over two
decades about its initial value.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..optional import require
from ..quantities.parameters import Parameter, Parameters

MOST = 4096  # starts that are drawn
DECADE = math.log(10.0)  # either way of the initial value, on a log scale without bounds
OFF = 0.05  # of the range: so far from a bound a start is moved
SEED = 25


def check_count(count: int, or_else: str = "") -> None:
    """Raises InputError where it is no number of starts, from 1 to `MOST`; `or_else`: what may stand there instead."""
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST:
        raise InputError("starts", f"must be a number of starts{or_else}", count, f"give 1 to {MOST}")


def drawn(parameters: Parameters, count: int) -> list[Array]:
    """Starts (free,) in internal coordinates: the initial one, and count - 1 drawn ones. The same every time.

    Raises:
        InputError: the count is no number from 1 to `MOST`.
        MissingExtraError: SciPy is not installed.
    """
    check_count(count, " or a list of them")
    first = parameters.initial()
    if count == 1:
        return [first]
    qmc = require("scipy.stats.qmc", "fit")
    power = math.ceil(math.log2(count))  # a Sobol sequence is even in powers of two
    shares = qmc.Sobol(len(first), seed=SEED).random_base2(power)[: count - 1]
    columns = [_over(parameters[name], shares[:, i]) for i, name in enumerate(parameters.free)]
    return [first, *np.stack(columns, axis=1)]


def off_bounds(parameters: Parameters, u: Array) -> Array:
    """The point (free,) with every parameter that is at a bound, or beyond it, moved inside by 5 % of its range; of a
    decade or a natural scale where it has one bound only."""
    lower, upper = parameters.bounds()
    moved = np.array(u, dtype=float)
    for i, name in enumerate(parameters.free):
        room = OFF * _range(parameters[name], lower[i], upper[i])
        if moved[i] <= lower[i]:
            moved[i] = lower[i] + room
        elif moved[i] >= upper[i]:
            moved[i] = upper[i] - room
    return moved


def _range(p: Parameter, lower: float, upper: float) -> float:
    """Internal width of the range that a parameter's starts come from."""
    if math.isfinite(upper - lower):
        return upper - lower
    return DECADE if p.log else p.scale or abs(p.initial or 0.0) or 1.0


def _over(p: Parameter, shares: Array) -> Array:
    """Internal values of one parameter, at shares (n,) between 0 and 1 of its range or prior."""
    lower, upper = p.to_internal(p.lower), p.to_internal(p.upper)
    if p.prior is not None:
        special = require("scipy.special", "fit")
        mean, sd = p.to_internal(p.prior[0]), p.prior[1]
        below, above = special.ndtr((lower - mean) / sd), special.ndtr((upper - mean) / sd)
        if above > below:  # else the bounds leave nothing of the prior
            return np.asarray(np.clip(mean + sd * special.ndtri(below + shares * (above - below)), lower, upper))
    if not math.isfinite(upper - lower):
        first = p.to_internal(p.initial or 0.0)
        reach = DECADE if p.log else p.scale or abs(first)
        lower, upper = max(lower, first - reach), min(upper, first + reach)
    return np.asarray(lower + shares * (upper - lower))
