"""The shadow of a cloth from above, and its folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array

RAYS = 720


@dataclass(frozen=True)
class Shadow:
    """Outline of the shadow by rays from the origin, each to the farthest point of the cloth on it.

    Attributes:
        radius: (RAYS,) m, at equal angles.
        area: m^2.
        area_bar: (vertices, 3) m, derivative of the area with respect to the positions; exact, and continuous but for
            kinks.
        hidden: share of the rays that meet the border more than once: there the cloth overhangs itself, and the outline
            takes what lies under the outermost fold for covered.
    """

    radius: Array
    area: float
    area_bar: Array
    hidden: float

    @property
    def nodes(self) -> int:
        """Number of folds: the strongest wave of the outline, from two on."""
        spectrum = np.abs(np.fft.rfft(self.radius))
        return 2 + int(spectrum[2 : RAYS // 20].argmax())


def shadow(positions: Array, edges: NDArray[np.int64], rim: NDArray[np.int64]) -> Shadow:
    """The shadow in the x-y plane of a cloth around the origin.

    Args:
        positions: (vertices, 3) m.
        edges: (e, 2) vertices.
        rim: vertices of the border, in order.
    """
    angle = 2.0 * np.pi * (np.arange(RAYS) + 0.5) / RAYS
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    flat = positions[:, :2]
    met = _crossings(flat[edges], ray)
    best = met.argmax(axis=1)
    radius = met[np.arange(RAYS), best]
    width = 2.0 * np.pi / RAYS

    # on its edge from a to b a ray of direction e ends at r = (a x b)/(e x (b - a))
    ends = edges[best]
    a, b = flat[ends[:, 0]], flat[ends[:, 1]]
    along = b - a
    below = ray[:, 0] * along[:, 1] - ray[:, 1] * along[:, 0]
    by_a = np.column_stack([b[:, 1] - radius * ray[:, 1], -b[:, 0] + radius * ray[:, 0]]) / below[:, None]
    by_b = np.column_stack([-a[:, 1] + radius * ray[:, 1], a[:, 0] - radius * ray[:, 0]]) / below[:, None]
    bar = np.zeros_like(positions)
    np.add.at(bar[:, :2], ends[:, 0], (radius * width)[:, None] * by_a)
    np.add.at(bar[:, :2], ends[:, 1], (radius * width)[:, None] * by_b)
    border = np.column_stack([rim, np.roll(rim, -1)])
    hidden = float(((_crossings(flat[border], ray) > 0.0).sum(axis=1) > 1).mean())
    return Shadow(radius, float((radius**2).sum() * width / 2.0), bar, hidden)


def _crossings(segments: Array, ray: Array) -> Array:
    """(rays, segments) m, distance from the origin at which each ray meets each segment (s, 2, 2), 0 where it does
    not."""
    x, y = segments.reshape(-1, 2).T
    side = np.outer(ray[:, 0], y) - np.outer(ray[:, 1], x)
    a, b = side[:, ::2], side[:, 1::2]
    met = (a < 0.0) != (b < 0.0)
    share = np.where(met, a / np.where(met, a - b, 1.0), 0.0)
    depth = np.outer(ray[:, 0], x) + np.outer(ray[:, 1], y)
    distance = depth[:, ::2] + share * (depth[:, 1::2] - depth[:, ::2])
    return np.where(met & (distance > 0.0), distance, 0.0)
