"""Markers over time as a file holds them: the fields of a `Recording`, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array
from ..files.names import checked_name
from .recording_checks import (
    check_seen,
    checked_gravity,
    checked_markers,
    checked_metadata,
    checked_positions,
    checked_times,
    marker_indices,
)

UNNAMED = "recording"
"""The name of a recording that was given none; from a file it takes the file's."""


@dataclass(frozen=True, eq=False)
class MarkerData:
    """The content of a `Recording`, which has the same fields. A reader gives them as they stand in its file, in the
    file's unit of length, which it names in metadata["units"].

    Raises:
        RecordingError: as `Recording`.
    """

    positions: Array
    times: Array
    markers: tuple[str, ...] = ()
    clamped: tuple[int, ...] = ()
    name: str = UNNAMED
    gravity: Array | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        positions = checked_positions(self.positions)
        markers = checked_markers(self.markers, positions.shape[1])
        check_seen(positions, markers)
        self._set(
            positions=read_only(positions),
            times=read_only(checked_times(self.times, len(positions))),
            markers=markers,
            clamped=marker_indices("clamped", self.clamped, markers),
            gravity=None if self.gravity is None else read_only(checked_gravity(self.gravity)),
            metadata=checked_metadata(self.metadata),
        )
        checked_name("name", self.name)

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(frames, markers): True where the marker was seen."""
        return ~np.isnan(self.positions[:, :, 0])

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the markers that are not clamped: those that a simulation must explain."""
        driven = set(self.clamped)
        return tuple(i for i in range(len(self.markers)) if i not in driven)

    def _set(self, **fields: Any) -> None:
        for key, value in fields.items():
            object.__setattr__(self, key, value)


def read_only(array: Array) -> Array:
    """A copy in double precision that refuses to be written to."""
    array = np.array(array, dtype=np.float64, order="C")
    array.setflags(write=False)
    return array
