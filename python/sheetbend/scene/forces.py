"""Forces on particles that are given over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite
from ..arrays.timeseries import linear
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import Expression, Factors, by_factors
from ..quantities.quantities import Term


def spread_over(forces: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Given forces, broadcast to a shape.

    Raises:
        SceneError: they have another shape, or are not finite.
    """
    given = finite("add_force.forces", forces, None, SceneError)
    try:
        return np.broadcast_to(given, shape)
    except ValueError as error:
        raise SceneError("add_force.forces", "has the wrong shape", given.shape, f"give {shape}") from error


def shares(knots: Array, times: Array) -> list[list[tuple[int, float]]]:
    """By knot, the times at which its value counts and its weight there, in what is linear between knots."""
    found = []
    for k in range(len(knots)):
        first, last = max(k - 1, 0), min(k + 1, len(knots) - 1)
        low = 0 if k == 0 else int(np.searchsorted(times, knots[first]))
        high = len(times) if k == len(knots) - 1 else int(np.searchsorted(times, knots[last], "right"))
        hat = (np.arange(first, last + 1) == k).astype(float)
        weights = np.interp(times[low:high], knots[first : last + 1], hat)
        found.append([(low + int(i), float(weights[i])) for i in np.flatnonzero(weights)])
    return found


def _checked(times: ArrayLike) -> Array:
    t = finite("add_force.times", times, None, SceneError).ravel()
    check_increasing("add_force.times", t)
    return t


class Forces:
    """The forces of a scene, at one set of knots: those of all forces.

    Attributes:
        particles: that forces act on.
        times: (knots,) s.
    """

    def __init__(self) -> None:
        self.particles: list[int] = []
        self.times: Array = np.zeros(0)
        self._values: list[Array] = []
        self._terms: list[tuple[int, int, int, float, Factors]] = []
        self._varied: list[tuple[list[int], Array, Array, tuple[str, str, str], Factors]] = []

    def add(self, particles: Array, forces: ArrayLike, times: ArrayLike) -> None:
        """See `Scene.add_force`."""
        which: list[int] = particles.tolist()
        t = _checked(times)
        f = spread_over(forces, (len(t), len(which), 3))
        twice = set(which) & set(self.particles)
        if twice:
            fix = "sum the forces and add them once"
            raise SceneError("add_force.particles", "are loaded already", sorted(twice), fix)
        self._join(t)
        self.particles += which
        self._values += [linear(t, f[:, k], self.times) for k in range(len(which))]

    def push(self, particles: list[int], forces: Array, times: ArrayLike) -> None:
        """Add expressions (knots, k, 3) N to the forces on particles, which may be loaded already."""
        t = _checked(times)
        self._join(t)
        self._load(particles)
        by = shares(t, self.times)
        for factors, coefficients in by_factors(forces).items():
            self._terms += [
                (particles[k], at, int(axis), share * float(coefficients[knot, k, axis]), factors)
                for knot, k, axis in np.argwhere(coefficients != 0.0)
                for at, share in by[knot]
            ]

    def vary(
        self,
        particles: list[int],
        weights: Sequence[Expression],
        times: Array,
        shapes: Array,
        names: Sequence[Sequence[str]],
    ) -> None:
        """Add a force over time in modes: quantities, three for each mode, times its shape over the knots.

        Args:
            particles: that it acts on, which may be loaded already.
            weights: of the force on each.
            times: (knots,) s.
            shapes: (knots, modes).
            names: by mode and axis.
        """
        self._join(times)
        self._load(particles)
        at_knots = linear(times, shapes, self.times)
        parts: dict[Factors, list[tuple[int, float]]] = {}
        for particle, weight in zip(particles, weights, strict=True):
            for factors, share in weight.parts.items():
                parts.setdefault(factors, []).append((particle, share))
        for factors, own in parts.items():
            nodes, by = [p for p, _ in own], np.array([share for _, share in own])
            for shape, (x, y, z) in zip(at_knots.T, names, strict=True):
                self._varied.append((nodes, by, shape, (x, y, z), factors))

    def _load(self, particles: list[int]) -> None:
        """Let forces act on particles, which may be loaded already: zero at the present knots."""
        known = set(self.particles)
        new = [p for p in particles if p not in known]
        self.particles += new
        self._values += [np.zeros((len(self.times), 3)) for _ in new]

    def _join(self, times: Array) -> None:
        """Take these knots (knots,) too. Forces that were added before go on as they were."""
        before, self.times = self.times, np.union1d(self.times, times) if self.particles else times
        if not self.particles or np.array_equal(before, self.times):
            return
        by = shares(before, self.times)
        self._values = [linear(before, f, self.times) for f in self._values]
        self._terms = [
            (p, at, axis, weight * share, factors)
            for p, knot, axis, share, factors in self._terms
            for at, weight in by[knot]
        ]
        self._varied = [
            (nodes, share, linear(before, shape, self.times), names, factors)
            for nodes, share, shape, names, factors in self._varied
        ]

    def terms(self) -> list[Term]:
        """Their places are known once every loaded particle is."""
        slot, loads = {p: k for k, p in enumerate(self.particles)}, len(self.particles)
        given = [
            Term("force", 3 * (knot * loads + slot[p]) + axis, share, factors)
            for p, knot, axis, share, factors in self._terms
        ]
        knots = loads * np.arange(len(self.times))[:, None]
        varied = [
            Term(
                "force",
                (3 * (knots + [slot[p] for p in nodes]) + axis).ravel(),
                np.outer(shape, share).ravel(),
                (*factors, (name, "identity")),
            )
            for nodes, share, shape, names, factors in self._varied
            for axis, name in enumerate(names)
        ]
        return [*given, *varied]

    @property
    def values(self) -> Array:
        """(knots, particles, 3) N."""
        return np.stack(self._values, axis=1) if self._values else np.zeros(0)
