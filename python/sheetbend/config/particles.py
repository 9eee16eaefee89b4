"""References of a configuration to particles, and what they mean in its scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..errors import ConfigError
from ..mesh import SolidMesh, TriangleMesh
from ..objects.arm_data import Arm
from ..objects.cloth import Cloth
from ..objects.rope import Rope
from ..objects.solid import Solid


@dataclass
class Particles:
    """Particle references of a configuration ("NAME:INDEX", "NAME:LABEL") and what they mean in a scene.

    Numbers of nodes and vertices count on the configured mesh: `finer` tells how many links one configured link of a
    rope has become, and a vertex of a cloth is the one nearest to where it was.

    Attributes:
        finer: by how many links one configured link of a rope is replaced.
        named: particles by name of a rope, cloth, solid, arm or set.
        labels: of these names, the particles that a text names, such as "start".
        ropes: those names that are ropes' and rods'.
        arms: by name.
    """

    finer: int = 1
    named: dict[str, list[int]] = field(default_factory=dict)
    labels: dict[str, dict[str, int]] = field(default_factory=dict)
    ropes: set[str] = field(default_factory=set)
    arms: dict[str, Arm] = field(default_factory=dict)

    def free_name(self, path: str, name: str) -> str:
        """Return a name that nothing has yet.

        Args:
            path: of the table, for the error.

        Raises:
            ConfigError: it is taken.
        """
        if name in self.named:
            raise ConfigError(
                f"{path}.name",
                "is taken",
                name,
                "give every rope, cloth, solid, arm and set of particles a name of its own",
            )
        return name

    def add(self, name: str, particles: Sequence[int]) -> None:
        """Give particles a name, so that "NAME:INDEX" finds them."""
        self.named[name] = [int(p) for p in particles]

    def add_rope(self, rope: Rope) -> None:
        """Add the nodes of a rope or rod, with the labels "start" and "end"."""
        self.add(rope.name, rope.particles.tolist())
        self.labels[rope.name] = {"start": int(rope.particles[0]), "end": int(rope.particles[-1])}
        self.ropes.add(rope.name)

    def add_cloth(self, cloth: Cloth, configured: TriangleMesh) -> None:
        """Add a cloth: for each vertex of the configured mesh (m), the particle nearest to it; with the mesh's sets."""
        self.add(cloth.name, cloth.particles[cloth.mesh.nearest(configured.vertices)].tolist())
        self.labels[cloth.name] = _labels(cloth)

    def add_solid(self, solid: Solid, configured: SolidMesh) -> None:
        """Add a solid, in the same way as a cloth."""
        self.add(solid.name, solid.particles[solid.mesh.nearest(configured.vertices)].tolist())
        self.labels[solid.name] = _labels(solid)

    def add_arm(self, arm: Arm) -> None:
        """Add an arm or a pendulum, with the labels "pivot" and "end"."""
        self.add(arm.name, arm.particles)
        self.labels[arm.name] = {"pivot": arm.pivot, "end": arm.end}
        self.arms[arm.name] = arm

    def nodes(self, path: str, rope: str, numbers: Sequence[int]) -> list[int]:
        """Return the particles of a rope's nodes, by their numbers in the configured rope.

        Args:
            path: of the key, for the error.
            rope: its name.
            numbers: from 0, or from -1 down for those counted from the end.

        Raises:
            ConfigError: the rope has no such node.
        """
        return [self._entry(path, rope, n) for n in numbers]

    def find(self, path: str, reference: str) -> int:
        """Return the particle of a reference.

        Args:
            path: of the key, for the error.
            reference: "NAME", "NAME:INDEX" or "NAME:LABEL".

        Raises:
            ConfigError: no such rope or set, or no such entry in it.
        """
        name, _, index = reference.partition(":")
        if name not in self.named:
            raise ConfigError(
                path,
                "names no rope, cloth, solid or set of particles",
                reference,
                f"use one of: {', '.join(self.named) or 'none yet'}",
            )
        if not index:
            if len(self.named[name]) != 1:
                raise ConfigError(
                    path,
                    f"is not one particle: '{name}' has {len(self.named[name])}",
                    reference,
                    f"write such as '{name}:0'",
                )
            return self.named[name][0]
        labels = self.labels.get(name, {})
        if index in labels:
            return labels[index]
        if not index.removeprefix("-").isdecimal():
            words = "".join(f", '{name}:{label}'" for label in labels if ":" not in label or label.endswith(":0"))
            raise ConfigError(
                path, "has no whole number behind the colon", reference, f"write such as '{name}:0'{words}"
            )
        return self._entry(path, name, int(index))

    def _entry(self, path: str, name: str, number: int) -> int:
        particles = self.named[name]
        finer = self.finer if name in self.ropes else 1
        at = number * finer if number >= 0 else -1 + (number + 1) * finer
        if not -len(particles) <= at < len(particles):
            count = (len(particles) - 1) // finer + 1
            raise ConfigError(
                path,
                f"does not exist: '{name}' has {count} particles",
                number,
                f"use 0 to {count - 1}, or -1 for the last",
            )
        return particles[at]


def _labels(sheet: Cloth | Solid) -> dict[str, int]:
    """Particles of the sets of a mesh: "SET:0", "SET:1", ..., and "SET" where it has one."""
    return {
        label: int(sheet.particles[vertex])
        for name, vertices in sheet.mesh.sets.items()
        for k, vertex in enumerate(vertices)
        for label in ([name, f"{name}:0"] if len(vertices) == 1 else [f"{name}:{k}"])
    }
