"""Rigid bodies as boxes, and the particles that carry a mass of their own, for movies and pages."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ..arrays.types import Array
from ..scene.body import GROUND
from ..scene.scene import Scene

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
EDGES = [(i, j) for i, j in combinations(range(8), 2) if np.count_nonzero(CORNERS[i] != CORNERS[j]) == 1]


def body_lines(scene: Scene, positions: Array) -> dict[str, Array]:
    """Lines (frames, 13, 2, 3) m of each body by name: the edges of the homogeneous box that has its mass and inertia,
    and the line from its center to the origin of its frame.

    Args:
        positions: (frames, nodes, 3) m of all nodes, such as `Trajectory.nodes`.
    """
    found = {}
    for body in scene.bodies.values():
        if body.name == GROUND:
            continue
        mass, *second = body.inertia_of_nodes()
        sides = np.sqrt(12.0 * np.maximum(second, 0.0) / mass)
        origin, _ = body.pose(positions)
        center, *axes = np.moveaxis(positions[:, body.particles], 1, 0)
        turn = np.stack(axes, axis=2)
        corners = center[:, None] + np.einsum("fab,kb->fka", turn, sides * CORNERS)
        lines = [corners[:, pair] for pair in EDGES]
        found[body.name] = np.stack([*lines, np.stack([center, origin], axis=1)], axis=1)
    return found


def is_arm(scene: Scene, name: str) -> bool:
    """Whether `add_arm` made what is called so."""
    return f"{name}_first_moment" in scene.quantities


def point_masses(scene: Scene) -> Array:
    """The particles that carry a mass with a name: those of `add_point_mass`, and the bobs of pendulums."""
    found = set()
    for t in scene.terms:
        if t.array == "mass" and np.ndim(t.index) == 0 and t.index >= 0 and len(t.factors) == 1 and not t.exponents:
            ((name, function),) = t.factors
            plain = name.endswith("_mass") and function == "identity" and t.coefficient == 1.0
            if plain and not is_arm(scene, name.removesuffix("_mass")):
                found.add(int(t.index))
    return np.array(sorted(found), dtype=int)
