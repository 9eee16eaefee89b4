"""Places on a mesh: a triangle and weights of its corners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MeshError
from .topology import Indices

Array = NDArray[np.float64]

_PAIRS = 200_000  # points times triangles (or vertices) that are compared at a time
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
    found = [((vertices - part[:, None]) ** 2).sum(-1).argmin(1) for part in _parts(points, len(vertices))]
    return np.concatenate(found)


def locate(corners: Array, triangles: Indices, points: Array) -> tuple[Indices, Array]:
    """Triangle and weights (k,), (k, 3) of points (k, 2) in the plane of `corners` (m, 3, 2).

    Raises:
        MeshError: a point lies outside of every triangle, or inside of two that have no vertex in common.
    """
    found, weights = [], []
    for part in _parts(points, len(corners)):
        w = _flat_weights(corners, part[:, None])
        least = w.min(axis=-1)
        best = least.argmax(axis=1)
        rows = np.arange(len(part))
        outside = np.flatnonzero(least[rows, best] < -_ON)
        if outside.size:
            fix = "give points of the fabric, or use project() for points in space"
            raise MeshError("points", "lie outside of the material", part[outside[0]].tolist(), fix)
        for row in np.flatnonzero((least > _INSIDE).sum(axis=1) > 1):
            others = triangles[least[row] > _INSIDE]
            if not np.isin(others, triangles[best[row]]).any(axis=1).all():
                fix = "use project() with points in space; material coordinates are local on this mesh"
                raise MeshError("points", "lie in several triangles of the material", part[row].tolist(), fix)
        found.append(best)
        weights.append(w[rows, best])
    kept = np.clip(np.concatenate(weights), 0.0, None)
    return np.concatenate(found), kept / kept.sum(axis=1, keepdims=True)


def closest(corners: Array, points: Array) -> tuple[Indices, Array]:
    """Triangle and weights (k,), (k, 3) of the point of the triangles `corners` (m, 3, 3) closest to each point."""
    triangles, weights = [], []
    for part in _parts(points, len(corners)):
        w, square = _closest_weights(corners, part[:, None])
        best = square.argmin(axis=1)
        triangles.append(best)
        weights.append(w[np.arange(len(part)), best])
    return np.concatenate(triangles), np.concatenate(weights)


def _flat_weights(corners: Array, points: Array) -> Array:
    """Barycentric weights (k, m, 3) of points (k, 1, 2) in triangles (m, 3, 2)."""
    a, b, c = (corners[:, j] for j in range(3))
    twice = _cross(b - a, c - a)
    wb, wc = _cross(points - a, c - a) / twice, _cross(b - a, points - a) / twice
    return np.stack([1 - wb - wc, wb, wc], axis=-1)


def _cross(u: Array, v: Array) -> Array:
    product: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return product


def _closest_weights(corners: Array, points: Array) -> tuple[Array, Array]:
    """Weights (k, m, 3) of the point of each triangle (m, 3, 3) closest to points (k, 1, 3), and its distance squared.

    The candidates are the foot of the perpendicular, where it lies inside, and the closest point of each edge.
    """
    a, b, c = (corners[:, j] for j in range(3))
    u, v, p = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    pu, pv = (p * u).sum(-1), (p * v).sum(-1)
    determinant = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
    wb, wc = (vv * pu - uv * pv) / determinant, (uu * pv - uv * pu) / determinant
    best = np.stack([1 - wb - wc, wb, wc], axis=-1)
    square = np.where((best >= 0).all(-1), _square_distance(best, corners, points), np.inf)
    for j in range(3):
        start, along = corners[:, j], corners[:, (j + 1) % 3] - corners[:, j]
        length = np.maximum((along * along).sum(-1), np.finfo(float).tiny)
        s = np.clip(((points - start) * along).sum(-1) / length, 0.0, 1.0)
        on_edge = np.zeros((*s.shape, 3))
        on_edge[..., j], on_edge[..., (j + 1) % 3] = 1 - s, s
        distance = _square_distance(on_edge, corners, points)
        nearer = distance < square
        best, square = np.where(nearer[..., None], on_edge, best), np.where(nearer, distance, square)
    return best, square


def _square_distance(weights: Array, corners: Array, points: Array) -> Array:
    off: Array = np.einsum("kmc,mcx->kmx", weights, corners) - points
    squares: Array = (off * off).sum(-1)
    return squares


def _parts(points: Array, items: int) -> Iterator[Array]:
    size = max(1, _PAIRS // items)
    return (points[i : i + size] for i in range(0, len(points), size))
