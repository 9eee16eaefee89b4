"""A mesh led smoothly through measured points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, numbers
from ..arrays.types import Array
from ..errors import MeshError

_LINE = 1e-6  # of their extent: points that lie so near to a line lead no surface


def through(vertices: Array, at: Array, positions: ArrayLike) -> Array:
    """(n, 3) m, where vertices (n, 3) come to lie when points of their surface, (k, 3), move to positions (k, 3).

    The map is a thin plate spline (Duchon 1977): affine, plus a share of r^2 log r for each point. Points with NaN are
    left out.

    Raises:
        MeshError: positions of another shape, points that coincide, or fewer than three off a line.
    """
    to = numbers("positions", positions, MeshError)
    if to.shape != at.shape:
        raise MeshError("positions", "do not match the places", to.shape, f"give {at.shape}")
    seen = ~np.isnan(to).any(axis=1)
    start, to = at[seen], finite("positions", to[seen], None, MeshError)
    center = start.mean(axis=0) if len(start) else np.zeros(3)
    _, spread, axes = np.linalg.svd(start - center, full_matrices=False)
    if len(start) < 3 or spread[1] <= _LINE * spread[0]:
        raise MeshError("positions", "need three points off a line that are seen", len(start), "give more points")
    apart = np.linalg.norm(start[:, None] - start[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    if apart.min() <= _LINE * spread[0]:
        pair = np.unravel_index(apart.argmin(), apart.shape)
        raise MeshError("places", "coincide", [int(k) for k in pair], "leave out one of them")
    along = axes[spread > _LINE * spread[0]] / spread[0]  # of flat points nothing tells what lies off their plane
    knots, points = (start - center) @ along.T, (vertices - center) @ along.T
    affine = np.column_stack([np.ones(len(knots)), knots])
    zero = np.zeros((affine.shape[1], affine.shape[1]))
    system = np.block([[_plate(knots, knots), affine], [affine.T, zero]])
    weights = np.linalg.solve(system, np.concatenate([to, np.zeros((affine.shape[1], 3))]))
    found: Array = _plate(points, knots) @ weights[: len(knots)]
    return found + np.column_stack([np.ones(len(points)), points]) @ weights[len(knots) :]


def _plate(points: Array, knots: Array) -> Array:
    """(n, k) r^2 log r."""
    square = ((points[:, None] - knots[None]) ** 2).sum(axis=2)
    return 0.5 * square * np.log(np.where(square > 0.0, square, 1.0))
