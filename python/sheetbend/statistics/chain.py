"""Least squares over a chain of states with a border: each state beside the next, and all beside the same few numbers.

States are eliminated one after the other by orthogonal transformations of rows, as in a square-root information
smoother (Bierman 1977, Factorization Methods for Discrete Sequential Estimation, chapter X). No normal equations are
formed, so that gaps may be weighed a million times as much as data without a loss of digits. Time and memory grow with
the number of states, not with its square.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array

WEAK = 1e-12  # of a column: what no row determines stays where it is
UNFELT = 1e-100  # size of a column that no row feels: one, so that squares of its inverse stay finite


@dataclass(frozen=True)
class Window:
    """Rows that feel one state and the border.

    Attributes:
        state: (rows, q) derivatives with respect to the state; q may be 0.
        border: (rows, p) with respect to the border's numbers.
        rest: (rows,) residuals.
    """

    state: Array
    border: Array
    rest: Array

    def compressed(self) -> Window:
        """The window with at most as many rows as columns, and the same sums of squares."""
        q, p = self.state.shape[1], self.border.shape[1]
        if len(self.rest) <= q + p + 1:
            return self
        R = np.asarray(np.linalg.qr(np.column_stack([self.state, self.border, self.rest]), mode="r"))
        return Window(R[:, :q], R[:, q : q + p], R[:, -1])


@dataclass(frozen=True)
class Gap:
    """Rows that feel a state, the next one, and the border.

    Attributes:
        before, behind: (rows, q) with respect to the state before, and to the one behind.
        border: (rows, p).
        rest: (rows,) residuals.
    """

    before: Array
    behind: Array
    border: Array
    rest: Array

    def times(self, weight: float) -> Gap:
        """All rows times a weight."""
        return Gap(weight * self.before, weight * self.behind, weight * self.border, weight * self.rest)


class Chain:
    """The chain with its states eliminated.

    Attributes:
        border: (rows, p) what is left of the border's columns.
        rest: (rows,) what is left of the residuals.
    """

    def __init__(self, windows: Sequence[Window], gaps: Sequence[Gap]) -> None:
        """
        Args:
            windows: one for each state.
            gaps: one for each pair of neighbors.
        """
        self._rows: list[tuple[Array, Array, Array, Array]] = []  # of each state: own, next, border, residual
        p = windows[0].border.shape[1]
        carried = np.zeros((0, windows[0].state.shape[1] + p + 1))
        for k, window in enumerate(windows):
            q = window.state.shape[1]
            onward = windows[k + 1].state.shape[1] if k < len(gaps) else 0
            parts = [
                np.hstack([carried[:, :q], np.zeros((len(carried), onward)), carried[:, q:]]),
                np.column_stack([window.state, np.zeros((len(window.rest), onward)), window.border, window.rest]),
            ]
            if k < len(gaps):
                gap = gaps[k]
                parts.append(np.column_stack([gap.before, gap.behind, gap.border, gap.rest]))
            M = np.vstack(parts)
            size = np.linalg.norm(M[:, :q], axis=0)
            size = np.where(size > UNFELT, size, 1.0)
            weak = np.zeros((q, M.shape[1]))
            weak[:, :q] = np.diag(WEAK * size)
            R = np.asarray(np.linalg.qr(np.vstack([M, weak]), mode="r"))
            self._rows.append((R[:q, :q], R[:q, q : q + onward], R[:q, q + onward : -1], R[:q, -1]))
            carried = R[q:, q:]
        self.border, self.rest = carried[:, :-1], carried[:, -1]

    def states(self, step: Array | None = None) -> list[Array]:
        """Steps of the states that are best for a step (p,) of the border's numbers; for none by default."""
        found: list[Array] = []
        behind: Array = np.zeros(0)
        for own, onward, border, rest in reversed(self._rows):
            known = rest + onward @ behind + (0.0 if step is None else border @ step)
            behind = np.asarray(-np.linalg.solve(own, known))
            found.append(behind)
        return found[::-1]

    def along(self) -> list[Array]:
        """(q, p) derivative of every state's best place with respect to the border's numbers."""
        found: list[Array] = []
        for own, onward, border, _ in reversed(self._rows):
            behind = found[-1] if found else np.zeros((onward.shape[1], border.shape[1]))
            found.append(np.asarray(-np.linalg.solve(own, border + onward @ behind)))
        return found[::-1]

    def covariances(self) -> list[tuple[Array, Array]]:
        """Of every state, with the border's numbers known: its covariance (q, q), and that with the next state (q,
        next)."""
        found: list[tuple[Array, Array]] = []
        for own, onward, _, _ in reversed(self._rows):
            behind = found[-1][0] if found else np.zeros((0, 0))
            inverse = np.linalg.inv(own)
            cross = -inverse @ onward @ behind
            found.append((inverse @ inverse.T - cross @ onward.T @ inverse.T, cross))
        return found[::-1]

    @property
    def log_size(self) -> float:
        """Logarithm of the determinant that the eliminated columns have."""
        return float(sum(np.log(np.abs(np.diag(own))).sum() for own, _, _, _ in self._rows))
