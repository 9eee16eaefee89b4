"""The Jacobian of many recordings, of which each depends on the shared numbers and on a few of its own.

Its residuals and Jacobian, [own | shared | r], are reduced by QR to a triangle of as many columns, which is all that is
kept of a recording. A step of all numbers needs no more: each triangle gives up its own numbers, what is left of all of
them is one small problem of the shared ones, and each recording's own numbers follow from these. Triangles are merged
in the order of the recordings, so that the bits do not depend on who made them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..problem.triangle import padded
from ..statistics.gauge import RANK_TOLERANCE
from .approach import inside

PASSES = 8  # of a step, each holding own numbers at the sides that they have met


@dataclass(frozen=True)
class Reduced:
    """A triangle without its own numbers d_own = top_shared d + seen, for changes d of the shared ones.

    Attributes:
        own: (q, q) triangle of the own numbers.
        cross: (q, shared) beside it.
        seen: (q,) residuals beside it.
        shared: (rows, shared) what is left of the shared columns.
        left: (rows,) what is left of the residuals.
    """

    own: Array
    cross: Array
    seen: Array
    shared: Array
    left: Array


def reduced(own: Array, shared: Array, r: Array) -> Reduced:
    """From columns (rows, q) and (rows, shared) and residuals (rows,)."""
    q, s = own.shape[1], shared.shape[1]
    T = padded(np.column_stack([own, shared, r]))
    return Reduced(T[:q, :q], T[:q, q : q + s], T[:q, -1], T[q:, q : q + s], T[q:, -1])


class Arrow:
    """The Jacobian of many recordings, one triangle for each.

    Attributes:
        triangles: [own | shared | residual] of each recording.
        own: columns of its own numbers, of each recording.
        shared: columns of the shared numbers.
        prior: (priors, shared) rows of the shared numbers' priors, and their residuals.
    """

    def __init__(
        self, triangles: Sequence[Array], own: Sequence[Array], shared: Array, prior: tuple[Array, Array]
    ) -> None:
        self.triangles, self.own, self.shared, self.prior = tuple(triangles), own, shared, prior

    @property
    def nbytes(self) -> int:
        """Of the triangles."""
        return sum(T.nbytes for T in self.triangles)

    def parts(self, i: int) -> tuple[Array, Array, Array]:
        """Own and shared columns and residuals of one recording's triangle."""
        T, q = self.triangles[i], len(self.own[i])
        return T[:, :q], T[:, q:-1], T[:, -1]

    def __matmul__(self, s: Array) -> Array:
        """What a step changes, in the order of `residuals`."""
        rows = []
        for i, columns in enumerate(self.own):
            own, shared, _ = self.parts(i)
            rows.append(own @ s[columns] + shared @ s[self.shared])
        return np.concatenate([*rows, self.prior[0] @ s[self.shared]])

    @property
    def residuals(self) -> Array:
        """As many as the triangles have rows; their sum of squares is that of all residuals."""
        return np.concatenate([*(T[:, -1] for T in self.triangles), self.prior[1]])

    def inside(self, ridge: Array, lower: Array, upper: Array) -> Array:
        """The step between lower <= 0 and upper >= 0 with the least sum of squares, see `approach.inside`; own numbers
        that meet a side stay there."""
        s, held = np.zeros(len(ridge)), np.zeros(len(ridge), dtype=bool)
        side = (lower[self.shared], upper[self.shared])
        for _ in range(PASSES):
            small = [self._small(i, s, held, ridge) for i in range(len(self.own))]
            J = np.concatenate([*(part.shared for part in small), self.prior[0]])
            r = np.concatenate([*(part.left for part in small), self.prior[1]])
            s[self.shared] = inside(J, r, ridge[self.shared], *side)
            for part, columns in zip(small, self.own, strict=True):
                free = columns[~held[columns]]
                s[free] = -np.linalg.solve(part.own, part.seen + part.cross @ s[self.shared])
            out = (s < lower) | (s > upper)
            s = np.clip(s, lower, upper)
            if not out.any():
                break
            held |= out
        return s

    def _small(self, i: int, s: Array, held: Array, ridge: Array) -> Reduced:
        own, shared, r = self.parts(i)
        columns, stays = self.own[i], held[self.own[i]]
        moved = own[:, ~stays]
        size = np.maximum(np.linalg.norm(moved, axis=0), np.finfo(float).tiny)
        weak = np.diag(np.maximum(ridge[columns[~stays]], RANK_TOLERANCE * size))
        below = np.zeros((len(weak), shared.shape[1]))
        known = r + own[:, stays] @ s[columns[stays]]
        return reduced(np.vstack([moved, weak]), np.vstack([shared, below]), np.append(known, np.zeros(len(weak))))
