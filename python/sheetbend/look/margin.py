"""How far a cloth goes on beyond its outer row of markers, up to the edge that something holds.

The rows move, and what holds the edge does not, or moves as a tool does. So the edge is where the motion of the rows
runs together: a parabola through the first markers of each column goes on beyond the outer one, and the edge is at the
distance at which its end is nearest to rest, or rides on the tool best. How near is divided by how much of the markers'
noise the end has in it. This is total least squares; without it a short distance would always seem best.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..arrays.types import Array

HALF = 0.5  # of the distance between rows: how far a cloth goes on where nothing tells it
FEWEST, ROWS = 3, 4  # markers of a column, at least and at most, through which a parabola goes
LEAST, MOST, STEP = -0.3, 1.5, 0.1  # of the distance between rows, where the edge is looked for
KNOWN = 0.1  # of the distance between rows: standard deviation up to which the motion tells it
NOISY = 0.03  # of the distance between rows: standard deviation from which on the noise limits three markers
FRAMES = 20  # with all these markers, at least

Off = Callable[[Array], float]


class Edge(NamedTuple):
    """An edge of a cloth, found from the motion of the rows.

    Attributes:
        beyond: m, how far it is from the outer row of markers.
        sd: m, standard deviation of `beyond`.
        points: (frames, columns, 3) m, where it is, NaN where markers are lost.
        along: (columns,) m, where these points are along the edge, as in the layout.
    """

    beyond: float
    sd: float
    points: Array
    along: Array


class Margin(NamedTuple):
    """How far a cloth goes on beyond a row of markers.

    Attributes:
        share: of the distance between rows.
        length: m.
        edge: where it ends; None where the motion does not show it and `HALF` is taken.
    """

    share: float
    length: float
    edge: Edge | None


def pitches(flat: Array) -> Array:
    """(2,) m between neighbors along each axis of a layout (markers, 2), in the median: rows may be farther apart than
    the markers in them."""
    gaps = flat[None] - flat[:, None]
    found = []
    for axis in (0, 1):
        along, across = gaps[..., axis], np.abs(gaps[..., 1 - axis])
        ahead = np.where(along > across, along, np.inf).min(axis=1)
        found.append(float(np.median(ahead[np.isfinite(ahead)])))
    return np.array(found)


def at_rest(edge: Array) -> float:
    """m, root mean square distance of points (frames, k, 3) from their means."""
    return float(np.sqrt(np.nanmean(np.nanvar(edge, axis=0).sum(axis=1))))


def margin(x: Array, flat: Array, axis: int, sign: int, off: Off = at_rest) -> Margin:
    """How far the cloth goes on beyond its outer row on one side: to the edge that its motion shows, else by half of
    the distance between rows.

    Three markers of a column follow the bend of the cloth best; four average more noise, and count where that is what
    limits three.

    Args:
        x: (frames, markers, 3) m.
        flat: (markers, 2) m, the layout.
        axis, sign: of the layout, on which the side is.
        off: m, how far points (frames, k, 3) are off the motion of what holds the edge.
    """
    pitch = pitches(flat)
    edge = _edge(x, flat, axis, sign, off, pitch, FEWEST)
    if edge is None or edge.sd > NOISY * pitch[axis]:
        edge = _edge(x, flat, axis, sign, off, pitch, ROWS)
    if edge is None or edge.sd > KNOWN * pitch[axis]:
        return Margin(HALF, HALF * float(pitch[axis]), None)
    return Margin(edge.beyond / float(pitch[axis]), edge.beyond, edge)


def _edge(x: Array, flat: Array, axis: int, sign: int, off: Off, pitch: Array, most: int) -> Edge | None:
    """The edge where parabolas through up to `most` markers of each column run together; None where they do not."""
    columns = _columns(flat, axis, sign, pitch, most)
    if len(columns) < 2:
        return None
    inward = [(sign * (flat[column[0], axis] - flat[column, axis])) for column in columns]
    seen = np.isfinite(x[:, sorted({k for column in columns for k in column}), 0]).all(axis=1)
    if seen.sum() < FRAMES:
        return None

    def points_at(beyond: float) -> tuple[Array, float]:
        """Points (frames, columns, 3) at a distance beyond the outer row, NaN where a marker is lost, and the square
        of their noise over that of a marker."""
        weights = [_onward(own, beyond) for own in inward]
        through = zip(weights, columns, strict=True)
        ends = np.stack([np.einsum("k,fkx->fx", w, x[:, column]) for w, column in through], axis=1)
        ends[~seen] = np.nan
        return ends, float(np.mean([w @ w for w in weights]))

    def off_at(beyond: float) -> float:
        ends, noise = points_at(beyond)
        return off(ends) ** 2 / noise

    step = STEP * float(pitch[axis])
    tried = step * np.arange(round(LEAST / STEP), round(MOST / STEP) + 1)
    square = np.array([off_at(beyond) for beyond in tried])
    best = int(np.argmin(square))
    if not 0 < best < len(tried) - 1:
        return None
    low, least, high = square[best - 1 : best + 2]
    bend = (low - 2.0 * least + high) / step**2
    beyond = float(tried[best] + 0.5 * (low - high) / (bend * step))
    sd = float(np.sqrt(2.0 * least / (bend * seen.sum() * len(columns))))
    if beyond < -2.0 * sd:  # no edge is inside of the markers
        return None
    beyond = max(0.0, beyond)
    along = np.array([flat[column[0], 1 - axis] for column in columns])
    return Edge(beyond, sd, points_at(beyond)[0], along)


def _columns(flat: Array, axis: int, sign: int, pitch: Array, most: int) -> list[list[int]]:
    """Numbers of the first markers, three to `most`, of each column that begins in the outer row, from there inward."""
    across, along = sign * flat[:, axis], flat[:, 1 - axis]
    outer = np.flatnonzero(across > across.max() - 0.5 * pitch[axis])
    found = []
    for k in outer[np.argsort(along[outer])]:
        own = np.flatnonzero(np.abs(along - along[k]) < 0.5 * pitch[1 - axis])
        own = own[np.argsort(-across[own])][:most]
        if own[0] == k and len(own) >= FEWEST and (np.diff(-across[own]) > 0.5 * pitch[axis]).all():
            found.append([int(j) for j in own])
    return found


def _onward(inward: Array, beyond: float) -> Array:
    """Weights of values at distances `inward` (k,) in that of the best parabola through them at -beyond."""
    powers = np.arange(FEWEST)
    return np.asarray((-beyond) ** powers @ np.linalg.pinv(inward[:, None] ** powers))
