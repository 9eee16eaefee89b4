"""A cut of a fabric in a scene, as the parts of a cloth (masses, membrane, bending) are added to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..arrays.types import Array
from ..mesh import TriangleMesh
from ..scene.scene import Scene
from .flat_size import FlatSize


@dataclass(frozen=True)
class Cut:
    """One cut of a fabric in a scene: where the terms of a cloth's parts go.

    Attributes:
        name: prefix of its groups and of what is the cut's alone.
        fabric: prefix of the quantities that all cuts of the fabric share.
        particles: (vertices,) of the mesh's vertices.
        size: of the flat cloth relative to the mesh.
        numbers: of the fabric, by the arguments of `add_cloth`; those left out are None.
    """

    scene: Scene
    mesh: TriangleMesh
    name: str
    fabric: str
    particles: Array
    size: FlatSize
    numbers: Mapping[str, Any]
