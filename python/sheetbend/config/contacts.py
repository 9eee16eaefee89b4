"""Contacts of a configuration's ropes and cloths with shapes that stand, move at knots, or move with a tool."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ..errors import ConfigError
from ..mesh import TriangleMesh, read_mesh
from ..objects.tool import Tool
from ..scene.body_points import box_corners
from ..scene.colliders import Collider
from ..scene.scene import Scene
from .body_schema import BodySection
from .contact_schema import SHAPES, ColliderSection, ContactSection, arguments
from .errors import located, of_name
from .scene_schema import SceneSection
from .solver_schema import SolverSection
from .tools import tool_named


def check_solver(section: SceneSection, solver: SolverSection) -> None:
    """Contacts need a solver that knows them.

    Raises:
        ConfigError: another method, with the line that [solver] needs.
    """
    method = solver.model_dump()["method"]
    if section.contact and method not in ("implicit", "gauss_seidel"):
        fix = 'write method = "implicit" in [solver], or "gauss_seidel" for cloth in many short substeps'
        raise ConfigError("solver.method", "does not know [[scene.contact]]", method, fix)
    if section.self_contact and method != "implicit":
        fix = 'write method = "implicit" in [solver]'
        raise ConfigError("solver.method", "does not know [scene.self_contact]", method, fix)


def add_contacts(
    scene: Scene,
    section: SceneSection,
    named: Mapping[str, Sequence[int]],
    tools: Mapping[str, Tool],
    folder: Path,
) -> None:
    """Let what is named in [[scene.contact]] touch its colliders; what this scene does without touches nothing.

    Args:
        named: particles by the name of their rope, cloth or set.
        folder: files of meshes are relative to it.

    Raises:
        ConfigError: unknown names, a collider that cannot be, or names of contacts that are taken.
    """
    colliders = _colliders(section, tools, folder)
    known = {*named, *(strand.name for _, strand in section.strands), *(cloth.name for cloth in section.cloth)}
    known |= {some.name for some in section.particles}
    for i, contact in enumerate(section.contact):
        path = f"scene.contact[{i}]"
        bodies = [body for body in section.body if body.name in contact.touching]
        unknown = [name for name in contact.touching if name not in known and not bodies]
        if unknown:
            fix = f"use some of: {', '.join([*named, *scene.bodies]) or 'none yet'}"
            raise ConfigError(f"{path}.of", "names no rope, cloth, set of particles or body", unknown, fix)
        none = "none, add a [[scene.collider]]"
        collider = of_name(f"{path}.collider", "collider of the scene", contact.collider, colliders, none)
        particles = [p for name in contact.touching for p in named.get(name, ())]
        numbers = contact.model_dump(
            include={"friction", "radius", "stiffness", "restitution", "dissipation", "settle"}
        )
        points = _points(path, contact, bodies)
        if not particles and not bodies:
            continue
        what = scene.bodies[bodies[0].name] if bodies else particles
        with located(path, f"{contact.name or contact.collider}.contact"):
            scene.add_contact(what, collider, name=contact.name, points=points, **numbers)
    _add_self_contact(scene, section)
    _add_collisions(scene, section, named)


def _add_collisions(scene: Scene, section: SceneSection, named: Mapping[str, Sequence[int]]) -> None:
    given = section.collisions
    if given is None:
        return
    known = [some.name for some in section.particles]
    unknown = [name for name in given.sets if name not in known]
    if unknown:
        fix = f"use some of: {', '.join(known) or 'none, add [[scene.particles]]'}"
        raise ConfigError("scene.collisions.of", "names no set of particles", unknown, fix)
    radii = given.radius if isinstance(given.radius, list) else [given.radius] * len(given.sets)
    sets = [(named[name], r) for name, r in zip(given.sets, radii, strict=True) if name in named]
    particles = [p for own, _ in sets for p in own]
    if not particles:
        return
    each = [r for own, r in sets for _ in own]
    with located("scene.collisions", "collisions"):
        radius = each if isinstance(given.radius, list) else given.radius
        scene.add_collisions(particles, radius=radius, restitution=given.restitution)


def _add_self_contact(scene: Scene, section: SceneSection) -> None:
    given = section.self_contact
    if given is None:
        return
    every = {*(strand.name for _, strand in section.strands), *(cloth.name for cloth in section.cloth)}
    capsules = {body.name: f"scene.body[{i}]" for i, body in enumerate(section.body) if body.capsules}
    if both := sorted(every & set(capsules)):
        raise ConfigError(
            "scene.self_contact.of", "names a body as well as a rope or cloth", both, "rename one of them"
        )
    unknown = [name for name in given.pieces if name not in every | set(capsules)]
    if unknown:
        fix = f"use some of: {', '.join(sorted(every | set(capsules))) or 'none yet'}; give a body its capsules"
        raise ConfigError("scene.self_contact.of", "names no rope, cloth or body with capsules", unknown, fix)
    built: dict[str, Any] = scene.ropes | scene.cloths
    for body in section.body:
        if body.capsules:
            with located(capsules[body.name], body.name):
                built[body.name] = scene.bodies[body.name].capsules(body.capsules)
    names = [name for name in given.pieces or built if name in built]
    radii = dict(zip(given.pieces, given.radius, strict=True)) if isinstance(given.radius, list) else {}
    if names:
        with located("scene.self_contact", "self_contact"):
            radius = [radii[n] for n in names] if radii else given.radius
            scene.add_self_contact(
                *(built[n] for n in names), radius=radius, friction=given.friction, pairs=given.pairs
            )


def _points(path: str, contact: ContactSection, bodies: Sequence[BodySection]) -> ArrayLike | None:
    """The points of a body that touches: those given, or the corners of its box."""
    if not bodies:
        if contact.points is not None:
            problem = "are given, and what touches is not a body"
            raise ConfigError(f"{path}.points", problem, contact.touching, "leave them out")
        return None
    if len(contact.touching) > 1:
        problem = "names a body beside others"
        raise ConfigError(f"{path}.of", problem, contact.touching, "give each body a [[scene.contact]] of its own")
    if contact.points is not None:
        return contact.points
    body = bodies[0]
    if body.box is None:
        fix = "give those that may touch, in the body's frame"
        raise ConfigError(f"{path}.points", "are missing: the body has no box", body.name, fix)
    return box_corners(body.box, body.center)


def _colliders(section: SceneSection, tools: Mapping[str, Tool], folder: Path) -> dict[str, Collider]:
    found: dict[str, Collider] = {}
    for i, described in enumerate(section.collider):
        path = f"scene.collider[{i}]"
        if described.name in found:
            raise ConfigError(f"{path}.name", "is taken", described.name, "give every collider a name of its own")
        with located(path, described.name):
            given = described.model_dump(include=set(arguments(described.shape)), exclude_none=True)
            if "file" in given:
                given["mesh"] = _mesh(f"{path}.file", folder / given.pop("file"), given.pop("unit", "m"))
            standing = SHAPES[described.shape](name=described.name, **given)
        with located(path, f"{described.name}.moving"):
            found[described.name] = _set_in_motion(path, described, standing, tools)
    return found


def _mesh(path: str, file: Path, unit: str) -> TriangleMesh:
    if not file.is_file():
        fix = "give a file relative to the configuration's folder"
        raise ConfigError(path, "does not exist", str(file), fix)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*warp direction")  # no fabric
        return read_mesh(file, material="unfold", unit=unit, merge=True)


def _set_in_motion(path: str, described: ColliderSection, standing: Collider, tools: Mapping[str, Tool]) -> Collider:
    if described.tool is not None:
        tool = tool_named(f"{path}.tool", described.tool, tools)
        return tool.carry(standing)
    if described.times is None:
        return standing
    return standing.moving(described.times, described.displacements or [], described.rotations, described.interpolation)
