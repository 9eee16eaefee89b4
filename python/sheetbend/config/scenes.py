"""One recording's scene, built from the shared description."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import ConfigError
from ..mesh import SolidMesh, TriangleMesh
from ..objects.arm import add_arm, add_pendulum
from ..objects.arm_data import Arm
from ..objects.cloth import Cloth
from ..objects.rope import Rope
from ..objects.solid import Solid
from ..objects.tool import Tool
from ..scene.scene import Scene
from . import scene_schema as schema
from .bodies import add_bodies
from .cloth_markers import seats
from .cloths import build_cloth, placed_mesh
from .contacts import add_contacts
from .errors import located
from .forces_on import add_forces
from .moment import Moment
from .rope_points import Seats
from .ropes import build_rope
from .solids import build_solid
from .tools import tool_named
from .winds import add_winds

EARTH = (0.0, 0.0, -9.81)  # m/s^2


@dataclass
class Particles:
    """Particle references of a configuration ("NAME:INDEX", "NAME:LABEL") and what they mean in a scene.

    Numbers of nodes and vertices count on the configured mesh: `finer` tells how many links one configured link of a
    rope has become, and a vertex of a cloth is the one nearest to where it was.
    """

    finer: int = 1
    named: dict[str, list[int]] = field(default_factory=dict)
    labels: dict[str, dict[str, int]] = field(default_factory=dict)
    ropes: set[str] = field(default_factory=set)
    arms: dict[str, Arm] = field(default_factory=dict)

    def free_name(self, path: str, name: str) -> str:
        """The name, unless it is taken."""
        if name in self.named:
            raise ConfigError(
                f"{path}.name",
                "is taken",
                name,
                "give every rope, cloth, solid, arm and set of particles a name of its own",
            )
        return name

    def add(self, name: str, particles: Sequence[int]) -> None:
        self.named[name] = [int(p) for p in particles]

    def add_rope(self, rope: Rope) -> None:
        self.add(rope.name, rope.particles.tolist())
        self.labels[rope.name] = {"start": int(rope.particles[0]), "end": int(rope.particles[-1])}
        self.ropes.add(rope.name)

    def add_cloth(self, cloth: Cloth, configured: TriangleMesh) -> None:
        self.add(cloth.name, cloth.particles[cloth.mesh.nearest(configured.vertices)].tolist())
        self.labels[cloth.name] = _labels(cloth)

    def add_solid(self, solid: Solid, configured: SolidMesh) -> None:
        self.add(solid.name, solid.particles[solid.mesh.nearest(configured.vertices)].tolist())
        self.labels[solid.name] = _labels(solid)

    def add_arm(self, arm: Arm) -> None:
        self.add(arm.name, arm.particles)
        self.labels[arm.name] = {"pivot": arm.pivot, "end": arm.end}
        self.arms[arm.name] = arm

    def nodes(self, path: str, rope: str, numbers: Sequence[int]) -> list[int]:
        """Particles of node numbers of a rope."""
        return [self._entry(path, rope, n) for n in numbers]

    def find(self, path: str, reference: str) -> int:
        """The particle of a reference.

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


