"""The triangle of a tall matrix, block by block, is that of the whole."""

from __future__ import annotations

import numpy as np
import pytest
from sheetbend.problem.triangle import ROWS, triangle


@pytest.mark.parametrize(
    ("rows", "columns"), [(5 * ROWS, 7), (5 * ROWS + 3, 40), (2 * ROWS, 3), (40, 7), (3, 7), (3 * ROWS, ROWS)]
)
def test_it_is_that_of_the_whole(rows: int, columns: int) -> None:
    A = np.random.default_rng(rows).standard_normal((rows, columns)) * 10.0 ** np.linspace(-6, 6, columns)
    size = np.linalg.norm(A, axis=0)
    R = triangle(A)
    assert R.shape == (min(rows, columns), columns) and not np.tril(R, -1).any()
    np.testing.assert_allclose(R.T @ R / size / size[:, None], A.T @ A / size / size[:, None], atol=1e-12)
    whole = np.linalg.qr(A, mode="r")
    np.testing.assert_allclose(np.abs(R) / size, np.abs(whole) / size, atol=1e-12)


def test_a_column_that_follows_from_others_is_none_of_its_own() -> None:
    A = np.random.default_rng(0).standard_normal((4 * ROWS, 3))
    R = triangle(np.column_stack([A, A @ [1.0, -2.0, 0.5]]))
    assert abs(R[3, 3]) < 1e-11 < 1.0 < abs(R[2, 2])
