"""Columns of a Jacobian times the covariance of correlated rows, by transforms along the frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array

Integers = NDArray[np.integer[Any]]

_KEPT = 1 << 22  # complex numbers of transforms, 64 MB


@dataclass(frozen=True)
class Part:
    """The channels of one kind in one recording: where they are among all, p columns of rows as (frames, p, channels),
    zero where there is no row, and the mask (frames, 1, channels) of rows."""

    recording: int
    kind: int
    channels: Integers
    columns: Array
    mask: Array


class Colored:
    """(part, spectra) -> that part of Omega times the columns; between kinds with the geometric mean of their spectra.
    The columns' transforms are kept from one to the next, where they are not many."""

    def __init__(self, parts: list[Part], mixing: Array, length: int) -> None:
        """With spectra of that length."""
        self._parts, self._mixing, self._length = parts, mixing, length
        self._kept: dict[tuple[int, int, int], NDArray[np.complex128]] = {}

    def __call__(self, part: Part, spectra: list[Array]) -> Array:
        frames = len(part.columns)
        padded = 2 << (frames - 1).bit_length()
        total = np.zeros((padded // 2 + 1, *part.columns.shape[1:]), dtype=complex)
        for other in self._parts:
            if other.recording != part.recording:
                continue
            mine, its = spectra[part.kind], spectra[other.kind]
            kernel = np.fft.irfft(mine if its is mine else np.sqrt(mine * its), self._length)[:frames]
            around = np.concatenate([kernel, np.zeros(padded - 2 * frames + 1), kernel[:0:-1]])
            total += self._mixed(part, other, padded) * np.fft.rfft(around).real[:, None, None]
        return np.asarray(part.mask * np.fft.irfft(total, padded, axis=0)[:frames])

    def _mixed(self, part: Part, other: Part, padded: int) -> NDArray[np.complex128]:
        """The transform of another part's columns, as its channels are alike with those of a part."""
        key = part.recording, part.kind, other.kind
        if key in self._kept:
            return self._kept[key]
        mixed = other.columns @ self._mixing[np.ix_(other.channels, part.channels)]
        made = np.fft.rfft(mixed, padded, axis=0)
        if sum(k.size for k in self._kept.values()) + made.size <= _KEPT:
            self._kept[key] = made
        return made
