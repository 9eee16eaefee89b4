"""Junctions of rods: small rigid pieces in which rods begin and end, such as the molded part of a branched cable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array
from ..errors import SceneError
from ..scene.scene import Scene
from .chain import unit_vector
from .grip import carried

STUB = 0.5  # length of a rod's own link in a junction over that of its links; only its direction matters
STUB_MASS = 1e-4  # its mass over that of a link: as little as keeps the projection well conditioned
SHARPEST = -0.95  # cosine of the angle between two rods' ways through a junction; -1 folds back


@dataclass(frozen=True, eq=False)
class Facing:
    """A rod's way through a junction: the junction and the rod's direction of travel there, (3,) unit vector."""

    junction: Junction
    direction: Array | None = None


class Junction:
    """A rigid piece in which rods begin or end; they share a node and keep their angles there.

    Every rod has a short link of its own in the junction, and the half link next to it bends and twists against that,
    as at a grip. The short links are joined without compliance, so that each rod keeps its own stiffness up to the
    node. Give one junction to several `add_rod`: as the `end` of a trunk and the `start` of its branches, or as both
    ends of one rod, which makes a ring. The rods' short links point as their links do at the start, or as `facing`
    says.
    """

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._node = -1
        self._ghost = self._director = -1
        self._arrives = False

    def facing(self, direction: ArrayLike) -> Facing:
        """This junction with the rod's direction of travel (3,) in it: for rods that are curved where they meet it."""
        return Facing(self, unit_vector("facing", direction))

    def node_in(self, scene: Scene, field: str) -> int | None:
        """The shared particle; None before the first rod.

        Raises:
            SceneError: the junction belongs to another scene.
        """
        if self._scene is None:
            return None
        if self._scene is not scene:
            raise SceneError(field, "is a junction of another scene", scene.name, "make a junction for each scene")
        return self._node

    @property
    def direction(self) -> Array:
        """The first rod's direction of travel, (3,)."""
        assert self._scene is not None
        x = self._scene.nodes
        along = x[self._ghost] - x[self._node] if self._arrives else x[self._node] - x[self._ghost]
        return np.asarray(along / np.linalg.norm(along))

    def carried(self, direction: Array) -> Array:
        """The first rod's director (3,), carried to another direction of travel (3,)."""
        assert self._scene is not None
        return carried(self._scene.nodes[self._director], self.direction, direction[None])[0]

    def join(
        self, scene: Scene, label: str, node: int, ghost: int, director: int, normal: int | None, arrives: bool
    ) -> None:
        """Join a rod's short link to those that are joined already, at the angles that they have now.

        Args:
            scene: of the rod.
            label: prefix of the names of the constraints.
            node: the shared node.
            ghost: the other node of the short link.
            director: of the short link.
            normal: of its section, for rods that shear; the short link does not.
            arrives: whether the rod ends in the junction; otherwise it begins there.
        """
        x = scene.nodes
        reach = float(np.linalg.norm(x[ghost] - x[node]))
        scene.add_constraints("distance", [[node, ghost]], name=f"{label}_stub", rest=reach)
        if normal is not None:
            edge = [node, ghost] if arrives else [ghost, node]
            scene.add_constraints("shear", [[*edge, normal, director]], name=f"{label}_section")
        if self._scene is None:
            self._scene, self._node = scene, node
            self._ghost, self._director, self._arrives = ghost, director, arrives
            return
        stencil = [[self._ghost, node, ghost, self._director, director]]
        curvature, twist = joint_rest(x[stencil[0]], label)
        scene.add_constraints("material_curvature", stencil, name=f"{label}_angle", rest=[curvature])
        scene.add_constraints("twist", stencil, name=f"{label}_roll", rest=[twist])


def joint_rest(x: Array, field: str) -> tuple[Array, float]:
    """Material curvatures (2,) and twist of a joint's five points, as core/constraints/material_curvature.h and twist.h
    have them.

    Raises:
        SceneError: the two edges nearly fold back.
    """
    edges = [x[1] - x[0], x[2] - x[1]]
    t1, t2 = (e / np.linalg.norm(e) for e in edges)
    if t1 @ t2 < SHARPEST:
        fix = "let one of the two rods end in the junction and the other begin there"
        raise SceneError(field, "goes through the junction beside another rod, the opposite way", t2.tolist(), fix)
    across = [q - (q @ t) * t for q, t in ((x[3], t1), (x[4], t2))]
    m, n = (q / np.linalg.norm(q) for q in across)
    over = carried(m, t1, t2[None])[0]
    twist = float(np.arctan2(np.cross(over, n) @ t2, over @ n))
    binormal = 2.0 * np.cross(t1, t2) / (1.0 + t1 @ t2)
    mean = np.cos(twist / 2) * over + np.sin(twist / 2) * np.cross(t2, over)
    return np.array([np.cross(t2, mean) @ binormal, -(mean @ binormal)]), twist
