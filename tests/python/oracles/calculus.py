"""Numerical differentiation for oracles whose parameter derivative has no short closed form."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

_SHRINK = 1.4
_ROWS = 12


def derivative(f: Callable[[float], ArrayLike], x: float, step: float | None = None) -> NDArray[np.float64]:
    """Return df/dx by Ridders' method: central differences extrapolated to step zero.

    `f` maps a float to a number or an array; the result has its shape. `step` (default 0.1 |x|, or 0.1 at x =
    0) is the widest step: f must be smooth on [x - step, x + step], and the step should be a good part of the
    length over which f changes. Each component takes the table entry with the smallest error estimate; for an
    f that is good to rounding the result is good to about 1e-11 relative.

    Source: Ridders (1982), Accurate computation of F'(x) and F'(x) F''(x), Adv. Eng. Software 4(2).
    """
    width = step if step is not None else 0.1 * (abs(x) or 1.0)
    if width <= 0.0:
        raise ValueError(f"step: got {width}; give a positive width")
    best = previous = np.empty(0)
    error = np.empty(0)
    for row in range(_ROWS):
        diagonal = [_central_difference(f, x, width / _SHRINK**row)]
        for order in range(1, row + 1):
            factor = _SHRINK ** (2 * order)
            diagonal.append((factor * diagonal[-1] - previous[order - 1]) / (factor - 1.0))
        if row == 0:
            best, error = diagonal[0], np.full_like(diagonal[0], np.inf)
        for order in range(1, row + 1):
            entry = diagonal[order]
            change = np.maximum(abs(entry - diagonal[order - 1]), abs(entry - previous[order - 1]))
            best = np.where(change < error, entry, best)
            error = np.minimum(change, error)
        previous = diagonal
    return best


def _central_difference(f: Callable[[float], ArrayLike], x: float, width: float) -> NDArray[np.float64]:
    above, below = x + width, x - width
    return (np.asarray(f(above), dtype=float) - np.asarray(f(below), dtype=float)) / (above - below)
