"""Two directions in which residuals may lie, where no single one explains them: which two do, and by how much.

Of n directions there are n (n - 1) / 2 pairs, which takes one Gram matrix. A pair counts where it explains nearly all
that the fit leaves beyond noise, much more than the best of its directions alone, and where chance explains neither
direction beside the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..statistics.layout import Layout
from ..statistics.least_squares import unexplained
from .directions import asked_for

STILL_LEFT = 1 / 3  # of what one direction leaves unexplained, at most, for a second one to count
APART = 0.999  # cosine of two directions: above, they look the same


@dataclass(frozen=True)
class Two:
    """Two directions, by their places.

    Attributes:
        more: of each, as `directions.Asked.more`.
        explained: share of what the fit leaves beyond noise.
    """

    places: tuple[int, int]
    more: tuple[float, float]
    explained: float


def two_directions(r: Array, beside: Array, left: float, one: float, least: float) -> list[Two]:
    """The pairs that explain at least a share `least`, the most first.

    Args:
        r: (rows,) residuals, without what parameters take up.
        beside: (rows, n) the directions, without it; none is zero.
        left: sum of squares that r holds beyond noise.
        one: share of it that the best single direction explains.
    """
    sizes = np.linalg.norm(beside, axis=0)
    b = beside / sizes
    along, inner = b.T @ r, b.T @ b
    i, j = np.triu_indices(len(sizes), 1)
    apart = np.abs(inner[i, j]) < APART
    i, j = i[apart], j[apart]
    c = inner[i, j]
    first, second = (along[i] - c * along[j]) / (1.0 - c**2), (along[j] - c * along[i]) / (1.0 - c**2)
    explained = (first * along[i] + second * along[j]) / left
    enough = (explained > least) & (1.0 - explained < STILL_LEFT * (1.0 - one))
    return [
        Two(
            (int(i[k]), int(j[k])),
            (float(-first[k] / sizes[i[k]]), float(-second[k] / sizes[j[k]])),
            float(explained[k]),
        )
        for k in np.argsort(-explained, kind="stable")
        if enough[k]
    ]


def chance_of(
    r: Array,
    J: Array,
    columns: Sequence[Array],
    mine: Array,
    layout: Layout,
    errors: Array | None,
    taken: float = 0.0,
) -> float:
    """Chance that a right model asks for a column, or for the less sure of two beside each other; 1 where it asks for
    none. No step of the parameters, J (rows, p), lowers the residuals r (rows,). Other arguments: `asked_for`."""
    chances = []
    for k, column in enumerate(columns):
        after, beside = r, J
        for other in [*columns[:k], *columns[k + 1 :]]:
            beside = np.column_stack([beside, other])
            after = unexplained(beside, r, rcond=None)
        asked = asked_for(after, beside, column, mine, layout, taken, errors)
        chances.append(1.0 if asked is None else asked.chance)
    return max(chances)
