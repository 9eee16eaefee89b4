"""Volumes that closed surfaces keep: what a scene knows of them, and how they are added."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, is_number, triangle_array
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Builder, Term
from .inertia import check_closed


class Volumes:
    """The closed surfaces of a scene.

    Attributes:
        triangles: (n, 3) particles, by name, in the order in which they were added.
    """

    def __init__(self) -> None:
        self.triangles: dict[str, Array] = {}

    def add(self, scene: Builder, triangles: ArrayLike, compliance: float, rest: float | None, name: str) -> None:
        """See `Scene.add_volume`."""
        check_label("add_volume.name", name)
        field = f"{name}.volume"
        if name in self.triangles:
            raise SceneError(field, "is there already", name, "give each volume a name of its own")
        surface = triangle_array(f"{field}.triangles", triangles, scene.particle_count)
        check_closed(f"{field}.triangles", surface)
        initial = enclosed_volume(surface, scene.positions)
        if initial < 0:
            fix = "list corners counterclockwise as seen from outside"
            raise SceneError(f"{field}.triangles", "are inside out, they enclose a negative volume", initial, fix)
        if not (is_number(compliance) and compliance >= 0):
            raise SceneError(f"{field}.compliance", "must not be negative", compliance, "give m^3/Pa, or 0")
        kept = initial if rest is None else rest
        if not (is_number(kept) and kept > 0):
            raise SceneError(f"{field}.rest", "must be positive", kept, "give m^3")
        at = len(self.triangles)
        self._name(scene, f"{name}_volume", "volume", at, kept, "m^3")
        if compliance > 0:
            self._name(scene, f"{name}_volume_compliance", "volume_compliance", at, compliance, "m^3/Pa")
        self.triangles[name] = surface

    def arrays(self) -> dict[str, Array]:
        """The plain parts of the input arrays: none, quantities make all of them."""
        none = np.zeros(len(self.triangles))
        return {"volume": none, "volume_compliance": none}

    def _name(self, scene: Builder, quantity: str, array: str, at: int, value: float, unit: str) -> None:
        scene.add_quantity(quantity, value, unit)
        scene.add_terms([Term(array, at, 1.0, ((quantity, "identity"),))])


def enclosed_volume(triangles: Array, positions: Array) -> float:
    """What a closed surface encloses, m^3.

    Args:
        triangles: (count, 3) particles.
        positions: (particles, 3) m.
    """
    x = (positions - positions[triangles[0, 0]])[triangles]  # keeps the digits of what is far from the origin
    return float(np.einsum("ij,ij->", x[:, 0], np.cross(x[:, 1], x[:, 2])) / 6.0)
