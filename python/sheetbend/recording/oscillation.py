"""The first frequency that a motion shows: one number by which measured and simulated motions are compared."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import mean_position
from ..arrays.types import Array

FEWEST_PERIODS = 3.0
"""Below this many periods a window and a trend cannot be told from a frequency."""

_PADDING = 32  # zero padding of the spectrum; a parabola through its peak does the rest


def dominant_direction(positions: Array) -> Array:
    """Unit vector (markers, axes) along which the markers move most together, about their mean; NaN = not seen."""
    motion = np.nan_to_num(positions - mean_position(positions)).reshape(len(positions), -1)
    _, vectors = np.linalg.eigh(motion.T @ motion)
    direction: Array = vectors[:, -1].reshape(positions.shape[1:])
    return direction


def along(positions: Array, direction: Array) -> Array:
    """The motion (frames,) m along the direction; unseen markers count as being at their mean."""
    coordinate: Array = np.einsum("fmk,mk->f", np.nan_to_num(positions - mean_position(positions)), direction)
    return coordinate


def first_frequency(times: Array, series: Array) -> float | None:
    """Frequency [Hz] of the highest peak of the spectrum, the linear trend removed and a Hann window applied.

    Harris 1978, Proc. IEEE 66, 51-83, on windows. Decaying oscillations of a single frequency come out within 0.5 %
    from three periods on.

    Args:
        times: (frames,) s, increasing; unequal steps are interpolated linearly.
        series: (frames,), any unit.

    Returns:
        None where the peak stands for fewer than `FEWEST_PERIODS` periods, or nothing moves.
    """
    n, duration = len(times), float(times[-1] - times[0])
    if n < 8:
        return None
    t = np.linspace(times[0], times[-1], n)
    y = np.interp(t, times, series)
    y = y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0])
    spectrum: NDArray[np.float64] = np.abs(np.fft.rfft(y * np.hanning(n), _PADDING * n))
    k = int(np.argmax(spectrum))
    if not 0 < k < len(spectrum) - 1 or not spectrum[k] > 0.0:
        return None
    low, mid, high = spectrum[k - 1 : k + 2]
    peak = k + 0.5 * (low - high) / (low - 2.0 * mid + high)
    frequency = peak / (_PADDING * n * (t[1] - t[0]))
    return float(frequency) if frequency * duration >= FEWEST_PERIODS else None
