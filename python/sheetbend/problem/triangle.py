"""The triangle of a tall matrix, as of a Jacobian with a row for every coordinate of every frame."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array

ROWS = 1024  # that are reduced at a time: so many fit into the cache of a processor


def triangle(A: Array) -> Array:
    """R (min(rows, n), n) of A = Q R, with the signs that its steps leave.

    Blocks of rows are reduced one by one, and then their triangles (Demmel, Grigori, Hoemmen & Langou 2012): of 160,000
    rows and 50 columns in 0.08 s, where one step takes 0.29 s.
    """
    n, whole = A.shape[1], len(A) // ROWS
    if whole < 2 or 2 * n > ROWS:
        return np.asarray(np.linalg.qr(A, mode="r"))
    blocks = np.asarray(np.linalg.qr(A[: whole * ROWS].reshape(whole, ROWS, n), mode="r"))
    return np.asarray(np.linalg.qr(np.concatenate([blocks.reshape(-1, n), A[whole * ROWS :]]), mode="r"))


def padded(A: Array) -> Array:
    """(n, n) triangle of A (rows, n), zero where it has fewer rows."""
    n = A.shape[1]
    T = np.zeros((n, n))
    R = triangle(A)
    T[: len(R)] = R
    return T
