"""Forces on particles that are given over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite
from ..errors import SceneError
from ..quantities.expression import Factors, by_factors
from ..quantities.quantities import Term

Array = np.ndarray


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


class Forces:
    """The forces of a scene, at one set of knots.

    Attributes:
        particles: that forces act on.
        times: (knots,) s.
    """

    def __init__(self) -> None:
        self.particles: list[int] = []
        self.times: Array = np.zeros(0)
        self._values: list[Array] = []
        self._terms: list[tuple[int, int, int, float, Factors]] = []

    def add(self, particles: Array, forces: ArrayLike, times: ArrayLike) -> None:
        """See `Scene.add_force`."""
        which: list[int] = particles.tolist()
        t = self._checked(times)
        f = spread_over(forces, (len(t), len(which), 3))
        twice = set(which) & set(self.particles)
        if twice:
            fix = "sum the forces and add them once"
            raise SceneError("add_force.particles", "are loaded already", sorted(twice), fix)
        self.times = t
        self.particles += which
        self._values += [f[:, k] for k in range(len(which))]

    def push(self, particles: list[int], forces: Array, times: ArrayLike) -> None:
        """Add expressions (knots, k, 3) N to the forces on particles, which may be loaded already."""
        t = self._checked(times)
        new = [p for p in particles if p not in self.particles]
        self.times = t
        self.particles += new
        self._values += [np.zeros((len(t), 3)) for _ in new]
        for factors, coefficients in by_factors(forces).items():
            self._terms += [
                (particles[k], int(knot), int(axis), float(coefficients[knot, k, axis]), factors)
                for knot, k, axis in np.argwhere(coefficients != 0.0)
            ]

    def add_term(self, particle: int, knot: int, axis: int, quantity: str) -> None:
        """Add a quantity to a force along an axis at a knot."""
        self._terms.append((particle, knot, axis, 1.0, ((quantity, "identity"),)))

    def _checked(self, times: ArrayLike) -> Array:
        t = finite("add_force.times", times, None, SceneError).ravel()
        check_increasing("add_force.times", t)
        if self.particles and (t.shape != self.times.shape or (t != self.times).any()):
            fix = "use one set of knots"
            raise SceneError("add_force.times", "differ from those of forces added before", len(t), fix)
        return t

    def terms(self) -> list[Term]:
        """Their places are known once every loaded particle is."""
        slot, loads = {p: k for k, p in enumerate(self.particles)}, len(self.particles)
        return [
            Term("force", 3 * (knot * loads + slot[p]) + axis, share, factors)
            for p, knot, axis, share, factors in self._terms
        ]

    @property
    def values(self) -> Array:
        """(knots, particles, 3) N."""
        return np.stack(self._values, axis=1) if self._values else np.zeros(0)
