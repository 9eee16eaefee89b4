"""Finds the order of the axes of an array of markers, if a file stores them in another order than its reader expects.

The axis of length 3 holds the coordinates. Of the other two, the one along which positions change by less than the
distance between markers holds the frames. A fourth coordinate that all markers share, and that rises from frame to
frame, holds the times.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays.types import Array

Order = tuple[int, int, int]
"""Numbers of the axes that hold frames, markers and coordinates."""

NAMES = ("frames", "markers", "coordinates")
CLEAR = 0.5  # steps from frame to frame over those from marker to marker, below which the order is clear
LONGER, FEWEST = 2, 20  # times as many frames as markers, and frames, where a possible order is not the right one
SECONDS = 0.5  # largest step between frames that is in s; a larger one is in ms, us or ns
FINER = (1e-3, 1e-6, 1e-9)


@dataclass(frozen=True)
class Ordered:
    """An array of markers in the usual order.

    Attributes:
        positions: (frames, markers, 3).
        times: (frames,) s, where the array holds them.
        words: what was done to the order of the axes, in sentences.
    """

    positions: Array
    times: Array | None = None
    words: tuple[str, ...] = ()


def ordered(array: NDArray[Any], usual: Order) -> Ordered | None:
    """The array in the usual order of axes; None where it is in none, or not clearly.

    Args:
        array: of three axes.
        usual: the order that the reader expects; it is taken unless another one is clear.
    """
    order = _order(array, usual)
    if order is not None:
        return Ordered(array.transpose(order), words=_said(order, usual))
    for axis in (k for k in range(3) if array.shape[k] == 4):
        for row in (3, 0):
            rest = np.delete(array, row, axis)
            order = _order(rest, usual)
            times = None if order is None else _times(array.transpose(order)[:, :, row])
            if order is not None and times is not None:
                words = f"the row of number {row} beside its coordinates is taken as times: all markers share it"
                return Ordered(rest.transpose(order), times, (*_said(order, usual), words))
    return None


def _order(array: NDArray[Any], usual: Order) -> Order | None:
    roughness = {order: _roughness(array.transpose(order)) for order in _possible(array.shape)}
    if usual in roughness:
        frames, markers, coordinates = usual
        other = (markers, frames, coordinates)
        longer = array.shape[markers] >= max(FEWEST, LONGER * array.shape[frames])
        return other if longer and roughness[other] < CLEAR else usual
    clear = [order for order in roughness if roughness[order] < CLEAR]
    return min(clear, key=lambda order: roughness[order]) if clear else None


def _possible(shape: tuple[int, ...]) -> Iterator[Order]:
    for coordinates in range(3):
        if shape[coordinates] == 3:
            first, second = (k for k in range(3) if k != coordinates)
            yield from ((first, second, coordinates), (second, first, coordinates))


def _roughness(x: NDArray[Any]) -> float:
    """The median step from frame to frame over that from marker to marker; infinite where there is none of either."""
    with np.errstate(over="ignore", invalid="ignore"):
        along_time, along_markers = (np.linalg.norm(np.diff(x.astype(float), axis=k), axis=2) for k in (0, 1))
    if not (np.isfinite(along_time).any() and np.isfinite(along_markers).any()):
        return float("inf")
    apart = float(np.nanmedian(along_markers))
    return float(np.nanmedian(along_time)) / apart if apart > 0.0 else float("inf")


def _times(rows: NDArray[Any]) -> Array | None:
    """(frames,) s from (frames, markers), or None where these are no times."""
    first = rows[:, :1].astype(float)
    if len(first) < 2 or not (rows == first).all() or not (np.diff(first[:, 0]) > 0.0).all():
        return None
    times = first[:, 0] - first[0, 0]
    step = float(np.median(np.diff(times)))
    unit = next((u for u in (1.0, *FINER) if step * u <= SECONDS), FINER[-1])
    return np.asarray(times * unit)


def _said(order: Order, usual: Order) -> tuple[str, ...]:
    if order == usual:
        return ()
    found, expected = (", ".join(NAMES[k] for k in np.argsort(o)) for o in (order, usual))
    return (f"its axes are ({found}) instead of ({expected}), and are taken as such",)