def build_scene(
    name: str,
    section: schema.SceneSection,
    moment: Moment | None,
    placed: Mapping[str, Seats],
    finer: int = 1,
    ropes: Sequence[str] | None = None,
    folder: Path = Path(),
    tools: Mapping[str, Tool] | None = None,
) -> tuple[Scene, Particles]:
    """A scene and the meaning of its particle references.

    Args:
        moment: the recording's part; None without a recording.
        placed: per rope the markers on it, in order along it, for `points = "recording"`.
        finer: multiplies the segments of every rope and the cells of every cloth.
        ropes: names of the ropes and rods to build; None = all.
        folder: files of meshes are relative to it.
        tools: by name, on the scene's clock; none by default.

    Raises:
        ConfigError: anything inconsistent, with the path of the table.
    """
    tools = tools or {}
    recorded = None if moment is None else moment.recording.gravity
    gravity = section.gravity if section.gravity is not None else EARTH if recorded is None else recorded
    scene, particles = Scene(name, gravity), Particles(finer)
    add_bodies(scene, section, tools)
    for path, rope in section.strands:
        if ropes is not None and rope.name not in ropes:
            continue
        particles.free_name(path, rope.name)
        particles.add_rope(build_rope(scene, path, rope, moment, placed.get(rope.name, []), finer, tools))
        if rope.pinned:
            scene.pin(particles.nodes(f"{path}.pinned", rope.name, rope.pinned))
    meshes = [placed_mesh(f"scene.cloth[{i}]", cloth, folder, finer, tools) for i, cloth in enumerate(section.cloth)]
    by_name = {cloth.name: mesh for cloth, mesh in zip(section.cloth, meshes, strict=True)}
    seated = {} if moment is None else seats(section.cloth, by_name, moment.whole)
    for i, (cloth, mesh) in enumerate(zip(section.cloth, meshes, strict=True)):
        path = f"scene.cloth[{i}]"
        particles.free_name(path, cloth.name)
        own = {marker: place for marker, (on, place) in seated.items() if on == cloth.name}
        coarse = mesh if finer == 1 else placed_mesh(path, cloth, folder, 1, tools)
        if cloth.markers == "vertices" and moment is not None:
            _check_sequence(f"{path}.markers", coarse, moment)
        particles.add_cloth(build_cloth(scene, path, cloth, mesh, own, moment, tools), coarse)
    for i, solid in enumerate(section.solid):
        path = f"scene.solid[{i}]"
        particles.free_name(path, solid.name)
        particles.add_solid(*build_solid(scene, path, solid, folder, finer))
    add_winds(scene, section)
    for i, some in enumerate(section.particles):
        path = f"scene.particles[{i}]"
        particles.free_name(path, some.name)
        with located(path):
            added = scene.add_particles(some.positions, some.mass, some.velocity)
            if some.pinned:
                scene.pin(added)
        particles.add(some.name, added.tolist())
    for i, pendulum in enumerate(section.pendulum):
        _add_arm(scene, particles, f"scene.pendulum[{i}]", pendulum)
    for i, arm in enumerate(section.arm):
        _add_arm(scene, particles, f"scene.arm[{i}]", arm)
    for i, group in enumerate(section.constraints):
        path = f"scene.constraints[{i}]"
        stencils = [[particles.find(f"{path}.particles", r) for r in one] for one in group.particles]
        with located(path, group.name or group.kind):
            _same_length(path, stencils)
            fields = group.model_dump(exclude={"particles", "kind"}, exclude_none=True)
            scene.add_constraints(group.kind, stencils, **fields)
    for i, mass in enumerate(section.point_mass):
        path = f"scene.point_mass[{i}]"
        with located(path):
            scene.add_point_mass(particles.find(f"{path}.particle", mass.particle), mass.mass, mass.name)
    for quantity, extra in section.quantities.items():
        with located(f"scene.quantities.{quantity}"):
            scene.add_quantity(quantity, **extra.model_dump())
    add_forces(scene, section.force, particles.find)
    for i, drive in enumerate(section.drive):
        _add_drive(scene, particles, f"scene.drive[{i}]", drive, moment, tools)
    add_contacts(scene, section, particles.named, tools, folder)
    if section.pin:
        scene.pin([particles.find("scene.pin", r) for r in section.pin])
    return scene, particles


def _check_sequence(path: str, mesh: TriangleMesh, moment: Moment) -> None:
    vertices = sum(re.fullmatch(r"v\d+", name) is not None for name in moment.recording.markers)
    if vertices != len(mesh.vertices):
        fix = "give the mesh of the sequence, such as its first frame, without `merge`"
        raise ConfigError(path, f"are on {len(mesh.vertices)} vertices, and the recording has", vertices, fix)


def _same_length(path: str, stencils: list[list[int]]) -> None:
    if len({len(one) for one in stencils}) > 1:
        raise ConfigError(
            f"{path}.particles",
            "differ in length",
            [len(one) for one in stencils],
            "give every constraint the same number",
        )


def _add_arm(scene: Scene, particles: Particles, path: str, arm: schema.Arm | schema.Pendulum) -> None:
    pivot: Arm | list[float]
    if isinstance(arm.pivot, str):
        if arm.pivot not in particles.arms:
            raise ConfigError(
                f"{path}.pivot",
                "is no arm before this one",
                arm.pivot,
                f"name one of: {', '.join(particles.arms) or 'none yet'}",
            )
        pivot = particles.arms[arm.pivot]
    else:
        pivot = arm.pivot
    fields = arm.model_dump(exclude={"name", "pivot"}, exclude_none=True)
    particles.free_name(path, arm.name)
    with located(path, arm.name):
        add = add_arm if isinstance(arm, schema.Arm) else add_pendulum
        particles.add_arm(add(scene, arm.name, pivot=pivot, **fields))


def _add_drive(
    scene: Scene,
    particles: Particles,
    path: str,
    drive: schema.Drive,
    moment: Moment | None,
    tools: Mapping[str, Tool],
) -> None:
    if drive.markers is None:
        tool = tool_named(f"{path}.tool", drive.tool or "", tools)
        riding = [particles.find(f"{path}.particles", r) for r in drive.particles]
        with located(path):
            tool.drive(scene, riding, drive.points)
        return
    if moment is None:
        raise ConfigError(path, "needs a recording", drive.markers, "add a [[recording]], or pin the particles")
    which = [particles.find(f"{path}.particles", r) for r in drive.particles]
    if len(drive.markers) != len(which):
        raise ConfigError(f"{path}.markers", "do not match the particles", len(drive.markers), f"give {len(which)}")
    with located(path):
        times, positions, names = moment.followed(drive.markers)
        moved = positions + np.array(drive.offset)
        scene.follow(which, times, moved, names, interpolation=drive.interpolation)
