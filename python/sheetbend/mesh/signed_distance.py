"""Exact distances from a closed triangle mesh, negative inside.

A tree of boxes leaves few triangles to look at for each point. The sign is that of the angle-weighted pseudonormal at
the closest point, which is right on edges and corners too (Baerentzen & Aanaes 2005, IEEE TVCG 11(3)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array, Indices
from .places import closest_weights, nearest
from .topology import twins

CHUNK = 16384  # points that go down the tree together
ROUNDING = 1.0 + 1e-9  # of distances that are compared


@dataclass(frozen=True)
class BoxTree:
    """Boxes around triangles, each divided in two along its longest side.

    Attributes:
        low, high: (boxes, 3) m, corners of the boxes; the first holds all.
        children: (boxes, 2) boxes, -1 where a box is not divided.
        triangle: (boxes,) the triangle of a box that is not divided, otherwise -1.
    """

    low: Array
    high: Array
    children: Indices
    triangle: Indices

    @classmethod
    def of(cls, corners: Array) -> BoxTree:
        """The tree of triangles (m, 3, 3)."""
        low, high = corners.min(axis=1), corners.max(axis=1)
        middle = 0.5 * (low + high)
        parts, children, triangle, boxes = [np.arange(len(corners))], [], [], []
        for own in parts:  # which grows
            boxes.append((low[own].min(axis=0), high[own].max(axis=0)))
            triangle.append(own[0] if len(own) == 1 else -1)
            if len(own) == 1:
                children.append((-1, -1))
                continue
            side = int(np.argmax(np.ptp(middle[own], axis=0)))
            order = own[np.argpartition(middle[own, side], len(own) // 2)]
            children.append((len(parts), len(parts) + 1))
            parts += [order[: len(own) // 2], order[len(own) // 2 :]]
        return cls(
            np.array([a for a, _ in boxes]), np.array([b for _, b in boxes]), np.array(children), np.array(triangle)
        )

    def near(self, points: Array, bounds: Array) -> tuple[Indices, Indices]:
        """Pairs (k,), (k,) of a point and a triangle whose box comes nearer than the point's bound (points,) m."""
        which, box = np.arange(len(points)), np.zeros(len(points), dtype=np.int64)
        found: list[tuple[Indices, Indices]] = []
        while len(which):
            off = np.maximum(0.0, np.maximum(self.low[box] - points[which], points[which] - self.high[box]))
            kept = np.linalg.norm(off, axis=1) <= bounds[which] * ROUNDING
            which, box = which[kept], box[kept]
            divided = self.triangle[box] < 0
            found.append((which[~divided], self.triangle[box[~divided]]))
            which, box = np.repeat(which[divided], 2), self.children[box[divided]].ravel()
        return np.concatenate([a for a, _ in found]), np.concatenate([b for _, b in found])


def signed_distances(vertices: Array, triangles: Indices, points: Array) -> Array:
    """Distances (k,) m of points (k, 3) from a surface, negative inside.

    Args:
        vertices: (n, 3) m.
        triangles: (m, 3), closed, counterclockwise as seen from outside.
    """
    tree, normals = BoxTree.of(vertices[triangles]), _pseudonormals(vertices, triangles)
    return np.concatenate(
        [_signed(vertices, triangles, tree, normals, points[k : k + CHUNK]) for k in range(0, len(points), CHUNK)]
    )


def _signed(vertices: Array, triangles: Indices, tree: BoxTree, normals: Array, points: Array) -> Array:
    bounds = np.linalg.norm(vertices[nearest(vertices, points)] - points, axis=1)
    which, triangle = tree.near(points, bounds)
    weights, square = closest_weights(vertices[triangles[triangle]], points[which])
    order = np.lexsort((square, which))
    best = order[np.unique(which[order], return_index=True)[1]]
    feature = _feature(weights[best])
    foot = np.einsum("kc,kcx->kx", weights[best], vertices[triangles[triangle[best]]])
    along = np.einsum("kx,kx->k", points - foot, normals[triangle[best], feature])
    return np.asarray(np.where(along < 0.0, -1.0, 1.0) * np.sqrt(square[best]))


def _feature(weights: Array) -> Indices:
    """The part of a triangle on which points with weights (k, 3) lie: 0 to 2 a corner, 3 to 5 the edge that starts
    there, 6 the inside."""
    on = weights > 0.0
    count, first = on.sum(axis=1), on.argmax(axis=1)
    edge = np.where(first == 0, np.where(on[:, 1], 3, 5), 4)
    return np.where(count == 3, 6, np.where(count == 2, edge, first))


def _pseudonormals(vertices: Array, triangles: Indices) -> Array:
    """(m, 7, 3) of each triangle's corners, edges and face, of any length."""
    corners = vertices[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    at_vertex = np.zeros_like(vertices)
    for k in range(3):
        u, v = (corners[:, (k + j) % 3] - corners[:, k] for j in (1, 2))
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        np.add.at(at_vertex, triangles[:, k], angle[:, None] * face)
    other = face[twins(triangles) // 3].reshape(-1, 3, 3)
    return np.concatenate([at_vertex[triangles], face[:, None] + other, face[:, None]], axis=1)
