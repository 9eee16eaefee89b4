"""A recording for a draft, and what a model makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arrays.timeseries import default_max_gap
from .robot import Poses
from .seen import Seen
from .text import table


@dataclass(frozen=True)
class Take:
    """A recording for a draft: what it shows, how the configuration calls its file and its unit, a sentence about the
    unit, if there is one, and the first frame and the one behind the last, if only these are used."""

    seen: Seen
    file: str
    units: str | None = None
    about_units: str = ""
    frames: tuple[int, int] | None = None

    @property
    def reading(self) -> dict[str, Any]:
        """Keys of [[recording]] that say how the file is read."""
        mend = True if self.seen.recording.mends else None
        return {"file": self.file, "units": self.units, "mend": mend, "frames": self.frames and list(self.frames)}

    @property
    def step(self) -> float:
        """s, the usual time from frame to frame."""
        return float(np.median(np.diff(self.seen.recording.times)))

    @property
    def scene_lines(self) -> list[str]:
        """Those of [scene]: gravity, where the file does not tell it."""
        return [] if self.seen.up_by == "file" else table("[scene]", {"gravity": self.seen.gravity.tolist()})


@dataclass(frozen=True)
class Measured:
    """What was measured beside the recording; None where it was not.

    Attributes:
        density: kg/m of a rope or beam, kg/m^2 of a cloth.
        length: m, of a rope or beam.
        poses: of the robot's tool that holds a cloth.
        weight: kg, of what hangs at the free end of a rope; 0 of an end that is free and carries nothing.
        margin: m, by which a cloth goes on beyond its outer markers.
        at: m, from the clamp of a beam to the only marker on it.
    """

    density: float | None = None
    length: float | None = None
    poses: Poses | None = None
    weight: float | None = None
    at: float | None = None
    margin: float | None = None


class Description(NamedTuple):
    """A model for a recording.

    Attributes:
        kind: what the recording is taken for, in words.
        notes: sentences about what is seen.
        unknown: sentences about what is not known, and what stands in its place.
        lines: of the configuration, without its head.
        up: which way is up, such as "y" or "-z", where the motion shows it.
        driving: names of the markers that move something.
    """

    kind: str
    notes: list[str]
    unknown: list[str]
    lines: list[str]
    up: str | None = None
    driving: tuple[str, ...] = ()


GAP = 0.1  # s, for which a marker that moves something may be lost


def max_gap(times: np.ndarray, seen: np.ndarray) -> float | None:
    """s, the `max_gap` that a configuration needs where markers (frames, k) that move something are lost for longer
    than is closed by default, and not for too long."""
    longest = max((float(np.diff(times[own], prepend=times[0]).max()) for own in seen.T), default=0.0)
    return round(longest + 1e-3, 4) if default_max_gap(times) < longest <= GAP else None
