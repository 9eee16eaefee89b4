"""The shapes of a motion as other programs take them: cloths and solids as meshes, ropes as lines, at some frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array
from ..errors import InputError
from ..motion.simulate import Trajectory
from ..scene.scene import Scene
from .strain import largest_strain


@dataclass(frozen=True)
class MovingShape:
    """A cloth, the surface of a solid, or a rope, over time.

    Attributes:
        name: in the scene.
        positions: (frames, vertices, 3) m.
        velocities: the same, m/s.
        triangles: (m, 3) of a cloth; None of a rope.
        material: (vertices, 2) m, of a cloth that one chart covers; None otherwise.
        strain: (frames, m) largest principal Green strain of each triangle; None of a rope.
    """

    name: str
    positions: Array
    velocities: Array
    triangles: Array | None = None
    material: Array | None = None
    strain: Array | None = None

    def radius(self, given: float | None) -> float:
        """m, of a rope: as given, or 0.4 % of its length in the first frame."""
        if given is not None:
            return given
        return 0.004 * float(np.linalg.norm(np.diff(self.positions[0], axis=0), axis=1).sum())


def moving_shapes(scene: Scene, motion: Trajectory, frames: Array) -> Iterator[MovingShape]:
    """Cloths and surfaces of solids first, then ropes and rods, at some frames of a motion.

    Raises:
        InputError: the scene has neither.
    """
    if not scene.sheets and not scene.ropes:
        raise InputError(
            "scene", "has neither cloth nor solid nor rope", scene.name, "give one that has something to write"
        )
    x, v = motion.positions[frames], motion.velocities[frames]
    for cloth in scene.sheets:
        mesh, own = cloth.mesh, cloth.particles
        strain = np.stack([largest_strain(mesh, frame) for frame in x[:, own]])
        material = mesh.material if mesh.material.ndim == 2 else None
        yield MovingShape(cloth.name, x[:, own], v[:, own], mesh.triangles, material, strain)
    for rope in scene.ropes.values():
        yield MovingShape(rope.name, x[:, rope.particles], v[:, rope.particles])


def chosen_frames(times: Array, most: int) -> Array:
    """Indices of at most so many frames, evenly."""
    return np.unique(np.linspace(0, len(times) - 1, min(most, len(times))).round().astype(int))


def tube(lines: Array, radius: float, sides: int) -> tuple[Array, Array]:
    """A rope's (frames, nodes, 3) m as the surface of a tube: (frames, nodes * sides, 3) m and (m, 3) triangles.

    Its sides are carried along the rope without twist (parallel transport), from a direction across its first link.
    """
    along = np.gradient(lines, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), np.finfo(float).tiny)
    least = np.eye(3)[np.abs(along[:, 0]).argmin(axis=1)]
    across = np.empty_like(lines)
    across[:, 0] = _perpendicular(least, along[:, 0])
    for k in range(1, lines.shape[1]):
        across[:, k] = _perpendicular(across[:, k - 1], along[:, k])
    other = np.cross(along, across)
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = across[:, :, None] * np.cos(turn)[:, None] + other[:, :, None] * np.sin(turn)[:, None]
    surface = (lines[:, :, None] + radius * ring).reshape(len(lines), -1, 3)
    first = sides * np.arange(lines.shape[1] - 1)[:, None] + np.arange(sides)
    right = sides * np.arange(lines.shape[1] - 1)[:, None] + (np.arange(sides) + 1) % sides
    quads = np.stack([first, right, right + sides, first + sides], axis=-1).reshape(-1, 4)
    return surface, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _perpendicular(vector: Array, along: Array) -> Array:
    """(n, 3) unit vectors: what vectors have across unit vectors."""
    across = vector - (vector * along).sum(axis=1, keepdims=True) * along
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny))


def up_of(gravity: ArrayLike) -> Array:
    """(3,) the coordinate axis that points up, the nearest to against gravity (3,); z without gravity."""
    g = np.asarray(gravity, dtype=float)
    axis = int(np.abs(g).argmax()) if g.any() else 2
    up = np.zeros(3)
    up[axis] = 1.0 if g[axis] <= 0.0 else -1.0
    return up


def turn_between(start: Array, end: Array) -> list[float]:
    """The quaternion (x, y, z, w) that turns a coordinate axis into another one, or into its opposite."""
    along = float(start @ end)
    if along < 0.0:
        return [1.0, 0.0, 0.0, 0.0] if not start[0] else [0.0, 0.0, 1.0, 0.0]
    q = np.array([*np.cross(start, end), 1.0 + along])
    return [float(part) for part in q / np.linalg.norm(q)]
