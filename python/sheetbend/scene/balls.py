"""Particles of a scene with a radius that hit each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term

TOUCHES = 1e-6  # m: so deep two may be in each other at the start


@dataclass(frozen=True, eq=False)
class Balls:
    """Particles that hit each other.

    Attributes:
        name: under which their collisions are counted.
        particles: (n,).
        radii: (n,) the quantity of each, or one for all. None in a scene from a file, whose terms have them already.
        restitution: the quantity of all.
    """

    name: str
    particles: Array
    radii: tuple[str, ...] = ()
    restitution: str = ""

    def terms(self, first_radius: int, restitution: int) -> list[Term]:
        """What makes their radii, which stand in the inputs from `first_radius` on, and their restitution."""
        n = len(self.particles)
        if not self.radii:
            return []
        terms = [Term("restitution", restitution, 1.0, ((self.restitution, "identity"),))]
        if len(self.radii) == 1:
            at = first_radius + np.arange(n)
            return [*terms, Term("contact_radius", at, 1.0, ((self.radii[0], "identity"),))]
        each = enumerate(self.radii)
        return [*terms, *(Term("contact_radius", first_radius + i, 1.0, ((q, "identity"),)) for i, q in each)]

    def expect_apart(self, places: Array, radii: Array, name_of: Callable[[int], str]) -> None:
        """Refuse a start at which two are inside each other.

        Args:
            places: (n, 3) m.
            radii: (n,) m.
            name_of: a particle, in words.
        """
        axis = int(np.argmax(np.ptp(places, axis=0)))  # along which they are spread the most
        order = np.argsort(places[:, axis], kind="stable")
        along = places[order, axis]
        reach = np.searchsorted(along, along + 2 * radii.max(), side="right")  # the last that may be near
        too_near, worst, deepest = 0, (0, 0), TOUCHES
        for k, one in enumerate(order):
            others = order[k + 1 : reach[k]]
            depth = radii[one] + radii[others] - np.linalg.norm(places[one] - places[others], axis=1)
            too_near += int((depth > TOUCHES).sum())
            if len(others) and depth.max() > deepest:
                deepest, worst = float(depth.max()), (int(one), int(others[np.argmax(depth)]))
        if not too_near:
            return
        where = " and ".join(name_of(int(self.particles[k])) for k in sorted(worst))
        problem = f"start inside each other: {where} are {deepest:.3g} m too near; pairs that are too near"
        fix = "let them start farther apart, or give a smaller radius"
        raise SceneError(self.name, problem, too_near, fix)
