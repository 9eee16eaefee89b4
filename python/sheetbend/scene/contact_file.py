"""The colliders and contacts of a scene in its file (scene_file.py): what is written of them, and how they are read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from .balls import Balls
from .colliders import Box, Capsule, Collider, Cylinder, Motion, Plane, Sphere
from .contacts import ARRAYS, Contact
from .scene import Scene

BODY = 4  # nodes of a point of a body
MADE_BY_QUANTITIES = tuple(name for name in ARRAYS if name != "collider_pose")


class Reader(Protocol):
    """What reads the parts of a file, as SceneReader does."""

    header: dict[str, Any]

    def fail(self, field: str, problem: str, got: object, fix: str) -> Any: ...
    def records(self, key: str) -> list[dict[str, Any]]: ...
    def name(self, parent: Mapping[str, Any], key: str, where: str = "") -> str: ...
    def part(self, parent: Mapping[str, Any], key: str, kind: type, where: str = "") -> Any: ...
    def array(self, name: str, kind: str, shape: tuple[int | None, ...]) -> Array: ...
    def nodes(self, name: str, shape: tuple[int | None, ...]) -> Array: ...


def written_contacts(scene: Scene) -> tuple[dict[str, Any], dict[str, Array]]:
    """Members of the header and arrays; none of a scene without contacts."""
    contacts = scene.contacts
    if contacts.pieces:
        fix = "leave it out, or keep the program that makes the scene"
        raise SceneError("self_contact", "is not held by scene files", [p.name for p in contacts.pieces], fix)
    if not contacts.contacts and contacts.balls is None:
        return {}, {}
    colliders = contacts.colliders.items()
    for name, collider in colliders:
        if collider.shape not in _MAKE:
            fix = "leave it out, or keep the program that makes the scene"
            raise SceneError(f"{name}.mesh", "is a distance field, which scene files do not hold", collider.shape, fix)
    header = {
        "colliders": [
            {"name": name, "shape": c.shape, "interpolation": c.poses.interpolation} for name, c in colliders
        ],
        "contacts": [
            {"name": c.name, "collider": c.collider, "rigid": c.rigid, "bounces": c.bounces}
            | ({"nodes": c.nodes.shape[1]} if c.of_body else {})
            | ({"dissipates": True} if c.dissipates else {})
            for c in contacts.contacts
        ],
    }
    times = {f"collider_times_{i}": np.asarray(c.poses.times, dtype=float) for i, (_, c) in enumerate(colliders)}
    rows = {
        f"contact_{i}": np.column_stack([scene.places_of(c.nodes), scene.places_of(c.carried)])
        for i, c in enumerate(contacts.contacts)
    }
    if contacts.balls is None:
        return header, times | rows
    header["collisions"] = {"name": contacts.balls.name}
    return header, times | rows | {"collisions": scene.places_of(contacts.balls.particles)}


def read_contacts(reader: Reader, scene: Scene, take: Callable[..., Array], fix: str) -> None:
    """Put the colliders and contacts of a file into its scene, whose quantities are read.

    Args:
        take: (name, *shape) the next part of the plain inputs.
        fix: of a file that is damaged.
    """
    if "contacts" not in reader.header:  # of older files, and where nothing touches
        return
    contacts = scene.contacts
    for i, about in enumerate(reader.records("contacts")):
        where = f"contacts[{i}]."
        nodes = reader.part(about, "nodes", int, where) if "nodes" in about else 1
        if nodes not in (1, BODY):
            reader.fail(where + "nodes", "is no number of nodes of a point", nodes, fix)
        rows = reader.nodes(f"contact_{i}", (None, nodes + 1))
        collider, rigid, bounces = (
            reader.part(about, key, kind, where)
            for key, kind in (("collider", int), ("rigid", bool), ("bounces", bool))
        )
        dissipates = "dissipates" in about and reader.part(about, "dissipates", bool, where)
        name = reader.name(about, "name", where)
        contacts.contacts.append(Contact(name, collider, rows[:, :-1], rows[:, -1], rigid, bounces, dissipates))
    count, soft = len(contacts.contacts), sum(not c.rigid for c in contacts.contacts)
    balls = 0
    if "collisions" in reader.header:
        name = reader.name(reader.part(reader.header, "collisions", dict), "name", "collisions.")
        contacts.balls = Balls(name, reader.nodes("collisions", (None,)))
        balls = len(contacts.balls.particles)
    made = [take("friction", count), take("contact_radius", count + balls), take("contact_stiffness", soft)]
    colliders = reader.records("colliders")
    for i, about in enumerate(colliders):
        where = f"colliders[{i}]."
        times = reader.array(f"collider_times_{i}", "f8", (None,))
        poses = take("collider_pose", len(times), 6)
        motion = Motion(times, poses[:, :3], poses[:, 3:], reader.part(about, "interpolation", str, where))
        name, shape = reader.name(about, "name", where), reader.part(about, "shape", str, where)
        if name in contacts.colliders or shape not in _MAKE:
            reader.fail(where + "name", "is there twice, or of no known shape", [name, shape], fix)
        labels = _MAKE[shape][0]
        missing = [label for label in labels if f"{name}_{label}" not in scene.quantities]
        if missing:
            reader.fail(where + "name", "has no quantity for a length", missing, fix)
        lengths = [scene.quantities[f"{name}_{label}"].value for label in labels]
        contacts.colliders[name] = _MAKE[shape][1](*lengths, name=name, motion=motion)
    made += [
        take("collider_size", sum(len(c.sizes) for c in contacts.colliders.values())),
        take("restitution", sum(c.bounces for c in contacts.contacts) + (balls > 0)),
        take("contact_weight", sum(c.nodes.size for c in contacts.contacts if c.of_body)),
        take("contact_dissipation", sum(c.dissipates for c in contacts.contacts)),
    ]
    for name, values in zip(MADE_BY_QUANTITIES, made, strict=True):
        if values.any():
            reader.fail(f"base.{name}", "must be zero, quantities make it", "other numbers", fix)


def _sphere(radius: float, **known: Any) -> Collider:
    return Sphere((0.0, 0.0, 0.0), radius, **known)


def _capsule(radius: float, half_length: float, **known: Any) -> Collider:
    return Capsule((0.0, 0.0, -half_length), (0.0, 0.0, half_length), radius, **known)


def _cylinder(radius: float, half_length: float, edge_radius: float, **known: Any) -> Collider:
    return Cylinder((0.0, 0.0, -half_length), (0.0, 0.0, half_length), radius, edge_radius, **known)


def _box(*lengths: float, **known: Any) -> Collider:
    return Box((0.0, 0.0, 0.0), tuple(2.0 * half for half in lengths[:3]), lengths[3], **known)


# By shape: the names of its lengths, and what makes it of them.
_MAKE: dict[str, tuple[tuple[str, ...], Callable[..., Collider]]] = {
    Plane.shape: ((), Plane),
    Sphere.shape: (("radius",), _sphere),
    Capsule.shape: (("radius", "half_length"), _capsule),
    Cylinder.shape: (("radius", "half_length", "edge_radius"), _cylinder),
    Box.shape: (tuple(Box((0, 0, 0), (1, 1, 1), 0.1).sizes), _box),
}
