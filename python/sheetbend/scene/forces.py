"""Forces on particles that are given over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite, indices
from ..errors import SceneError
from ..quantities.quantities import Term

Array = np.ndarray


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
        self._terms: list[tuple[int, int, int, str]] = []

    def add(self, particles: ArrayLike, forces: ArrayLike, times: ArrayLike, particle_count: int) -> None:
        """See `Scene.add_force`."""
        which = indices("add_force.particles", particles, particle_count)
        t = finite("add_force.times", times, None, SceneError).ravel()
        shape = (len(t), len(which), 3)
        f = finite("add_force.forces", np.broadcast_to(forces, shape), shape, SceneError)
        check_increasing("add_force.times", t)
        if self.particles and (t.shape != self.times.shape or (t != self.times).any()):
            fix = "use one set of knots"
            raise SceneError("add_force.times", "differ from those of forces added before", len(t), fix)
        twice = set(which) & set(self.particles)
        if twice:
            fix = "sum the forces and add them once"
            raise SceneError("add_force.particles", "are loaded already", sorted(twice), fix)
        self.times = t
        self.particles += which
        self._values += [f[:, k] for k in range(len(which))]

    def add_term(self, particle: int, knot: int, axis: int, quantity: str) -> None:
        """Add a quantity to a force along an axis at a knot."""
        self._terms.append((particle, knot, axis, quantity))

    def terms(self) -> list[Term]:
        """Their places are known once every loaded particle is."""
        slot, loads = {p: k for k, p in enumerate(self.particles)}, len(self.particles)
        return [
            Term("force", 3 * (knot * loads + slot[p]) + axis, 1.0, ((quantity, "identity"),))
            for p, knot, axis, quantity in self._terms
        ]

    @property
    def values(self) -> Array:
        """(knots, particles, 3) N."""
        return np.stack(self._values, axis=1) if self._values else np.zeros(0)
