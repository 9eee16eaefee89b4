"""The correction of recorded motion that drives a scene: which numbers it has, and what they move.

A recorded marker that drives particles is off by its noise, and the noise drives them too. A softer sheet passes less
of it on, so a fit that takes such a motion for the truth is drawn to the wrong stiffness, as any regression on noisy
inputs. The cure is the motion's error as unknowns with a prior (errors in variables: Deming 1943, Statistical
Adjustment of Data): one number for every driving marker, knot and axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import timeseries
from ..arrays.types import Array
from ..recording.recording import Recording

if TYPE_CHECKING:
    from ..scene.boundary import Boundary
    from ..scene.scene import Scene

KNOTS_BEYOND = 3  # a cubic piece reaches two knots on, and the substep behind the last frame counts


@dataclass(frozen=True, eq=False)
class Correction:
    """Numbers (knots, markers, 3) m that are added to the markers which drive a scene.

    Attributes:
        markers: names.
        knots: how many of the motion's knots the compared frames feel.
        first: (numbers + 1,) per number the places of what it moves, and one past the last.
        target: places in the array "boundary".
        weight: by which each is moved.
    """

    markers: tuple[str, ...]
    knots: int
    first: Array
    target: Array
    weight: Array

    @classmethod
    def of(cls, scene: Scene, until: float | None) -> Correction | None:
        """Of a scene whose compared frames end at `until` s, or that rests at 0 s (None); None where it follows no
        markers."""
        boundary = scene.boundary
        markers = tuple(dict.fromkeys(m for part in boundary.following for m in part.markers))
        if not markers:
            return None
        every = len(boundary.times)
        next_knot = int(np.searchsorted(boundary.times, (0.0 if until is None else until) - 1e-9))
        rests_on_knot = until is None and next_knot < every and boundary.times[next_knot] < 1e-9
        knots = min(every, next_knot + (1 if rests_on_knot else KNOTS_BEYOND))
        # All knots but the first move the same, each at its own place.
        begin = [_of_knot(boundary, markers, knot) for knot in range(min(2, knots))]
        later = np.arange(1, knots - len(begin) + 1)
        length, target, weight = (np.concatenate([part[k] for part in begin]) for k in range(3))
        each, places, by = begin[-1]
        length = np.append(length, np.tile(each, len(later)))
        target = np.append(target, places + 3 * len(boundary.driven) * later[:, None])
        weight = np.append(weight, np.tile(by, len(later)))
        return cls(markers, knots, np.concatenate([[0], np.cumsum(length)]), target, weight)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(knots, markers, 3)."""
        return self.knots, len(self.markers), 3

    def added(self, values: Array, numbers: Array) -> Array:
        """The array "boundary" (knots, driven, 3) m with numbers (knots, markers, 3) m added to the markers."""
        moved = np.array(values)
        by = self.weight * np.repeat(numbers.ravel(), np.diff(self.first))
        np.add.at(moved.reshape(-1), self.target, by)
        return moved

    def core(self, offset: int, sigma: float, given: Array | None) -> dict[str, Any]:
        """For the compiled core.

        Args:
            offset: of the boundary among the inputs.
            sigma: m, of the prior; 0 = the numbers stay as given.
            given: (knots or fewer, markers, 3) m, zero by default and for later knots.
        """
        full = np.zeros(self.shape)
        if given is not None:
            full[: len(given)] = given[: self.knots]
        return {
            "sigma": np.full(full.size, sigma),
            "given": full.ravel(),
            "first": self.first,
            "target": offset + self.target,
            "weight": self.weight,
        }


def _of_knot(boundary: Boundary, markers: tuple[str, ...], knot: int) -> tuple[Array, Array, Array]:
    """How many places each number of a knot moves, the places in the array "boundary", and the weights."""
    length, target, weight = [], [], []
    for marker in markers:
        moved, by = [np.zeros(0, dtype=int)], [np.zeros(0)]
        for part in boundary.following:
            if marker not in part.markers:
                continue
            w = part.weights[:, part.markers.index(marker)]
            slots, w = part.slots[w != 0.0], w[w != 0.0]
            at = np.array([knot])
            if part.from_placed and knot == 0:  # all that follows counts from there
                at, w = np.arange(1, len(boundary.times)), -w
            moved.append((len(boundary.driven) * at[:, None] + slots).ravel())
            by.append(np.tile(w, len(at)))
        for axis in range(3):
            target.append(3 * np.concatenate(moved) + axis)
            weight.append(np.concatenate(by))
            length.append(len(target[-1]))
    return np.array(length), np.concatenate(target), np.concatenate(weight)


def recorded_noise(recording: Recording, markers: tuple[str, ...]) -> float | None:
    """Deviation [m] of one coordinate of markers from the recording itself (`timeseries.noise`), root mean square over
    them; None where there are no such markers, or too few frames show it."""
    if not markers or not set(markers) <= set(recording.markers):
        return None
    chosen = recording.select(markers)
    found = timeseries.noise(chosen.times, chosen.positions)
    return float(np.sqrt(np.mean(found**2))) if np.isfinite(found).all() else None
