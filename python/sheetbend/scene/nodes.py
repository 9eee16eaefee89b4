"""The nodes of a scene: particles, the frames of edges, and numbers that move like particles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, indices, per_item, points
from ..errors import SceneError
from .frames import Frame, directors_of, normals_of
from .scene_data import SceneData

Array = np.ndarray


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
        self._building()
        x = points("positions", positions)
        m = per_item("mass", mass, len(x))
        if (m < 0).any():
            raise SceneError(
                "mass", "must not be negative", float(m.min()), "give kg; pin a particle to make it immovable"
            )
        v = np.zeros_like(x) if velocity is None else finite("velocity", velocity, x.shape, SceneError)
        first = self.particle_count
        self._positions.extend(x)
        self._velocities.extend(v)
        self._mass.extend(m)
        return np.arange(first, first + len(x))

    def add_directors(self, edges: ArrayLike, directions: ArrayLike, normals: ArrayLike | None = None) -> Array:
        """Give edges material frames and return the indices of their directors, which count as particles.

        A director is a vector across its edge, the frame's first axis; it turns about the edge without inertia.

        Args:
            edges: (n, 2) particles that each edge leads from and to.
            directions: (n, 3) initial directions, of any length and not along their edges.
            normals: (n,) of `add_normals`, for sections that shear: the directors stay across them.

        Raises:
            SceneError: shapes, NaN, or a direction along its edge.
        """
        self._building()
        return self._with_frames(*directors_of(edges, directions, normals, self.positions, self.directors))

    def add_normals(self, edges: ArrayLike) -> Array:
        """Give edges (n, 2) sections that may lean against them, and return the indices of the sections' normals, which
        count as particles. They start along the edges, and turn without inertia.

        Raises:
            SceneError: unknown particles, or an edge without length.
        """
        self._building()
        return self._with_frames(*normals_of(edges, self.positions))

    def _with_frames(self, directions: Array, frames: list[Frame]) -> Array:
        nodes = self.add_particles(directions, 0.0)
        self.directors |= dict(zip(nodes.tolist(), frames, strict=True))
        return nodes

    def pin(self, particles: ArrayLike) -> None:
        """Hold particles where they start."""
        self._building()
        self.pinned |= set(indices("pin", particles, self.particle_count))

    def add_rotor(self, name: str) -> int:
        """Add a number that has inertia and no weight, the x of the particle that is returned, such as the angle of a
        motor's rotor; quantities give it its inertia [kg m^2]."""
        self._building()
        nodes = self.add_particles(np.zeros((4, 3)), np.array([1.0, 0.0, 1e-12, 1e-12]))
        self.pin(nodes[[0, 2, 3]])
        self.rotors[name] = np.append(nodes, -1)
        return int(nodes[1])

    def shift_base(self, particle: int, by: ArrayLike) -> None:
        """Move the plain part of a particle's position, (3,) m, where terms make up the rest."""
        self._building()
        self._positions.values[particle] += np.asarray(by, dtype=float)
