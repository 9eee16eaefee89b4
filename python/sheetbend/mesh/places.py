"""Places on a mesh: a triangle and weights of its corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array, Indices
from ..errors import MeshError

_ON = 1e-9  # a weight this far below zero still counts as on the edge
_INSIDE = 1e-6  # a point with larger weights is off the edges


@dataclass(frozen=True, eq=False)
class Places:
    """Points of a mesh by barycentric weights.

    Attributes:
        triangles: (k,) the triangle that each lies in.
        vertices: (k, 3) its corners.
        weights: (k, 3) their weights, 0 to 1, of sum 1.
    """

    triangles: Indices
    vertices: Indices
    weights: Array

    def __len__(self) -> int:
        return len(self.triangles)

    def positions(self, vertices: ArrayLike) -> Array:
        """(..., k, 3) m, where these places are when the mesh's vertices are at (..., n, 3) m."""
        found: Array = np.einsum("kc,...kcx->...kx", self.weights, np.asarray(vertices)[..., self.vertices, :])
        return found


def nearest(vertices: Array, points: Array) -> Indices:
    """(k,) index of the vertex nearest to each point; the lowest of equals."""
    return np.array([((vertices - point) ** 2).sum(axis=1).argmin() for point in points])


def locate(corners: Array, triangles: Indices, points: Array) -> tuple[Indices, Array]:
    """Triangle and weights (k,), (k, 3) of points (k, 2) in the plane of `corners` (m, 3, 2).

    Raises:
        MeshError: a point lies outside of every triangle, or inside of two that have no vertex in common.
    """
    margin = _ON * np.ptp(corners.reshape(-1, 2), axis=0)
    lower, upper = corners.min(axis=1) - margin, corners.max(axis=1) + margin
    found, weights = [], []
    for point in points:
        boxed = np.flatnonzero(((lower <= point) & (point <= upper)).all(axis=1))
        w = _flat_weights(corners[boxed], point)
        least = w.min(axis=1)
        if not least.size or least.max() < -_ON:
            fix = "give points of the fabric, or use project() for points in space"
            raise MeshError("points", "lie outside of the material", point.tolist(), fix)
        best = least.argmax()
        others = triangles[boxed[least > _INSIDE]]
        if not np.isin(others, triangles[boxed[best]]).any(axis=1).all():
            fix = "use project() with points in space; material coordinates are local on this mesh"
            raise MeshError("points", "lie in several triangles of the material", point.tolist(), fix)
        found.append(boxed[best])
        weights.append(w[best])
    kept = np.clip(weights, 0.0, None)
    return np.array(found), kept / kept.sum(axis=1, keepdims=True)


def closest(vertices: Array, triangles: Indices, points: Array) -> tuple[Indices, Array]:
    """Triangle and weights (k,), (k, 3) of the point of the mesh closest to each point (k, 3)."""
    corners = vertices[triangles]
    centers = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    found, weights = [], []
    for point, vertex in zip(points, nearest(vertices, points), strict=True):
        bound = np.linalg.norm(vertices[vertex] - point)  # no triangle farther away than that can be the closest
        near = np.flatnonzero(np.linalg.norm(centers - point, axis=1) - reach <= bound * (1 + _ON))
        w, square = closest_weights(corners[near], point)
        best = square.argmin()
        found.append(near[best])
        weights.append(w[best])
    return np.array(found), np.array(weights)


def _flat_weights(corners: Array, point: Array) -> Array:
    """Barycentric weights (m, 3) of a point (2,) in triangles (m, 3, 2)."""
    a, b, c = (corners[:, j] for j in range(3))
    twice = _cross(b - a, c - a)
    wb, wc = _cross(point - a, c - a) / twice, _cross(b - a, point - a) / twice
    return np.stack([1 - wb - wc, wb, wc], axis=-1)


def _cross(u: Array, v: Array) -> Array:
    product: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return product


def closest_weights(corners: Array, point: Array) -> tuple[Array, Array]:
    """Weights (m, 3) of the point of each triangle (m, 3, 3) closest to a point (3,), or to one each (m, 3), and its
    distance squared (m,).

    The candidates are the foot of the perpendicular, where it lies inside, and the closest point of each edge.
    """
    a, b, c = (corners[:, j] for j in range(3))
    u, v, p = b - a, c - a, point - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    pu, pv = (p * u).sum(-1), (p * v).sum(-1)
    determinant = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
    wb, wc = (vv * pu - uv * pv) / determinant, (uu * pv - uv * pu) / determinant
    best = np.stack([1 - wb - wc, wb, wc], axis=-1)
    square = np.where((best >= 0).all(-1), _square_distance(best, corners, point), np.inf)
    for j in range(3):
        start, along = corners[:, j], corners[:, (j + 1) % 3] - corners[:, j]
        length = np.maximum((along * along).sum(-1), np.finfo(float).tiny)
        s = np.clip(((point - start) * along).sum(-1) / length, 0.0, 1.0)
        on_edge = np.zeros((len(s), 3))
        on_edge[:, j], on_edge[:, (j + 1) % 3] = 1 - s, s
        distance = _square_distance(on_edge, corners, point)
        nearer = distance < square
        best, square = np.where(nearer[:, None], on_edge, best), np.where(nearer, distance, square)
    return best, square


def _square_distance(weights: Array, corners: Array, point: Array) -> Array:
    off: Array = np.einsum("mc,mcx->mx", weights, corners) - point
    squares: Array = (off * off).sum(-1)
    return squares
