"""Errors of the residuals whose covariance is known from elsewhere, such as those that noise of what drives a scene
makes. They move the whole of a recording alike, so the scatter of its residuals tells too little of them. Random draws
stand for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from .covariance import Covariance
from .least_squares import solved


def moved_by(jacobian: Array, errors: Array) -> Array:
    """(p, draws) by which errors (rows, draws) of the residuals move the least-squares estimate, to first order.

    Args:
        jacobian: (rows + others, p), the rows of priors last; of these errors are zero.
    """
    full = np.zeros((len(jacobian), errors.shape[1]))
    full[: len(errors)] = errors
    return -solved(jacobian, full, rcond=None)


def variance_of(jacobian: Array, errors: Array) -> Array:
    """(p, p) covariance of the estimate's error that errors (rows, draws) of the residuals make; zero without draws."""
    if not errors.size or not jacobian.shape[1]:
        return np.zeros((jacobian.shape[1], jacobian.shape[1]))
    off = moved_by(jacobian, errors)
    return np.asarray(off @ off.T / errors.shape[1])


def with_shared(spread: Covariance, more: Array, draws: int) -> Covariance:
    """The covariance with that of independent errors (p, p), which so many draws told. Degrees of freedom of the sum
    are Satterthwaite's (1946, Biometrics Bulletin 2, 110)."""
    if not more.any():
        return spread
    own, other = np.diag(spread.matrix), np.diag(more)
    whole = np.maximum(own + other, np.finfo(float).tiny)
    degrees = 1.0 / ((own / whole) ** 2 / spread.degrees + (other / whole) ** 2 / draws)
    with np.errstate(divide="ignore", invalid="ignore"):
        inflation = np.where(own > 0.0, spread.inflation * whole / own, spread.inflation)
    return replace(spread, matrix=spread.matrix + more, degrees=degrees, inflation=inflation)
