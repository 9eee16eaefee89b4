"""Marker samples over non-uniform time: interpolation that respects gaps, and the noise they show."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .types import Array

Kind = Literal["linear", "cubic"]
KINDS: tuple[Kind, ...] = ("linear", "cubic")

_DEFAULT_GAP_INTERVALS = 3.5
_FEWEST_WINDOWS = 8
_MAD_TO_STANDARD_DEVIATION = 1.4826


def stretches(which: NDArray[Any]) -> list[tuple[int, int]]:
    """The first entry of each row of neighboring entries (n,) that are True, and the one behind its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], which.astype(int), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def default_max_gap(times: Array) -> float:
    """3.5 median frame intervals, s: two lost frames in a row are bridged, three are not. 0 for one frame."""
    return float(_DEFAULT_GAP_INTERVALS * np.median(np.diff(times))) if len(times) > 1 else 0.0


def mean_position(positions: Array) -> Array:
    """Mean over the frames in which a marker is seen, (markers, axes); NaN where it never is."""
    seen = ~np.isnan(positions)
    count = seen.sum(axis=0)
    total = np.where(seen, positions, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def linear(knots: Array, values: Array, at: Array) -> Array:
    """(at, ...) what is linear between knots, where it has values (knots, ...), and constant outside."""
    columns = [np.interp(at, knots, column) for column in values.reshape(len(knots), -1).T]
    return np.stack(columns, axis=1).reshape(len(at), *values.shape[1:])


def interpolate(times: Array, positions: Array, at: Array, kind: Kind, max_gap: float) -> Array:
    """Positions of every marker at other times, NaN where its neighboring samples are too far apart.

    A value is given between two consecutive seen samples at most `max_gap` apart, and on a seen sample.
    "cubic" is the C1 cubic Hermite interpolant whose slope at a sample is that of the parabola through it
    and its two neighbors (Bessel's; de Boor 1978, A Practical Guide to Splines, chapter IV): exact for
    quadratic motion, local, and blind to what lies beyond a long gap.

    Args:
        times: (frames,) s, strictly increasing.
        positions: (frames, markers, 3) m, NaN = not seen.
        at: (samples,) s.
        kind: "linear" or "cubic".
        max_gap: s.

    Returns:
        (samples, markers, 3) m.
    """
    result = np.full((len(at), *positions.shape[1:]), np.nan)
    for marker in range(positions.shape[1]):
        seen = ~np.isnan(positions[:, marker, 0])
        result[:, marker] = _interpolate_one(times[seen], positions[seen, marker], at, kind, max_gap)
    return result


def _interpolate_one(times: Array, x: Array, at: Array, kind: Kind, max_gap: float) -> Array:
    """One marker, seen throughout: times (n,), x (n, 3), at (samples,) to (samples, 3)."""
    result = np.full((len(at), 3), np.nan)
    if len(times) < 2:
        for time, value in zip(times, x, strict=True):
            result[at == time] = value
        return result
    width = np.diff(times)
    bridged = width <= max_gap * (1 + 1e-9)
    left = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    on_sample = (at == times[left]) | (at == times[left + 1])
    known = (at >= times[0]) & (at <= times[-1]) & (bridged[left] | on_sample)

    k = left[known]
    h = width[k, None]
    s = (at[known, None] - times[k, None]) / h
    if kind == "linear":
        result[known] = (1 - s) * x[k] + s * x[k + 1]
        return result
    slope = _parabola_slopes(x, width, bridged)
    result[known] = (
        (1 + 2 * s) * (1 - s) ** 2 * x[k]
        + s**2 * (3 - 2 * s) * x[k + 1]
        + h * s * (1 - s) * ((1 - s) * slope[k] - s * slope[k + 1])
    )
    return result


def _parabola_slopes(x: Array, width: Array, bridged: NDArray[np.bool_]) -> Array:
    """Slope at each sample, from neighbors reached without crossing a long gap; 0 for a lone sample."""
    chord = np.diff(x, axis=0) / width[:, None]
    to_left = np.append(False, bridged)
    to_right = np.append(bridged, False)
    inner = np.flatnonzero(to_left & to_right)
    slope = np.zeros_like(x)
    before, after = width[inner - 1, None], width[inner, None]
    slope[inner] = (after * chord[inner - 1] + before * chord[inner]) / (before + after)
    # At the end of a run the same parabola goes on: its slope is linear, with mean `chord` over the interval.
    for ends, toward in ((to_right & ~to_left, 1), (to_left & ~to_right, -1)):
        for k in np.flatnonzero(ends):
            secant = chord[min(k, k + toward)]
            neighbor = k + toward
            has_parabola = to_left[neighbor] and to_right[neighbor]
            slope[k] = 2 * secant - slope[neighbor] if has_parabola else secant
    return slope


def noise(times: Array, positions: Array) -> Array:
    """Standard deviation of the measurement noise per marker and coordinate, from the data alone.

    Each sample is compared with the cubic through its two neighbors on either side; with independent noise
    of deviation sigma that residual has variance sigma^2 (1 + sum of the squared Lagrange weights). The
    deviation is taken from the median of its size, so short bursts of fast motion do not count. Motion with
    content above about a fifth of the frame rate reads as noise: then this is an upper bound.

    Args:
        times: (frames,) s, strictly increasing.
        positions: (frames, markers, 3) m, NaN = not seen.

    Returns:
        (markers,) m: root mean square of the deviation of one coordinate, over those in which a marker moves (a camera
        that tracks a plane leaves one constant); NaN for a marker that has fewer than 8 runs of five frames in a row.
    """
    markers = positions.shape[1]
    if len(times) - 4 < _FEWEST_WINDOWS:
        return np.full(markers, np.nan)
    residual = off_neighbors(times, positions)
    moves = (np.fmax.reduce(positions, axis=0) > np.fmin.reduce(positions, axis=0)).any(axis=0)
    count = max(1, int(moves.sum()))
    deviation = np.full(markers, np.nan)
    for marker in range(markers):
        size = np.abs(residual[:, marker])
        size = size[~np.isnan(size[:, 0])]
        if len(size) >= _FEWEST_WINDOWS:
            per_axis = _MAD_TO_STANDARD_DEVIATION * np.median(size, axis=0)
            deviation[marker] = np.sqrt(np.sum(per_axis**2) / count)
    return deviation


def off_neighbors(times: Array, positions: Array) -> Array:
    """(frames - 4, markers, 3) how far each sample is from the cubic through its two neighbors on either side, over
    sqrt(1 + sum of the squared Lagrange weights): independent noise keeps its deviation. NaN where one is not seen."""
    frames = np.arange(2, len(times) - 2)
    neighbors = frames[:, None] + np.array([-2, -1, 1, 2])
    weights = _lagrange_weights(times[neighbors], times[frames])
    residual: Array = positions[frames] - np.einsum("fk,fkmc->fmc", weights, positions[neighbors])
    residual /= np.sqrt(1 + np.sum(weights**2, axis=1))[:, None, None]
    return residual


def _lagrange_weights(nodes: Array, at: Array) -> Array:
    """Weights (n, k) with which values at nodes (n, k) give the interpolating polynomial at times at (n,)."""
    weights = np.ones_like(nodes)
    for j in range(nodes.shape[1]):
        for k in range(nodes.shape[1]):
            if k != j:
                weights[:, j] *= (at - nodes[:, k]) / (nodes[:, j] - nodes[:, k])
    return weights
