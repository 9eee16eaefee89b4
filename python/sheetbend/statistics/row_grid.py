"""Residual rows as arrays of frames and channels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array
from .colored import Part
from .layout import Integers, Layout

ZERO = 1e-290  # sum of squares: the numbers are so small that ratios of them are rounding
_SILENT = 1e-20  # of the loudest kind's sum of squares: rounding, which has no spectrum


class RowGrid:
    """Rows laid out as (frames, channels) arrays, zero where there is no row."""

    def __init__(self, layout: Layout, residuals: Array) -> None:
        series = np.stack([layout.recording, layout.clocks])
        owner, self._recording = _columns(series)
        channels, self._channel = _columns(np.stack([self._recording, layout.channel]))
        first = np.full(owner.shape[1], np.iinfo(int).max)
        np.minimum.at(first, self._recording, layout.frame)
        self._frame = layout.frame - first[self._recording]
        self.recordings = channels[0]  # of each channel
        self.frames = int(self._frame.max()) + 1
        self.length = 2 << (2 * self.frames - 1).bit_length()  # twice what lags need: narrow spectral peaks count
        self.residuals = self.dense(residuals)
        self.mask = self.dense(np.ones(len(residuals)))
        self.kinds = self._kinds(np.unique(layout.kinds, return_inverse=True)[1])

    def _kinds(self, each: Integers) -> Integers:
        """(channels,) from 0 on, of those of each row; silent ones, such as the axis across a planar motion, count to
        the loudest."""
        kinds = np.zeros(len(self.recordings), dtype=int)
        kinds[self._channel] = each
        power = np.bincount(kinds, (self.residuals**2).sum(0))
        silent = power <= _SILENT * power.max()
        kinds[silent[kinds]] = int(np.argmax(power))
        return np.asarray(np.unique(kinds, return_inverse=True)[1])

    def dense(self, column: Array) -> Array:
        """(rows,) as (frames, channels)."""
        array = np.zeros((self.frames, len(self.recordings)))
        array[self._frame, self._channel] = column
        return array

    def parts(self, columns: Array, kinds: Integers) -> list[Part]:
        """(rows, p) by recording and kind of channel."""
        owner, part_of = _columns(np.stack([self.recordings, kinds]))
        place, found = np.zeros(len(kinds), dtype=int), []
        order = np.argsort(part_of[self._channel], kind="stable")
        ends = np.searchsorted(part_of[self._channel][order], np.arange(owner.shape[1] + 1))
        frames = np.zeros(owner[0].max() + 1, dtype=int)
        np.maximum.at(frames, self._recording, self._frame + 1)
        for number, (recording, kind) in enumerate(owner.T.tolist()):
            channels, rows = np.flatnonzero(part_of == number), order[ends[number] : ends[number + 1]]
            place[channels] = np.arange(len(channels))
            made = np.zeros((frames[recording], columns.shape[1], len(channels)))
            made[self._frame[rows], :, place[self._channel[rows]]] = columns[rows]
            mask = self.mask[: len(made), None, channels]
            found.append(Part(recording, kind, channels, made, mask))
        return found

    def scores(self, influence: Array) -> list[Array]:
        """For each recording (frames, p): what each frame adds to the estimate, summed over channels."""
        rows = influence * self.residuals[self._frame, self._channel][:, None]
        sums = np.zeros((self._recording.max() + 1, self.frames, influence.shape[1]))
        np.add.at(sums, (self._recording, self._frame), rows)
        return [sums[index, : self._frame[self._recording == index].max() + 1] for index in range(len(sums))]

    def transform(self, array: Array) -> NDArray[np.complex128]:
        """Fourier transform along the frames, padded so that nothing wraps around."""
        return np.fft.rfft(array, self.length, axis=0)

    def lags(self, power: Array, count: int) -> Array:
        """Lagged sums 0 ... count of a (cross) power spectrum (frequencies,)."""
        return np.fft.irfft(power, self.length)[: count + 1]

    def channel_covariance(self, kinds: Integers) -> Array:
        """(channels, channels), zero between recordings, scaled to the pooled variance 1 in each kind."""
        number = self.mask.sum(0)
        matrix = self.residuals.T @ self.residuals / np.sqrt(np.outer(number, number))
        matrix[self.recordings[:, None] != self.recordings] = 0.0
        pooled = np.bincount(kinds, (self.residuals**2).sum(0)) / np.bincount(kinds, number)
        size = np.sqrt(np.maximum(pooled, ZERO))[kinds]
        return np.asarray(matrix / np.outer(size, size))


def _columns(places: Integers) -> tuple[Integers, Integers]:
    """(2, k) the different columns of (2, n) in order, and (n,) which of them each is. NumPy's own `unique` of columns
    takes ten times as long."""
    order = np.lexsort(places[::-1])
    ordered = places[:, order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (ordered[:, 1:] != ordered[:, :-1]).any(axis=0)
    which = np.empty(len(order), dtype=int)
    which[order] = np.cumsum(new) - 1
    return ordered[:, new], which
