"""Material coordinates of a shape at rest: its triangles unrolled into the plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.types import Array, Indices
from ..errors import MeshError
from . import topology, validate

_SAME_PLACE = 1e-6  # of the size of the mesh: files hold no more digits
_JUMP = np.radians(5.0)
_STEEP = 1e-6  # the part of the warp direction that lies in a triangle, at least, to give it a direction


def unfold(vertices: Array, triangles: Indices, warp: ArrayLike = (1.0, 0.0, 0.0)) -> Array:
    """Material coordinates in which every triangle keeps its shape.

    Each triangle is laid into the plane beside the neighbor through which it is reached first, starting from the one
    most parallel to `warp` in every connected part. Where the surface can be unrolled (a plane, a bent sheet) this is
    the geodesic chart; vertices that sample a bent sheet leave small gaps in it. Where the warp direction would jump by
    more than 5 degrees across an edge, no chart exists: each triangle has its own, with `warp` projected onto it, and
    its neighbor's direction where that vanishes.

    Args:
        vertices: (n, 3) m, at rest.
        triangles: (m, 3), manifold and of one orientation.
        warp: (3,) direction of warp.

    Returns:
        (n, 2) m where all copies of every vertex coincide to a millionth of the size of the mesh, else (m, 3, 2) m.

    Raises:
        MeshError: a triangle has no area, or `warp` is perpendicular to a connected part.
    """
    vertices = validate.rows("vertices", vertices, 3)
    triangles = validate.checked_triangles(triangles, len(vertices))
    direction = finite("warp", warp, (3,), MeshError)
    normals = _normals(vertices[triangles])
    across = direction - normals * (normals @ direction)[:, None]  # the warp direction in every triangle's plane
    steepness = np.linalg.norm(across, axis=1)
    twin = topology.twins(triangles)
    parts = topology.components(len(triangles), topology.hinge_half_edges(twin) // 3)
    seeds = []
    for part in np.unique(parts):
        members = np.flatnonzero(parts == part)
        ranked = np.round(steepness[members] / max(steepness[members].max(), np.finfo(float).tiny), 9)
        seeds.append(members[ranked.argmax()])
        if not steepness[seeds[-1]] > _STEEP * np.linalg.norm(direction):
            raise MeshError("warp", "is perpendicular to the mesh", direction.tolist(), "give another direction")

    placed = np.zeros((len(triangles), 3, 2))
    placed[seeds] = _projected(vertices[triangles[seeds]], across[seeds], normals[seeds])
    _spread(placed, vertices, triangles, twin, np.array(seeds))
    per_vertex = np.zeros((len(vertices), 2))
    per_vertex[triangles] = placed
    extent = np.ptp(placed.reshape(-1, 2), axis=0).max()
    if np.abs(per_vertex[triangles] - placed).max() <= _SAME_PLACE * extent:
        return per_vertex
    if np.abs(warp_turns(placed, twin)).max() > _JUMP:
        clear = steepness > _STEEP * np.linalg.norm(direction)
        placed[clear] = _projected(vertices[triangles[clear]], across[clear], normals[clear])
    return placed


def warp_turns(corners: Array, twin: Indices) -> Array:
    """(k,) rad, how far the warp direction turns across every hinge when its triangles are laid side by side."""
    first, second = topology.hinge_half_edges(twin).T
    along = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 2)
    u, v = along[first], -along[second]
    turns: Array = np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1))
    return turns


def _projected(corners: Array, warp: Array, normals: Array) -> Array:
    """(k, 3, 2) m, corners (k, 3, 3) along warp (k, 3) in their planes, and along weft."""
    axes = np.stack([warp, np.cross(normals, warp)], axis=1)
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    flat: Array = np.einsum("kcx,kax->kca", corners, axes)
    return flat


def _spread(placed: Array, vertices: Array, triangles: Indices, twin: Indices, seeds: Indices) -> None:
    """Fill `placed` (m, 3, 2) from the seeds outward, one ring of neighbors at a time."""
    done = np.zeros(len(triangles), dtype=bool)
    done[seeds] = True
    front = seeds
    while front.size:
        through = (3 * front[:, None] + np.arange(3)).ravel()
        through = through[twin[through] >= 0]
        through = through[~done[twin[through] // 3]]
        front, first = np.unique(twin[through] // 3, return_index=True)
        done[front] = True
        here = through[first]
        there = twin[here]
        start, end = placed[here // 3, (here + 1) % 3], placed[here // 3, here % 3]  # of the neighbor's half-edge
        t = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
        v = [vertices[triangles[there // 3, (there + step) % 3]] for step in range(3)]
        along, top = v[1] - v[0], v[2] - v[0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        foot = (along * top).sum(axis=1, keepdims=True) / length
        height = np.linalg.norm(np.cross(along, top), axis=1, keepdims=True) / length
        placed[front, there % 3] = start
        placed[front, (there + 1) % 3] = end
        placed[front, (there + 2) % 3] = start + foot * t + height * np.column_stack([-t[:, 1], t[:, 0]])


def _normals(corners: Array) -> Array:
    """(m, 3) unit normals of triangles (m, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(-1).max(axis=1)
    flat = np.flatnonzero(size <= validate.NO_AREA * longest)
    if flat.size:
        raise MeshError("vertices", f"give triangle {flat[0]} no area", corners[flat[0]].tolist(), "remove or merge it")
    unit: Array = normal / size[:, None]
    return unit
