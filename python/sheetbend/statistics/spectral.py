"""The covariance of residual rows between columns of a Jacobian, from autoregressive spectra of the residuals.

The rows' covariance is Omega = C (x) rho (see `covariance`). Fitting takes correlation out of the residuals. So the
spectra are corrected by the ratio of the observed lagged sums to those that a fit with such errors is expected to
leave.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays.types import Array
from .autoregression import levinson, spectrum_of
from .colored import Colored, Part
from .layout import Integers, Layout
from .row_grid import RowGrid

_MAX_ORDER = 20
_CORRECTIONS = 2  # the second already changes the intervals by less than 1 %


def spectral_covariance(grid: RowGrid, Q: Array, kinds: Integers) -> tuple[Array, float]:
    """(p, p) Q' Omega Q of columns Q (rows, p) at right angles, Omega = C (x) rho with one rho for each kind of
    channel, (channels,), and the autocorrelation time of the first rho in frames."""
    parts = grid.parts(Q, kinds)  # H = Q Q' takes Omega to cov(residuals)
    mixing = grid.channel_covariance(kinds)
    most = min(_MAX_ORDER, int(10 * np.log10(grid.frames)), grid.frames // 4)
    own = [kinds == kind for kind in range(int(kinds.max()) + 1)]
    rows = [grid.mask[:, mine].sum() for mine in own]
    power = np.abs(grid.transform(grid.residuals)) ** 2
    orders, observed = [], []
    for mine, count in zip(own, rows, strict=True):
        recursion = levinson(grid.lags(power[:, mine].sum(1), most) / count)
        alike = mixing[np.ix_(mine, mine)]
        worth = count * np.trace(alike) ** 2 / (len(alike) * (alike**2).sum())  # rows that are worth an independent one
        price = np.log(worth) if len(own) == 1 else 2.0  # a slow part under white noise takes many coefficients
        criteria = [worth * np.log(noise) + price * len(a) for a, noise in recursion]
        orders.append(int(np.argmin(criteria)))
        observed.append(spectrum_of(*recursion[orders[-1]], grid.length))
    seen = np.abs(grid.transform(grid.mask)) ** 2
    pairs = [grid.lags(seen[:, mine] @ np.diag(mixing)[mine], most) for mine in own]
    spectra = observed
    colored = Colored(parts, mixing, grid.length)
    for step in range(_CORRECTIONS + 1):
        spread = [colored(part, spectra) for part in parts]
        inner = np.zeros((Q.shape[1], Q.shape[1]))
        for part, a in zip(parts, spread, strict=True):
            inner += np.tensordot(part.columns, a, ([0, 2], [0, 2]))
        if step < _CORRECTIONS:
            expected = _expected_lags(grid, spectra, pairs, parts, spread, inner)
            spectra = [
                spectrum * first / spectrum_of(*levinson(lags / count)[order], grid.length)
                for spectrum, first, lags, count, order in zip(spectra, observed, expected, rows, orders, strict=True)
            ]
    time = max(float(spectra[0][0] / np.fft.irfft(spectra[0], grid.length)[0]), 1.0)
    return (inner + inner.T) / 2, time


def _expected_lags(
    grid: RowGrid,
    spectra: list[Array],
    pairs: list[Array],
    parts: list[Part],
    spread: list[Array],
    inner: Array,
) -> list[Array]:
    """Expected lagged sums, by kind, of the fitted residuals (1 - H) e for errors e of covariance Omega.

    (1 - H) Omega (1 - H)' = Omega - Q A' - A Q' + Q G Q', A = Omega Q, G = Q' A, summed along its diagonals.
    """
    lags = [known * grid.lags(spectrum, len(known) - 1) for known, spectrum in zip(pairs, spectra, strict=True)]
    for part, a in zip(parts, spread, strict=True):
        q, count = part.columns, len(lags[part.kind])
        lags[part.kind] += _lagged((inner + inner.T) / 2 @ q - a, q, count) - _lagged(q, a, count)
    return lags


def _lagged(first: Array, second: Array, count: int) -> Array:
    """(count,) sums of products of (frames, ...) arrays, the second one 0, 1, ... frames later."""
    frames = len(first)
    x, y = np.ascontiguousarray(first).reshape(frames, -1), np.ascontiguousarray(second).reshape(frames, -1)
    return np.array([np.vdot(x[: frames - lag], y[lag:]) if lag < frames else 0.0 for lag in range(count)])


def autocorrelation(residuals: Array, layout: Layout) -> Array:
    """(lags,) correlation of residuals with those of the same series 1, 2, ... frames later, over all series."""
    if not residuals.any():
        return np.zeros(0)
    grid = RowGrid(layout, residuals)
    sums = grid.lags((np.abs(grid.transform(grid.residuals)) ** 2).sum(1), min(_MAX_ORDER, grid.frames // 2))
    return np.asarray(sums[1:] / sums[0])


def frames_alike(residuals: Array, layout: Layout, least: float = 0.0) -> float:
    """How many frames of residuals count as one, by the correlation before the first lag at which it is `least` or
    less."""
    lags = autocorrelation(residuals, layout)
    apart = np.flatnonzero(lags <= least)
    return 1.0 + 2.0 * float(lags[: apart[0] if len(apart) else len(lags)].sum())


def effective_deviation(residuals: Array, layout: Layout, taken: float) -> float:
    """What residuals are divided by to count as independent ones of unit variance in a sum of squares.

    Args:
        taken: degrees of freedom that a fit took of them.
    """
    variance = float(residuals @ residuals) / max(len(residuals) - taken, 1.0)
    return math.sqrt(max(variance, 1e-300) * frames_alike(residuals, layout))
