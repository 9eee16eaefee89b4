"""Autoregressive models of stationary series."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array


def levinson(lags: Array) -> list[tuple[Array, float]]:
    """Autoregressive coefficients and innovation variance of every order from 0 (Levinson's recursion)."""
    coefficients, noise = np.zeros(0), float(lags[0])
    fits = [(coefficients, noise)]
    for order in range(1, len(lags)):
        reflection = float(lags[order] - coefficients @ lags[order - 1 : 0 : -1]) / noise
        before, coefficients = coefficients, np.empty(order)
        coefficients[:-1] = before - reflection * before[::-1]
        coefficients[-1] = reflection
        noise *= max(1 - reflection**2, 1e-12)
        fits.append((coefficients, noise))
    return fits


def spectrum_of(coefficients: Array, noise: float, length: int) -> Array:
    """Power at the frequencies of a real transform of `length` samples."""
    power: Array = noise / np.abs(np.fft.rfft(np.append(1.0, -coefficients), length)) ** 2
    return power
