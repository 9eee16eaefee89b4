"""Linear least squares with columns of very different sizes, such as those of a Jacobian."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from .gauge import RANK_TOLERANCE


def solved(columns: Array, wanted: Array, rcond: float | None = RANK_TOLERANCE) -> Array:
    """(p,) or (p, k) x with the least |columns x - wanted|, of columns (rows, p) and wanted (rows,) or (rows, k).

    Each column is scaled to unit length first. Singular values below `rcond` times the largest count as zero (None:
    those below rounding); x is then the shortest answer in these scales.
    """
    scaled, size = _scaled(columns)
    x = np.linalg.lstsq(scaled, wanted, rcond=rcond)[0]
    return np.asarray((x.T / size).T)


def unexplained(columns: Array, wanted: Array, rcond: float | None = RANK_TOLERANCE) -> Array:
    """What the least-squares answer of `solved` leaves of `wanted`, in its shape."""
    scaled, _ = _scaled(columns)
    return np.asarray(wanted - scaled @ np.linalg.lstsq(scaled, wanted, rcond=rcond)[0])


def spanned(columns: Array) -> Array:
    """(rows, rank) orthonormal: what columns (rows, p) span, up to `RANK_TOLERANCE` of the largest in these scales."""
    scaled, _ = _scaled(columns)
    basis, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(basis[:, sizes > RANK_TOLERANCE * sizes.max(initial=0.0)])


def left_by(basis: Array, wanted: Array) -> Array:
    """What an orthonormal basis (rows, rank), such as that of `spanned`, leaves of `wanted`, in its shape."""
    return np.asarray(wanted - basis @ (basis.T @ wanted))


def _scaled(columns: Array) -> tuple[Array, Array]:
    """Columns of unit length, and (p,) how long they were; a column of zeros stays."""
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    return columns / size, size
