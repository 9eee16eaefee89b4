"""The nodes of a scene: particles, the frames of edges, and numbers that move like particles.

Particles are numbered from 0 on, in the order in which they were added. All other nodes are hidden: the first of them
is -1, the next -2. Arrays over all nodes hold the particles in order and behind them the hidden nodes, the first one
last, so that the numbers of both index them (`Scene.nodes`, `Trajectory.nodes`). Arrays over particles have no hidden
nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, per_item, points
from ..arrays.types import Array
from ..errors import SceneError
from .frames import directors_of, normals_of
from .scene_data import SceneData


class SceneNodes(SceneData):
    """A scene to which nodes can be added."""

    def add_particles(self, positions: ArrayLike, mass: ArrayLike, velocity: ArrayLike | None = None) -> Array:
        """Add particles and return their indices.

        Args:
            positions: (n, 3) m.
            mass: one for all or (n,), kg; zero where only named quantities make up the mass.
            velocity: (n, 3) m/s, at rest by default.

        Raises:
            SceneError: shapes, NaN, or negative masses.
        """
        first = self.particle_count
        self._particles.extend(*self._checked(positions, mass, velocity))
        return np.arange(first, self.particle_count)

    def add_hidden(
        self, positions: ArrayLike, mass: ArrayLike, velocity: ArrayLike | None = None, pinned: bool = False
    ) -> Array:
        """Add nodes that are no particles, such as a clamp's stub behind a rope's end, and return their numbers, which
        are negative.

        Args:
            positions, mass, velocity: as of `add_particles`.
            pinned: they stay where they start.

        Raises:
            SceneError: shapes, NaN, or negative masses.
        """
        first = -1 - self.hidden_count
        self._hidden.extend(*self._checked(positions, mass, velocity))
        nodes = np.arange(first, -1 - self.hidden_count, -1)
        self.pinned |= set(nodes.tolist()) if pinned else set()
        return nodes

    def _checked(self, positions: ArrayLike, mass: ArrayLike, velocity: ArrayLike | None) -> tuple[Array, Array, Array]:
        self._building()
        x = points("positions", positions)
        m = per_item("mass", mass, len(x))
        if (m < 0).any():
            raise SceneError(
                "mass", "must not be negative", float(m.min()), "give kg; pin a particle to make it immovable"
            )
        v = np.zeros_like(x) if velocity is None else finite("velocity", velocity, x.shape, SceneError)
        return x, v, m

    def add_directors(self, edges: ArrayLike, directions: ArrayLike, normals: ArrayLike | None = None) -> Array:
        """Give edges material frames and return the numbers of their directors, hidden nodes.

        A director is a vector across its edge, the frame's first axis; it turns about the edge without inertia.

        Args:
            edges: (n, 2) particles that each edge leads from and to.
            directions: (n, 3) initial directions, of any length and not along their edges.
            normals: (n,) of `add_normals`, for sections that shear: the directors stay across them.

        Raises:
            SceneError: shapes, NaN, or a direction along its edge.
        """
        self._building()
        given, axes = self.node_array("edges", edges), None if normals is None else self.node_array("normals", normals)
        q, frames = directors_of(given, directions, axes, self.nodes, self.directors)
        nodes = self.add_hidden(q, 0.0)
        self.directors |= dict(zip(nodes.tolist(), frames, strict=True))
        return nodes

    def add_normals(self, edges: ArrayLike) -> Array:
        """Give edges (n, 2) sections that may lean against them, and return the numbers of the sections' normals,
        hidden nodes. They start along the edges, and turn without inertia.

        Raises:
            SceneError: unknown particles, or an edge without length.
        """
        self._building()
        ends, along = normals_of(self.node_array("edges", edges), self.nodes)
        nodes = self.add_hidden(along, 0.0)
        self.directors |= {n: (a, b, n) for n, (a, b) in zip(nodes.tolist(), ends.tolist(), strict=True)}
        return nodes

    def pin(self, particles: ArrayLike) -> None:
        """Hold particles where they start.

        Raises:
            SceneError: no such particles, or ones that are attached to a body.
        """
        self._building()
        own = self.node_array("pin", particles).tolist()
        self._refuse_attached("pin", own)
        self.pinned |= set(own)

    def _refuse_attached(self, field: str, which: Sequence[int]) -> None:
        """Refuse to hold what a body moves already."""
        for body in self.bodies.values():
            if bad := sorted(body.attached.keys() & which):
                fix = "leave them out, or pin or drive the body"
                raise SceneError(f"{field}.particles", f"are attached to the body '{body.name}'", bad, fix)

    def add_rotor(self, name: str) -> int:
        """Add a number that has inertia and no weight, the x of the hidden node that is returned, such as the angle of
        a motor's rotor; quantities give it its inertia [kg m^2]."""
        self._building()
        nodes = self.add_hidden(np.zeros((4, 3)), np.array([1.0, 0.0, 1e-12, 1e-12])).tolist()
        self.pinned |= {nodes[0], nodes[2], nodes[3]}
        self.rotors[name] = [*nodes, None]
        return int(nodes[1])

    def shift_base(self, particle: int, by: ArrayLike) -> None:
        """Move the plain part of a node's position, (3,) m, where terms make up the rest."""
        self._building()
        rows = self._particles if particle >= 0 else self._hidden
        rows.positions.values[particle if particle >= 0 else -1 - particle] += np.asarray(by, dtype=float)
