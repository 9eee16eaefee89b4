"""The residuals of a fit at its minimum, with all that tells to first order what a part of the data asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array
from .layout import Layout
from .least_squares import left_by, spanned


@dataclass(frozen=True)
class Linearized:
    """Residuals at a minimum and their derivatives there.

    Attributes:
        residuals: (rows + others,) weighted: those of the data, then those of priors and of what unknowns left that
            were solved for at every point.
        jacobian: (rows + others, p) their derivative in internal coordinates.
        layout: where each of the data's rows comes from.
        within: rows of a recording and the columns of parameters that it alone has.
        shifts: (rows, directions) known errors of the residuals of unknown size.
        taken: degrees of freedom of the data's residuals that unknowns took which were solved for at every point.
        errors: (rows, draws) random draws of errors that are alike in all parts; of more draws than are compared.
    """

    residuals: Array
    jacobian: Array
    layout: Layout
    within: Sequence[tuple[slice, Sequence[int]]] = ()
    shifts: Array | None = None
    taken: float = 0.0
    errors: Array | None = None

    @property
    def rows(self) -> int:
        """Number of the data's rows."""
        return len(self.layout.frame)

    @property
    def others(self) -> int:
        """Number of the rows that are no data."""
        return len(self.residuals) - self.rows

    @property
    def private(self) -> set[int]:
        """Columns of parameters that a single recording has."""
        return {column for _, columns in self.within for column in columns}

    @property
    def shared(self) -> list[int]:
        """Columns of all other parameters."""
        private = self.private
        return [column for column in range(self.jacobian.shape[1]) if column not in private]

    @property
    def frames(self) -> int:
        """Number of frames from the first to the last row."""
        return int(np.ptp(self.layout.frame)) + 1

    def of(self, mine: NDArray[np.bool_]) -> Linearized:
        """The same of some of the data's rows, (rows,) bool, and of all rows that are no data."""
        kept = np.append(mine, np.ones(self.others, dtype=bool))
        return replace(
            self,
            residuals=self.residuals[kept],
            jacobian=self.jacobian[kept],
            layout=self.layout.of(mine),
            within=[(slice(int(mine[: k.start].sum()), int(mine[: k.stop].sum())), own) for k, own in self.within],
            shifts=None if self.shifts is None else self.shifts[mine],
            errors=None if self.errors is None else self.errors[mine],
        )

    def beside_private(self, columns: Array) -> tuple[Array, Array, Array, Array]:
        """Columns and residuals, less what the parameters of single recordings can explain of them.

        Args:
            columns: (rows + others, n).

        Returns:
            The columns with the shifts behind them (rows + others, n + directions), the residuals (rows + others,), the
            draws of errors (rows + others, draws), all less that; and the shifts as they are (rows + others,
            directions).
        """
        shifts, errors = self._padded(self.shifts), self._padded(self.errors)
        every, residuals = np.hstack([columns, shifts, errors]), self.residuals.copy()
        for part, private in self.within:
            own_columns = np.array(private, dtype=int)
            others = self.rows + np.flatnonzero(self.jacobian[self.rows :, own_columns].any(axis=1))
            mine = np.append(np.arange(self.rows)[part], others)
            own = self.jacobian[np.ix_(mine, own_columns)]
            basis = spanned(own)
            every[mine], residuals[mine] = left_by(basis, every[mine]), left_by(basis, residuals[mine])
        every, errors = np.split(every, [every.shape[1] - errors.shape[1]], axis=1)
        return every, residuals, errors, shifts

    def _padded(self, columns: Array | None) -> Array:
        """(rows + others, n) with zeros in the rows that are no data."""
        found = np.zeros((len(self.residuals), 0 if columns is None else columns.shape[1]))
        if columns is not None:
            found[: self.rows] = columns
        return found
