"""The motion of driven particles."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite
from ..arrays.smoothing import LocalFit
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term


@dataclass(frozen=True, eq=False)
class Following:
    """Driven particles that move with recorded markers.

    Attributes:
        slots: (k,) their places among the driven particles.
        markers: names.
        weights: (k, markers).
        from_placed: they move from where they are placed by what the markers do after the first knot.
    """

    slots: Array
    markers: tuple[str, ...]
    weights: Array
    from_placed: bool


class Boundary:
    """The boundary motion of a scene, at one set of knots.

    Attributes:
        driven: particles and hidden nodes.
        times: (knots,) s.
        interpolation: "cubic" or "linear".
        following: those of the driven particles that move with recorded markers.
        posed: driven particles that move with the poses of a robot's tool, which no marker measured.
        smoothed: by what the recorded motion was smoothed; None = not at all, or by what nobody told.
    """

    def __init__(self) -> None:
        self.driven: list[int] = []
        self.times: Array = np.zeros(0)
        self.interpolation = "cubic"
        self.following: list[Following] = []
        self.posed: set[int] = set()
        self.smoothed: LocalFit | None = None
        self._values: list[Array] = []
        self._terms: list[tuple[Array, Array, dict[str, str]]] = []

    def drive(self, which: Sequence[int], times: ArrayLike, positions: ArrayLike, interpolation: str) -> None:
        """See `Scene.drive`."""
        t = finite("drive.times", times, None, SceneError).ravel()
        check_increasing("drive.times", t)
        x = finite("drive.positions", positions, (len(t), len(which), 3), SceneError)
        if interpolation not in ("cubic", "linear"):
            raise SceneError("drive.interpolation", "is unknown", interpolation, "use 'cubic' or 'linear'")
        if self.driven and (t.shape != self.times.shape or (t != self.times).any()):
            fix = "resample all motions to one set of knots"
            raise SceneError("drive.times", "differ from those of particles driven before", len(t), fix)
        twice = set(which) & set(self.driven)
        if twice:
            raise SceneError("drive.particles", "are driven already", sorted(twice), "drive each particle once")
        self.times, self.interpolation = t, interpolation
        self.driven += which
        self._values += [x[:, k] for k in range(len(which))]

    def follow(
        self,
        which: Sequence[int],
        times: ArrayLike,
        motion: ArrayLike,
        markers: Sequence[str],
        weights: ArrayLike | None,
        placed: ArrayLike | None,
        interpolation: str,
    ) -> None:
        """See `Scene.follow`."""
        names = tuple(markers)
        if not names or len(set(names)) != len(names):
            raise SceneError("follow.markers", "must be names, each once", names, "name every marker of the motion")
        knots = np.size(times)
        x = finite("follow.motion", motion, (knots, len(names), 3), SceneError)
        if weights is None and len(names) != len(which):
            fix = "give weights (particles, markers), or one marker for each particle"
            raise SceneError("follow.markers", "are not one for each particle", len(names), fix)
        w = np.eye(len(which)) if weights is None else weights
        w = finite("follow.weights", w, (len(which), len(names)), SceneError)
        x = np.einsum("pm,kma->kpa", w, x)
        if placed is not None:
            x = x - x[0] + finite("follow.placed", placed, (len(which), 3), SceneError)
        first = len(self.driven)
        self.drive(which, times, x, interpolation)
        self.following.append(Following(first + np.arange(len(which)), names, w, placed is not None))

    def add_term(
        self, particles: ArrayLike, coefficients: ArrayLike, factors: Mapping[str, str], quantities: Collection[str]
    ) -> None:
        """See `Scene.add_motion_term`."""
        slot = {p: k for k, p in enumerate(self.driven)}
        which = [int(p) for p in np.ravel(particles)]
        loose = [p for p in which if p not in slot]
        if loose:
            raise SceneError("particle", "is not driven", loose[0], "drive it first")
        shape = (len(self.times), *np.shape(particles), 3)
        values = finite("coefficients", coefficients, shape, SceneError).reshape(len(self.times), len(which), 3)
        missing = [q for q in factors if q not in quantities]
        if missing:
            raise SceneError("factors", "use unknown quantities", missing, "declare them with add_quantity")
        self._terms.append((np.array([slot[p] for p in which]), values, dict(factors)))

    def terms(self) -> list[Term]:
        """Terms of all motions; their places are known once every driven particle is."""
        knots = 3 * len(self.driven) * np.arange(len(self.times))[:, None, None]
        found = []
        for slots, values, factors in self._terms:
            axes = np.flatnonzero(values.any(axis=(0, 1)))  # the others get nothing
            places = knots + 3 * slots[:, None] + axes
            found.append(Term("boundary", places.ravel(), values[..., axes].ravel(), tuple(factors.items())))
        return found

    def moved(self, values: Array) -> Boundary:
        """The same boundary with other plain motions (knots, driven, 3) m."""
        made = copy.copy(self)
        made._values = list(np.moveaxis(values, 1, 0))
        return made

    @property
    def values(self) -> Array:
        """(knots, driven, 3) m, the plain part of the motion."""
        return np.stack(self._values, axis=1) if self._values else np.zeros(0)
