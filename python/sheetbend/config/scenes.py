"""One recording's scene, built from the shared description."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..errors import ConfigError
from ..mesh import TriangleMesh
from ..objects.arm import add_arm, add_pendulum
from ..objects.arm_data import Arm
from ..objects.pivot import add_air_drag
from ..objects.rod_shape import follow_length
from ..objects.tool import Tool
from ..scene.scene import Scene
from . import scene_schema as schema
from .bodies import add_bodies, fix_to_body
from .cloth_markers import seats
from .cloths import build_cloth, placed_mesh
from .contacts import add_contacts
from .errors import located, of_name
from .loads import add_forces, add_unknown_inputs, add_winds
from .moment import Moment
from .particles import Particles
from .rope_points import Seats
from .ropes import build_rope
from .solids import build_solid
from .tools import tool_named

T = TypeVar("T")
EARTH = (0.0, 0.0, -9.81)  # m/s^2


def build_scene(
    name: str,
    section: schema.SceneSection,
    moment: Moment | None,
    placed: Mapping[str, Seats],
    finer: int,
    ropes: Sequence[str] | None = None,
    folder: Path = Path(),
    tools: Mapping[str, Tool] | None = None,
) -> tuple[Scene, Particles]:
    """Build a scene, and find what its particle references mean.

    Args:
        name: of the scene.
        section: the description that all recordings share.
        moment: the recording's part; None without a recording.
        placed: per rope the markers on it, in order along it, for `points = "recording"`.
        finer: multiplies the segments of every rope and the cells of every cloth.
        ropes: names of the ropes and rods to build; None = all.
        folder: files of meshes are relative to it.
        tools: by name, on the scene's clock; none by default.

    Returns:
        The scene, whose gravity (m/s^2) is that of the section, else that of the recording, else `EARTH`; and its
        particles by reference.

    Raises:
        ConfigError: anything inconsistent, with the path of the table.
    """
    tools = tools or {}
    recorded = None if moment is None else moment.recording.gravity
    gravity = section.gravity if section.gravity is not None else EARTH if recorded is None else recorded
    scene, particles = Scene(name, gravity), Particles(finer)
    add_bodies(scene, section, tools)
    _add_strands(scene, particles, section, ropes, moment, placed, tools)
    _add_cloths(scene, particles, section, moment, folder, tools)
    for path, solid in _each("solid", section.solid):
        particles.free_name(path, solid.name)
        built, configured, means = build_solid(scene, path, solid, folder, finer)
        particles.add_solid(built, configured)
        for name, mean in means.items():
            particles.add(particles.free_name(f"{path}.mean", name), [mean])
    _add_particles(scene, particles, section)
    for path, pendulum in _each("pendulum", section.pendulum):
        _add_arm(scene, particles, path, pendulum)
    for path, arm in _each("arm", section.arm):
        _add_arm(scene, particles, path, arm)
    add_winds(scene, section)
    _add_constraints(scene, particles, section)
    for path, mass in _each("point_mass", section.point_mass):
        with located(path):
            scene.add_point_mass(particles.find(f"{path}.particle", mass.particle), mass.mass, mass.name)
    for quantity, extra in section.quantities.items():
        with located(f"scene.quantities.{quantity}"):
            scene.add_quantity(quantity, **extra.model_dump())
    add_forces(scene, section.force, particles.find)
    add_unknown_inputs(scene, section, moment, particles.find)
    for path, drive in _each("drive", section.drive):
        _add_drive(scene, particles, path, drive, moment, tools)
    add_contacts(scene, section, particles.named, tools, folder)
    if section.pin:
        scene.pin([particles.find("scene.pin", r) for r in section.pin])
    for _, rope in section.strands:
        if rope.points == "recording" and rope.EA is None and rope.name in scene.ropes:
            follow_length(scene, scene.ropes[rope.name])
    return scene, particles


def _each(key: str, tables: Sequence[T]) -> list[tuple[str, T]]:
    """Tables of a list with the path of each."""
    return [(f"scene.{key}[{i}]", table) for i, table in enumerate(tables)]


def _add_strands(
    scene: Scene,
    particles: Particles,
    section: schema.SceneSection,
    wanted: Sequence[str] | None,
    moment: Moment | None,
    placed: Mapping[str, Seats],
    tools: Mapping[str, Tool],
) -> None:
    """Ropes and rods, those that are wanted."""
    for path, rope in section.strands:
        if wanted is not None and rope.name not in wanted:
            continue
        particles.free_name(path, rope.name)
        particles.add_rope(build_rope(scene, path, rope, moment, placed.get(rope.name, []), particles.finer, tools))
        if rope.pinned:
            scene.pin(particles.nodes(f"{path}.pinned", rope.name, rope.pinned))


def _add_cloths(
    scene: Scene,
    particles: Particles,
    section: schema.SceneSection,
    moment: Moment | None,
    folder: Path,
    tools: Mapping[str, Tool],
) -> None:
    """Cloths, with the seats of their markers on them."""
    finer, cloths = particles.finer, _each("cloth", section.cloth)
    meshes = {cloth.name: placed_mesh(path, cloth, folder, finer, tools) for path, cloth in cloths}
    seated = {} if moment is None else seats(section.cloth, meshes, moment.whole)
    for path, cloth in cloths:
        particles.free_name(path, cloth.name)
        own, mesh = {marker: place for marker, (on, place) in seated.items() if on == cloth.name}, meshes[cloth.name]
        coarse = mesh if finer == 1 else placed_mesh(path, cloth, folder, 1, tools)
        if cloth.markers == "vertices" and moment is not None:
            _check_sequence(f"{path}.markers", coarse, moment)
        particles.add_cloth(build_cloth(scene, path, cloth, mesh, own, moment, tools), coarse)


def _add_particles(scene: Scene, particles: Particles, section: schema.SceneSection) -> None:
    for path, some in _each("particles", section.particles):
        particles.free_name(path, some.name)
        with located(path):
            added = scene.add_particles(some.positions, some.mass, some.velocity)
            if some.pinned:
                scene.pin(added)
            if some.drag is not None:
                add_air_drag(scene, added, some.name, some.drag, "N s^2/m^2")
        if some.body is not None:
            fix_to_body(scene, path, some.body, added, some.name)
        particles.add(some.name, added.tolist())


def _add_constraints(scene: Scene, particles: Particles, section: schema.SceneSection) -> None:
    for path, group in _each("constraints", section.constraints):
        stencils = [[particles.find(f"{path}.particles", r) for r in one] for one in group.particles]
        with located(path, group.name or group.kind):
            _same_length(path, stencils)
            fields = group.model_dump(exclude={"particles", "kind"}, exclude_none=True)
            scene.add_constraints(group.kind, stencils, **fields)


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
        pivot = of_name(f"{path}.pivot", "arm before this one", arm.pivot, particles.arms, "none yet")
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
