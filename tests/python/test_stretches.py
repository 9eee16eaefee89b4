"""What errors as slow as a beginning is long move in it."""

from __future__ import annotations

import numpy as np
import pytest
from pytest import approx
from sheetbend.statistics.covariance import covariance
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.stretches import scatter, within_sigma

FRAMES, FIRST = 600, 67
Array = np.ndarray


def layout(frames: int, recordings: int = 1, start: int = 0) -> Layout:
    of = np.repeat(np.arange(recordings), frames)
    return Layout(of, np.zeros_like(of), np.tile(np.arange(start, start + frames), recordings))


def errors(rho: float, rng: np.random.Generator, frames: int = FRAMES) -> Array:
    e = rng.standard_normal(frames + 500)
    for k in range(1, len(e)):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return np.asarray(e[500:])


@pytest.mark.parametrize("rho", [0.0, 0.98])
def test_the_scatter_is_that_of_estimates_from_the_beginning(rho: float) -> None:
    """Slow errors vanish in the beginning's own residuals: its own covariance is far too small for them."""
    t, rng = np.arange(FIRST) / FRAMES, np.random.default_rng(0)
    J = np.column_stack([np.ones(FIRST), t, np.sin(40 * t)])
    found, told, own = [], [], []
    for _ in range(60):
        e = errors(rho, rng)
        step, *_ = np.linalg.lstsq(J, -e[:FIRST], rcond=None)
        found.append(step**2)
        told.append(np.diag(scatter(e, layout(FRAMES), layout(FIRST), J)))
        own.append(np.diag(covariance(e[:FIRST] + J @ step, J, layout(FIRST)).matrix))
    ratio = np.mean(found, axis=0) / np.mean(told, axis=0)
    assert ((ratio > 0.5) & (ratio < 2.0)).all()
    if rho > 0.9:
        assert (np.mean(found, axis=0) > 2.0 * np.mean(own, axis=0)).all()


def test_recordings_of_unlike_lengths_and_gaps_have_stretches_alike() -> None:
    """A constant error is the same everywhere, whatever the frames that are missing; priors hold it back."""
    of = np.repeat([0, 1], [90, 30])
    frame = np.concatenate([np.arange(5, 95), np.arange(30)])
    keep = np.delete(np.arange(120), [50, 100])
    whole = Layout(of[keep], np.zeros(118, int), frame[keep])
    early = (frame < 35) & (of == 0) | (frame < 10) & (of == 1)
    part = Layout(of[early], np.zeros(40, int), frame[early])
    J = np.vstack([np.ones((40, 1)), [[np.sqrt(40.0)]]])
    full = Layout(of, np.zeros(120, int), frame)
    assert scatter(np.ones(120), full, part, J)[0, 0] == approx(0.25)
    assert 0.2 < scatter(np.ones(118), whole, part, J)[0, 0] < 0.25


def test_sigma_allows_for_slow_errors_beside_white_noise_only_within_its_size() -> None:
    white, every = np.random.default_rng(0).standard_normal(4000), layout(4000)
    slow = np.sqrt(2.0) * np.sin(np.arange(4000) / 50)
    assert np.array_equal(within_sigma(0.9 * slow, every), 0.9 * slow)
    assert np.mean(within_sigma(5.0 * slow, every) ** 2) == approx(1.0, rel=0.05)
    assert np.mean(within_sigma(5.0 * slow + 1.1 * white, every) ** 2) == 0.0  # noise takes all of sigma
    both = within_sigma(5.0 * slow + 0.6 * white, every)
    assert np.corrcoef(both, slow)[0, 1] > 0.9 and np.mean(both**2) == approx(0.64, rel=0.1)
    two = within_sigma(np.concatenate([0.9 * slow, 5.0 * slow]), layout(4000, 2))
    assert np.array_equal(two[:4000], 0.9 * slow) and np.mean(two[4000:] ** 2) == approx(1.0, rel=0.05)
