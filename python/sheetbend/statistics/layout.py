"""Where the rows of residuals come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Integers = NDArray[np.integer[Any]]


@dataclass(frozen=True)
class Layout:
    """The origin of each residual row, as integer arrays (rows,).

    Attributes:
        recording: which recording; rows of different recordings are independent.
        channel: which series within it (a marker coordinate); channels of one recording may correlate.
        frame: the place within the series: frame number in time, or point number along a static shape.
        kind: of the channel, such as its axis: channels of one kind share an autocorrelation; one kind by default.
        clock: which clock within the recording counts the frames, 0 for all by default; rows of different clocks are
            independent.
    """

    recording: Integers
    channel: Integers
    frame: Integers
    kind: Integers | None = None
    clock: Integers | None = None

    def __post_init__(self) -> None:
        for field, given in (("kind", self.kinds), ("clock", self.clocks)):
            object.__setattr__(self, field, given)
        for field in ("recording", "channel", "frame", "kind", "clock"):
            array = np.asarray(getattr(self, field))
            if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
                raise InputError(f"layout.{field}", "must be one integer per row", array, "give shape (rows,)")
            object.__setattr__(self, field, array)
        lengths = [len(getattr(self, field)) for field in ("recording", "channel", "frame", "kind", "clock")]
        if len(set(lengths)) > 1:
            raise InputError("layout", "has arrays of different lengths", lengths, "give one entry per residual row")
        places = np.stack([self.frame, self.channel, self.clocks, self.recording])
        places = places[:, np.lexsort(places)]
        if (places[:, 1:] == places[:, :-1]).all(axis=0).any():
            fix = "number the recordings, channels and frames apart"
            raise InputError("layout", "has two rows in one place", len(self.frame), fix)

    @property
    def kinds(self) -> Integers:
        """(rows,) `kind`, also where none was given."""
        return np.zeros_like(self.frame) if self.kind is None else self.kind

    @property
    def clocks(self) -> Integers:
        """(rows,) `clock`, also where none was given."""
        return np.zeros_like(self.frame) if self.clock is None else self.clock

    def of(self, rows: NDArray[Any]) -> Layout:
        """The layout of some rows, given as (rows,) bool or as their numbers."""
        places = (self.recording, self.channel, self.frame, self.kinds, self.clocks)
        return Layout(*(place[rows] for place in places))

    @staticmethod
    def series(rows: int) -> Layout:
        """One series of `rows` equally spaced samples."""
        zeros = np.zeros(rows, dtype=int)
        return Layout(zeros, zeros, np.arange(rows))
