"""Covariance of fitted parameters when the residuals are not white.

A model that is not quite right leaves residuals that are alike from one frame to the next and from one
marker to its neighbor. Then (J'J)^-1 s^2 is far too small. The sandwich is honest:

    cov = B (J' Omega J) B,   B = (J'J + P'P)^-1,   Omega = cov(residuals),  P the rows of the priors,

with Omega = C (x) rho: C the covariance of the channels of a recording (marker coordinates), rho the
autocorrelation over frames, from an autoregressive spectrum (Yule-Walker, order by the Bayesian criterion)
pooled over all channels. Fitting takes correlation out of the residuals; the spectrum is multiplied by the
ratio of observed to expected one, where the expectation follows exactly from B and J.

Why not Newey and West (1987, Econometrica 55, 703) alone: their lagged cross products see variances that
change over time, which Omega does not, but at 100 to 400 frames and a lag-one correlation of 0.8 their 95 %
intervals cover 77 to 92 % of the truths; these cover 91 to 96 %, white ones 42 to 76 %. So each parameter
takes the largest of the variances. Where the errors also fade over the recording, to a seventh, they
cover 84 to 98 %.

One rho for all channels is that of the loudest. A depth camera's noise is large and white along its view, and across it
small, with the slow slip of the points it follows: then Omega = C_ab sqrt(rho_a rho_b) with a rho for each kind of
channel (the coordinates x, y, z), pooled over channels of that kind, its order by Akaike's criterion. It is one more of
the variances of which the largest counts. On synthetic errors of that sort, 16 points in 33 frames, intervals of a
shift across the view cover 85 % of the truths, and without it 70 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import Array
from ..errors import InputError
from .autoregression import levinson, spectrum_of
from .colored import Colored, Part

Integers = NDArray[np.integer[Any]]

NEGLIGIBLE = 1e-10  # share of a parameter's variance
_MAX_ORDER = 20
_ZERO = 1e-290  # sum of squares: the numbers are so small that ratios of them are rounding
_SILENT = 1e-20  # of the loudest kind's sum of squares: rounding, which has no spectrum
_CORRECTIONS = 2  # the second already changes the intervals by less than 1 %


@dataclass(frozen=True)
class Layout:
    """Where each residual row comes from: integer arrays of shape (rows,).

    Attributes:
        recording: which recording; rows of different recordings are independent.
        channel: which series within it (a marker coordinate); channels of one recording may correlate.
        frame: the place within the series: frame number in time, or point number along a static shape.
        kind: of the channel, such as its axis: channels of one kind share an autocorrelation; one kind by default.
        clock: which clock within the recording counts the frames, 0 for all by default; rows of different clocks are
            independent.
    """

    recording: Integers
    channel: Integers
    frame: Integers
    kind: Integers | None = None
    clock: Integers | None = None

    def __post_init__(self) -> None:
        for field, given in (("kind", self.kinds), ("clock", self.clocks)):
            object.__setattr__(self, field, given)
        for field in ("recording", "channel", "frame", "kind", "clock"):
            array = np.asarray(getattr(self, field))
            if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
                raise InputError(f"layout.{field}", "must be one integer per row", array, "give shape (rows,)")
            object.__setattr__(self, field, array)
        lengths = [len(getattr(self, field)) for field in ("recording", "channel", "frame", "kind", "clock")]
        if len(set(lengths)) > 1:
            raise InputError("layout", "has arrays of different lengths", lengths, "give one entry per residual row")
        places = np.stack([self.frame, self.channel, self.clocks, self.recording])
        places = places[:, np.lexsort(places)]
        if (places[:, 1:] == places[:, :-1]).all(axis=0).any():
            fix = "number the recordings, channels and frames apart"
            raise InputError("layout", "has two rows in one place", len(self.frame), fix)

    @property
    def kinds(self) -> Integers:
        """(rows,) `kind`, also where none was given."""
        return np.zeros_like(self.frame) if self.kind is None else self.kind

    @property
    def clocks(self) -> Integers:
        """(rows,) `clock`, also where none was given."""
        return np.zeros_like(self.frame) if self.clock is None else self.clock

    def of(self, rows: NDArray[Any]) -> Layout:
        """That of some rows: (rows,) bool or numbers."""
        places = (self.recording, self.channel, self.frame, self.kinds, self.clocks)
        return Layout(*(place[rows] for place in places))

    @staticmethod
    def series(rows: int) -> Layout:
        """One series of `rows` equally spaced samples."""
        zeros = np.zeros(rows, dtype=int)
        return Layout(zeros, zeros, np.arange(rows))


@dataclass(frozen=True)
class Covariance:
    """What the residuals say about the internal parameters, p of them.

    Attributes:
        matrix: (p, p) covariance.
        degrees: (p,) effective degrees of freedom: (rows - p)/inflation, at least 1.
        inflation: (p,) variance relative to that for white residuals of the same size, at least 1.
        residual_variance: sum of squares/(rows - p).
        autocorrelation_time: frames that count as one, 1 for white residuals.
    """

    matrix: Array
    degrees: Array
    inflation: Array
    residual_variance: float
    autocorrelation_time: float


def covariance(
    residuals: Array,
    jacobian: Array,
    layout: Layout | None = None,
    prior_jacobian: Array | None = None,
    taken: float = 0.0,
) -> Covariance:
    """Covariance of a least-squares estimate from its residuals.

    Args:
        residuals: (rows,) weighted residuals of the data at the minimum.
        jacobian: (rows, p) their derivative; of full column rank together with the prior rows.
        layout: where each row comes from; one series of equally spaced samples by default.
        prior_jacobian: (priors, p) rows of the priors; their residuals have unit variance by their meaning. So have the
            rows that unknowns leave which were solved for on the way (X/s of adjoint/fit/projection.h): the estimate's
            error is B times the jacobian's rows times all errors, theirs included.
        taken: degrees of freedom of the residuals that such unknowns took away.

    Raises:
        InputError: shapes disagree, or there are no more rows than parameters.
    """
    rows, count = jacobian.shape
    layout = Layout.series(rows) if layout is None else layout
    if residuals.shape != (rows,) or layout.frame.shape != (rows,):
        shapes = (residuals.shape, jacobian.shape, layout.frame.shape)
        raise InputError("residuals", "disagree with the jacobian or the layout", shapes, "give one row to each")
    prior = np.zeros((0, count)) if prior_jacobian is None else prior_jacobian
    size = np.sqrt((jacobian**2).sum(0) + (prior**2).sum(0))
    jacobian, prior = jacobian / size, prior / size
    root = _root(np.vstack([jacobian, prior]))
    bread = root @ root.T
    influence = jacobian @ bread  # of a row on the estimate
    absorbed = taken + float((influence * jacobian).sum())  # parameters' worth of residual that the fit took away
    if rows - absorbed < 0.5:
        raise InputError("residuals", "must outnumber the free parameters", rows, f"give more than {count} rows")
    if float(residuals @ residuals) < _ZERO:
        residuals = np.zeros(rows)
    variance = float(residuals @ residuals) / (rows - absorbed)
    from_data = variance * (influence.T @ influence)
    from_prior = bread @ prior.T @ prior @ bread
    inflation, time = np.ones(count), 1.0
    white = np.diag(from_data).copy()
    told = white > NEGLIGIBLE * (white + np.diag(from_prior))  # else the prior says it all, and the rest is rounding
    if told.any():
        grid = _Grid(layout, residuals)
        one_kind = np.zeros_like(grid.kinds)
        spectral, time = _spectral(grid, jacobian, root, one_kind)
        robust = _newey_west(grid, influence) * rows / (rows - absorbed)
        wider = np.maximum(np.diag(spectral), robust)
        if grid.kinds.any():
            wider = np.maximum(wider, np.diag(_spectral(grid, jacobian, root, grid.kinds)[0]))
        inflation[told] = np.maximum(wider[told] / white[told], 1.0)
        if np.all(np.diag(spectral)[told] > 1e-6 * white[told]):  # else its correlations mean nothing: one frame, say
            from_data = spectral
        stretch = np.ones(count)
        stretch[told] = np.sqrt(inflation[told] * white[told] / np.diag(from_data)[told])
        from_data = from_data * np.outer(stretch, stretch)
    matrix = (from_data + from_prior) / np.outer(size, size)
    return Covariance(matrix, np.maximum((rows - absorbed) / inflation, 1.0), inflation, variance, time)


def autocorrelation(residuals: Array, layout: Layout, lags: int = _MAX_ORDER) -> Array:
    """(lags,) correlation of residuals with those of the same series 1, 2, ... frames later, over all series."""
    if not residuals.any():
        return np.zeros(0)
    grid = _Grid(layout, residuals)
    sums = grid.lags((np.abs(grid.transform(grid.residuals)) ** 2).sum(1), min(lags, grid.frames // 2))
    return np.asarray(sums[1:] / sums[0])


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


class _Grid:
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
        """Per recording (frames, p): what each frame adds to the estimate, summed over channels."""
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
        size = np.sqrt(np.maximum(pooled, _ZERO))[kinds]
        return np.asarray(matrix / np.outer(size, size))


def _root(rows: Array) -> Array:
    """(p, p) W with W W' = (rows' rows)^-1, from the triangle of rows = Q R: the product rows' rows would lose half the
    digits, and its inverse may have negative eigenvalues."""
    return np.linalg.solve(np.linalg.qr(rows, mode="r"), np.eye(rows.shape[1]))


def _spectral(grid: _Grid, jacobian: Array, root: Array, kinds: Integers) -> tuple[Array, float]:
    """B J' Omega J B with B = root root', Omega = C (x) rho with one rho for each kind of channel, (channels,), and the
    autocorrelation time of the first rho in frames."""
    parts = grid.parts(jacobian @ root, kinds)  # H = Q Q' takes Omega to cov(residuals)
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
        inner = np.zeros_like(root)
        for part, a in zip(parts, spread, strict=True):
            inner += np.tensordot(part.columns, a, ([0, 2], [0, 2]))
        if step < _CORRECTIONS:
            expected = _expected_lags(grid, spectra, pairs, parts, spread, inner)
            spectra = [
                spectrum * first / spectrum_of(*levinson(lags / count)[order], grid.length)
                for spectrum, first, lags, count, order in zip(spectra, observed, expected, rows, orders, strict=True)
            ]
    time = max(float(spectra[0][0] / np.fft.irfft(spectra[0], grid.length)[0]), 1.0)
    return root @ (inner + inner.T) @ root.T / 2, time


def _expected_lags(
    grid: _Grid,
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


def _newey_west(grid: _Grid, influence: Array) -> Array:
    """(p,) variances by Bartlett-weighted lagged products, with the lag of Newey and West (1994)."""
    scores = grid.scores(influence)
    frames = sum(len(part) for part in scores)
    longest = max(len(part) for part in scores) - 1
    pilot = min(int(4 * (frames / 100) ** (2 / 9)), longest)

    def product(lag: int) -> Array:
        parts = [(part[: max(len(part) - lag, 0)] * part[lag:]).sum(0) for part in scores]
        return np.asarray(np.sum(parts, axis=0))

    lagged = [product(lag) for lag in range(pilot + 1)]
    level = np.abs(lagged[0] + 2 * sum(lagged[1:]))
    slope = 2 * sum(lag * lagged[lag] for lag in range(1, pilot + 1)) if pilot else np.zeros_like(level)
    level = np.maximum(level, 1e-12 * lagged[0])
    bend = np.divide(slope, level, out=np.zeros_like(slope), where=level > 0)  # zero: no residual where it acts
    bandwidth = 1.1447 * (bend**2 * frames) ** (1 / 3)
    lags = np.minimum(bandwidth.astype(int), longest // 4)
    total = lagged[0].copy()
    for lag in range(1, int(lags.max()) + 1):
        total += 2 * np.maximum(1 - lag / (lags + 1), 0.0) * product(lag)
    return np.maximum(total, 0.0)
