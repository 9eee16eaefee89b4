"""An array that grows at its end."""

from __future__ import annotations

import numpy as np

from .types import Array


class Column:
    """Rows (n, width), or numbers (n,) where width is None. Rows are joined when they are read, not when they come."""

    def __init__(self, width: int | None = None) -> None:
        self._parts = [np.zeros((0,) if width is None else (0, width))]
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def extend(self, rows: Array) -> None:
        """Append a copy of rows."""
        self._parts.append(np.array(rows, dtype=float))
        self._count += len(rows)

    @property
    def values(self) -> Array:
        """All rows; writing to them changes the column."""
        if len(self._parts) > 1:
            self._parts = [np.concatenate(self._parts)]
        return self._parts[0]
