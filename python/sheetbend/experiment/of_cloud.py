"""What a recording that is a cloud asks of its experiment, and the surface that its points are compared with."""

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
        InputError: the scene has no cloth, or one of these fields is given.
    """
    if not scene.cloths:
        fix = "record markers of ropes and bodies, or give the scene the cloth that the camera saw (sb.add_cloth)"
        raise InputError(f"{name}.recording", "is a cloud, and the scene has no cloth", scene.name, fix)
    for field, given in of_markers.items():
        if given:
            fix = "leave it out: of each point of a cloud, the distance from the cloth where it is closest counts"
            raise InputError(f"{name}.{field}", "is of markers, not of the points of a cloud", given, fix)
    for field, given in beside.items():
        if given:
            raise InputError(f"{name}.{field}", "does not go with a cloud", given, "leave it out")


def surface_of(scene: Scene, points: int) -> dict[str, Any]:
    """All cloths of a scene for the compiled core: the first coordinate of each vertex, and the triangles' vertices.

    Args:
        points: of the cloud in a frame at most, which are among the experiment's inputs as markers are.
    """
    vertices, triangles, first = [], [], 0
    for cloth in scene.cloths.values():
        vertices.append(3 * scene.places_of(cloth.particles))
        triangles.append(cloth.mesh.triangles + first)
        first += len(cloth.particles)
    shape = {"vertices": np.concatenate(vertices).tolist(), "triangles": np.concatenate(triangles).tolist()}
    return {**shape, "points": points}
