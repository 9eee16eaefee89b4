"""Particles that hit each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import is_number
from ..errors import SceneError
from .balls import Balls
from .contacts import HasParticles
from .self_contact import SelfTouchingScene


class CollidingScene(SelfTouchingScene):
    """A scene under construction whose particles may hit each other."""

    def add_collisions(
        self,
        what: ArrayLike | HasParticles,
        *,
        radius: float | Sequence[float],
        restitution: float,
        name: str = "balls",
    ) -> None:
        """Let particles hit each other like smooth balls; see docs/contact.md.

        Each impact is computed at its time within the substep, and several impacts in one substep in the order of their
        times. Momentum is kept. Works with every method of the solver. Once per scene, with all particles that may hit
        each other; they bounce off shapes if `add_contact` has them too.

        Args:
            what: (n,) particles, also balls on strings and the centers of bodies; none that is pinned, driven or on a
                tether.
            radius: m, one for all (`<name>_contact_radius`), or one for each (`<name>_contact_radius_0` and so on).
            restitution: speed after an impact over that before, along the line of the centers; 0 to 1
                (`<name>_restitution`).
            name: of its quantities.

        Raises:
            SceneError: fewer than two particles, particles that are listed twice, radii or a restitution out of range;
                when the scene is compiled: particles that are pinned, driven or on a tether, or that start inside each
                other.
        """
        self._building()
        if self.contacts.balls is not None:
            raise SceneError("collisions", "were given before", name, "give all particles in one call")
        self.contacts.check_name("collisions.name", name)
        given = what.particles if isinstance(what, HasParticles) else what
        particles = self.node_array("collisions.particles", given)
        if len(particles) < 2:
            raise SceneError("collisions.particles", "are fewer than two", particles.tolist(), "give two or more")
        if len(np.unique(particles)) < len(particles):
            fix = "list each particle once"
            raise SceneError("collisions.particles", "are listed twice", particles.tolist(), fix)
        own: Any = radius.tolist() if isinstance(radius, np.ndarray) else radius  # a number, where it has no axes
        radii: list[Any] = list(own) if isinstance(own, Sequence) else [own]
        if len(radii) not in (1, len(particles)) or not all(is_number(r) and r > 0 for r in radii):
            fix = f"give m, one for all or {len(particles)}, one for each particle"
            raise SceneError("collisions.radius", "must be positive", radius, fix)
        if not (is_number(restitution) and 0 <= restitution <= 1):
            fix = "give the speed after an impact over that before"
            raise SceneError("collisions.restitution", "must be between 0 and 1", restitution, fix)
        several = np.ndim(own) > 0
        names = [f"{name}_contact_radius" + (f"_{i}" if several else "") for i in range(len(radii))]
        for quantity, value in zip(names, radii, strict=True):
            self.add_quantity(quantity, value, "m")
        bounces = self.add_quantity(
            f"{name}_restitution", restitution, "", positive=False, scale=0.1, limits=(0.0, 1.0)
        )
        self.contacts.balls = Balls(name, particles, tuple(names), bounces)
