"""Outlines of the shapes that ropes and cloths touch, for figures, movies and pages."""

from __future__ import annotations

import numpy as np

from ..arrays.rotations import rotation_matrix
from ..arrays.timeseries import linear
from ..arrays.types import Array
from ..scene.colliders import Collider, Motion
from ..scene.distance_field import DistanceField
from ..scene.scene import Scene

AROUND = np.linspace(0.0, 2.0 * np.pi, 25)  # of a circle
CELLS = 8  # of the grid of a plane, along each side
MARGIN = 0.1  # of the motion's extent, by which that grid is larger


def collider_lines(scene: Scene, times: Array, positions: Array) -> dict[str, Array]:
    """Lines (frames, lines, 2, 3) m of each collider by name, which draw it where it is at some times.

    A plane is a square grid as wide as the motion, a sphere three circles, a capsule its circles and sides, a cylinder
    its ends and sides, a box its edges, and a distance field sections of its mesh.

    Args:
        times: (frames,) s.
        positions: (frames, particles, 3) m, or of all nodes, which say how large a plane is drawn.
    """
    used = {contact.collider for contact in scene.contacts.contacts}
    found, particles = {}, positions[:, : scene.particle_count]
    for place, (name, collider) in enumerate(scene.contacts.colliders.items()):
        if place not in used:
            continue
        x, turns = _poses(collider.poses, times)
        lines = _grid(particles, x[0], turns[0]) if collider.shape == "plane" else _outline(collider)
        found[name] = np.einsum("fij,lkj->flki", turns, lines) + x[:, None, None]
    return found


def _poses(motion: Motion, times: Array) -> tuple[Array, Array]:
    """Positions (frames, 3) and rotations (frames, 3, 3); linear between knots, which pictures do not tell from
    cubic."""
    x, r = (linear(motion.times, part, times) for part in (motion.positions, motion.rotations))
    return x, np.stack([rotation_matrix("rotation", vector) for vector in r])


def _outline(collider: Collider) -> Array:
    """(lines, 2, 3) m in the shape's own frame."""
    if isinstance(collider, DistanceField) and collider.grid is not None:
        return collider.grid.outline
    sizes = collider.sizes
    if collider.shape == "rounded_box":
        half = np.array([sizes[f"half_{axis}"] for axis in "xyz"])
        return half * _edges()
    radius, half_length = sizes["radius"], sizes.get("half_length", 0.0)
    if collider.shape == "rounded_cylinder":
        ends = [_circle(radius, 2) + np.array([0.0, 0.0, end]) for end in (-half_length, half_length)]
        return np.concatenate([*ends, _sides(radius, half_length)])
    parts = [
        _circle(radius, axis) + np.array([0.0, 0.0, end])
        for axis in range(3)
        for end in dict.fromkeys((-half_length, half_length))
    ]
    return np.concatenate([*parts, _sides(radius, half_length)] if half_length else parts)


def _sides(radius: float, half_length: float) -> Array:
    ends = (-half_length, half_length)
    return np.array([[[radius * np.cos(a), radius * np.sin(a), z] for z in ends] for a in AROUND[:-1:3]])


def _circle(radius: float, axis: int) -> Array:
    points = np.insert(radius * np.stack([np.cos(AROUND), np.sin(AROUND)], axis=1), axis, 0.0, axis=1)
    return np.stack([points[:-1], points[1:]], axis=1)


def _edges() -> Array:
    """(12, 2, 3) of the cube between -1 and 1."""
    corners = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, 8).T
    pairs = [(a, b) for k, a in enumerate(corners) for b in corners[:k] if np.abs(a - b).sum() == 2.0]
    return np.array(pairs)


def _grid(positions: Array, origin: Array, turn: Array) -> Array:
    """(lines, 2, 3) m in the plane's frame, below all that moves."""
    own = (positions - origin) @ turn
    seen = own[np.isfinite(own).all(axis=2)][:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, half = (low + high) / 2, (0.5 + MARGIN) * (high - low).max()
    low, high = middle - half, middle + half
    x, y = np.linspace(low, high, CELLS + 1).T
    across = [[[a, low[1], 0.0], [a, high[1], 0.0]] for a in x]
    return np.array([*across, *([[low[0], b, 0.0], [high[0], b, 0.0]] for b in y)])
