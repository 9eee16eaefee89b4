"""Markers in rows and columns on a sheet.

Between markers far from each other a sheet may hang in folds, so that all distances seen are shorter than those over
the fabric. Those between neighbors hardly are. Where markers stand in rows and columns, these lay out all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ..arrays.types import Array
from .margin import pitches

OPEN = 0.75  # of the distances across one gap are smaller than it: the others are bent, or shorter by noise
LONGER = 1.2  # times that over the fabric: how long a distance is at most, in a fabric that shears
EVEN = 0.05  # of a gap: how much the distances across it vary, in the median
NEAREST = 0.8  # of the markers are the nearest ones of the next row to those beside them
WIDEST = 2.0  # times the median of all: how wide a gap is at most
FILLED = 0.8  # of the places in rows and columns have a marker
SAME = 0.03  # of a distance, in the median: closer layouts are the same, and the first, from all distances, is better
BENT = 0.01  # of the distances between neighbors, rms: a layout that is farther off them bends straight rows


def in_rows(apart: Array, flat: Array) -> Array | None:
    """(markers, 2) m, markers in rows and columns; None where they do not stand so, or lie so in the first layout.

    Which marker stands where is read off a first layout `flat` (markers, 2), or off the order of the markers: row after
    row, each in the same direction or back and forth.

    Args:
        apart: (markers, markers) m, the largest distance of every two over time.
    """
    best, least, near = None, LONGER, np.zeros(apart.shape, dtype=bool)
    for cells in (*_rows_and_columns(flat), *_numbered(len(apart))):
        layout = _laid_out(cells, apart)
        if layout is None:
            continue
        over = np.linalg.norm(layout[:, None] - layout[None], axis=2) + np.eye(len(apart))
        longest = float((apart / over).max())
        if longest < least:
            best, least, near = layout, longest, np.abs(cells[:, None] - cells).sum(axis=2) == 1
    return None if best is None or _alike(best, flat, near, apart) else best


def _alike(layout: Array, flat: Array, near: Array, apart: Array) -> bool:
    """Whether two layouts (markers, 2) m have the same distances, and the second one keeps those between neighbors: far
    distances across a cloth that is gathered at its upper edge are short, and bend its rows."""
    one, other = (np.linalg.norm(x[:, None] - x[None], axis=2) + np.eye(len(x)) for x in (layout, flat))
    off, bent = (float(np.sqrt(np.mean((x[near] / apart[near] - 1.0) ** 2))) for x in (one, other))
    return float(np.median(np.abs(other / one - 1.0))) < SAME and not bent > max(BENT, 2.0 * off)


def _rows_and_columns(flat: Array) -> Iterator[Array]:
    """(markers, 2) whole numbers, the columns and rows in which a layout shows the markers."""
    cells = np.zeros(flat.shape, dtype=int)
    for axis, pitch in enumerate(pitches(flat)):
        order = np.argsort(flat[:, axis])
        cells[order, axis] = np.cumsum(np.diff(flat[order, axis], prepend=flat[order[0], axis]) > 0.5 * pitch)
    places = int(np.prod(cells.max(axis=0) + 1))
    if len(np.unique(cells, axis=0)) == len(cells) >= FILLED * places:
        yield cells


def _numbered(count: int) -> Iterator[Array]:
    """The same for markers that are numbered row after row, for every length of a row."""
    for width in range(2, count // 2 + 1):
        if count % width == 0:
            row, column = np.divmod(np.arange(count), width)
            yield np.stack([column, row], axis=1)
            yield np.stack([np.where(row % 2, width - 1 - column, column), row], axis=1)


def _laid_out(cells: Array, apart: Array) -> Array | None:
    """(markers, 2) m, by the distances across each gap; None where these vary, one gap is far wider than the others, or
    other markers are nearer."""
    layout, off, nearest = np.zeros(cells.shape), list[Array](), list[Array]()
    for axis in (0, 1):
        along, lines = (
            cells[:, 1 - axis],
            [np.flatnonzero(cells[:, axis] == k) for k in range(cells[:, axis].max() + 1)],
        )
        places = np.zeros(len(lines))
        for k, (here, there) in enumerate(pairwise(lines)):
            to = apart[np.ix_(here, there)]
            own = along[here][:, None] == along[there]
            if not own.any():
                return None
            gap = float(np.quantile(to[own], OPEN))
            places[k + 1] = places[k] + gap
            off.append(np.abs(to[own] / gap - 1.0))
            nearest.append((to == to.min(axis=1, keepdims=True))[own])
        if (np.diff(places) > WIDEST * np.median(np.diff(places))).any():
            return None
        layout[:, axis] = places[cells[:, axis]]
    known = np.median(np.concatenate(off)) < EVEN and np.mean(np.concatenate(nearest)) > NEAREST
    return layout if known else None
