"""What the covariance makes of correlated rows by transforms, against the same by matrices."""

from __future__ import annotations

import numpy as np
import pytest
from pytest import approx
from sheetbend.errors import InputError
from sheetbend.statistics.colored import Colored
from sheetbend.statistics.covariance import Sandwich, covariance
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.row_grid import RowGrid, _columns
from sheetbend.statistics.spectral import _expected_lags, _lagged


def uneven() -> tuple[Layout, np.random.Generator]:
    """Two recordings of 40 and 23 frames, the first with two kinds of channels and with gaps."""
    rng = np.random.default_rng(5)
    series = [(0, 0, 0, 40), (0, 1, 0, 40), (0, 2, 1, 40), (1, 0, 0, 23), (1, 1, 1, 23)]
    rows = [(r, c, f, k) for r, c, k, frames in series for f in range(frames) if rng.random() > 0.2 or f == frames - 1]
    recording, channel, frame, kind = np.array(rows).T
    return Layout(recording, channel, frame, kind), rng


def test_columns_are_told_apart_as_numpy_does_and_no_two_rows_share_a_place() -> None:
    layout, rng = uneven()
    places = rng.integers(-3, 4, (2, 500))
    own, which = _columns(places)
    wanted, index = np.unique(places, axis=1, return_inverse=True)
    assert (own == wanted).all() and (which == np.ravel(index)).all()
    with pytest.raises(InputError, match="two rows in one place"):
        layout.of(np.append(np.arange(len(layout.frame)), 7))


def test_the_covariance_of_rows_and_of_what_a_fit_leaves_of_them() -> None:
    layout, rng = uneven()
    rows, p, lags = len(layout.frame), 3, 6
    grid = RowGrid(layout, rng.standard_normal(rows))
    Q = np.linalg.qr(rng.standard_normal((rows, p)))[0]
    mixing = grid.channel_covariance(grid.kinds)
    spectra = [1.0 / np.abs(1 - a * np.exp(-2j * np.pi * np.fft.rfftfreq(grid.length))) ** 2 for a in (0.8, -0.3)]
    channel, frame, kind = grid._channel, grid._frame, grid.kinds[grid._channel]
    omega = np.zeros((rows, rows))
    for i in range(rows):
        for j in range(rows):
            shared = np.fft.irfft(np.sqrt(spectra[kind[i]] * spectra[kind[j]]), grid.length)
            omega[i, j] = mixing[channel[i], channel[j]] * shared[abs(frame[i] - frame[j])]
    parts = grid.parts(Q, grid.kinds)
    colored = Colored(parts, mixing, grid.length)
    for part in parts:
        colored(part, spectra[::-1])  # transforms are kept from here on
    spread = [colored(part, spectra) for part in parts]
    assert all(
        (Colored(parts, mixing, grid.length)(part, spectra) == a).all() for part, a in zip(parts, spread, strict=True)
    )
    found = sum(np.tensordot(part.columns, a, ([0, 2], [0, 2])) for part, a in zip(parts, spread, strict=True))
    assert found == approx(Q.T @ omega @ Q, rel=1e-10, abs=1e-10)
    pairs = [
        _lagged(grid.mask[:, grid.kinds == k] * np.diag(mixing)[grid.kinds == k], grid.mask[:, grid.kinds == k], lags)
        for k in (0, 1)
    ]
    expected = _expected_lags(grid, spectra, pairs, parts, spread, np.asarray(found))
    left = (np.eye(rows) - Q @ Q.T) @ omega @ (np.eye(rows) - Q @ Q.T)
    for k in (0, 1):
        for lag in range(lags):
            pair = (channel[:, None] == channel) & (kind[:, None] == k) & (frame[:, None] + lag == frame)
            assert expected[k][lag] == approx(float(left[pair].sum()), rel=1e-9, abs=1e-9)


def test_one_sandwich_tells_the_same_as_one_for_each_choice_of_coordinates() -> None:
    layout, rng = uneven()
    rows = len(layout.frame)
    J, priors = rng.standard_normal((rows, 4)) * [1.0, 30.0, 1e-3, 1.0], rng.standard_normal((2, 4))
    J[:, 3] += 0.999 * J[:, 0]
    spread = Sandwich(rng.standard_normal(rows), J, layout, priors, taken=1.5)
    turned = spread.Q.T @ np.vstack([J, priors])  # coordinates along Q, by parameter
    of_estimate, apart = spread.of_estimate(), spread.at_right_angles()
    own = covariance(spread._residuals, spread.Q[:rows], layout, spread.Q[rows:], taken=1.5)
    assert apart.matrix == approx(own.matrix, rel=1e-10, abs=1e-12)
    assert apart.inflation == approx(own.inflation, rel=1e-10)
    white = np.linalg.inv(turned.T @ turned)
    assert np.diag(of_estimate.matrix) == approx(
        of_estimate.inflation * np.diag(white @ J.T @ J @ white) * of_estimate.residual_variance
        + np.diag(white @ priors.T @ priors @ white),
        rel=1e-9,
    )
