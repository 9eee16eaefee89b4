"""What a recording that is a cloud asks of its experiment, and the shape that its points are compared with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene.scene import Scene


def check_cloud(name: str, scene: Scene, of_markers: Mapping[str, object], beside: Mapping[str, object]) -> None:
    """Refuse what an experiment on a cloud cannot have.

    Args:
        name: of the experiment.
        of_markers: fields that only markers have, by name; empty or None where they were not given.
        beside: fields that do not go with a cloud yet, likewise.

    Raises:
        InputError: the scene has neither cloth nor rope, or one of these fields is given.
    """
    if not scene.cloths and not scene.ropes:
        fix = "record markers of bodies, or give the scene what the camera saw (sb.add_cloth, sb.add_rope)"
        raise InputError(f"{name}.recording", "is a cloud, and the scene has no cloth and no rope", scene.name, fix)
    for field, given in of_markers.items():
        if given:
            fix = "leave it out: of each point of a cloud, the distance from the closest place on what it shows counts"
            raise InputError(f"{name}.{field}", "is of markers, not of the points of a cloud", given, fix)
    for field, given in beside.items():
        if given:
            raise InputError(f"{name}.{field}", "does not go with a cloud", given, "leave it out")


def rows_of_point(scene: Scene) -> int:
    """Residuals of one point: its distance from a surface, or its two offsets across a rope."""
    return 1 if scene.cloths else 2


def shape_of(scene: Scene, points: int) -> dict[str, Any]:
    """What a cloud is compared with, for the compiled core: all cloths of a scene, or where it has none, all ropes.

    Args:
        points: of the cloud in a frame at most, which are among the experiment's inputs as markers are.

    Returns:
        `vertices`, the first coordinate of each, and `triangles` (n, 3) or `links` (n, 2) of their numbers.
    """
    if scene.cloths:
        pieces = [(cloth.particles, cloth.mesh.triangles) for cloth in scene.cloths.values()]
    else:
        pieces = [(rope.particles, links_between(len(rope.particles))) for rope in scene.ropes.values()]
    first = np.cumsum([0, *(len(particles) for particles, _ in pieces)])
    parts = np.concatenate([own + before for (_, own), before in zip(pieces, first[:-1], strict=True)])
    vertices = np.concatenate([3 * scene.places_of(particles) for particles, _ in pieces])
    return {"vertices": vertices.tolist(), "triangles" if scene.cloths else "links": parts.tolist(), "points": points}


def links_between(count: int) -> np.ndarray:
    """(count - 1, 2) numbers of the particles at both ends of each link of a rope."""
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
