"""Intervals of the stiffness of clusters: that they count the size and the length that were found for the prior."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import optimize, stats
from sheetbend.minimum.field_fits import half_widths, spread
from sheetbend.minimum.field_priors import LENGTHS, SIZES, Picture
from sheetbend.objects.stiffness_field import StiffnessField, modes_of
from sheetbend.problem.smooth import Field, Smooth

N = 5


def chain() -> StiffnessField:
    """Five clusters in a row with two modes."""
    centers = np.column_stack([0.01 * np.arange(N), np.zeros((N, 2))])
    values, shapes = modes_of(centers, np.column_stack([np.arange(N - 1), np.arange(1, N)]))
    return StiffnessField("E", ("E_1", "E_2"), values, shapes[:, 1:3], centers, np.zeros((N, N - 3)))


def linear(wanted: Smooth, informative: float = 1.0) -> tuple[Picture, Field, np.ndarray, np.ndarray]:
    """A linear problem at its minimum under the most likely prior, with the Jacobian and the residuals there.

    The parameters are both modes and ln E of the mean stiffness.
    """
    rng = np.random.default_rng(4)
    J = informative * np.array([1.0, 0.5, 2.0]) * rng.standard_normal((12, 3))
    data = J @ np.array([0.9, -0.7, 0.2]) + rng.standard_normal(12)
    field = Field(chain(), wanted, wanted.size or 0.5, wanted.length or 0.02)
    columns = (np.arange(2),)
    picture = Picture(np.linalg.qr(np.column_stack([J, -data]), mode="r"), columns, np.zeros(3))
    field = picture.likeliest([field], 0)
    u, _ = picture.solved([field])
    r = J @ u - data
    return Picture(np.linalg.qr(np.column_stack([J, r]), mode="r"), columns, u), field, J, r


def test_half_widths_of_a_mixture_over_variances_are_those_of_student() -> None:
    """Normal distributions whose variance is inverse gamma make Student's distribution."""
    degrees = 5.0
    logs = np.linspace(-6.0, 10.0, 4001)
    weights = stats.invgamma.pdf(np.exp(logs), degrees / 2, scale=degrees / 2) * np.exp(logs)
    found = half_widths(weights / weights.sum(), np.zeros((len(logs), 1)), np.exp(0.5 * logs)[:, None])
    assert found[0] == pytest.approx(stats.t.ppf(0.975, degrees), rel=1e-6)


def test_half_widths_hold_95_percent_about_zero() -> None:
    shifts, sd = np.array([[0.3, 0.0], [-0.5, 0.0]]), np.array([[0.1, 2.0], [0.2, 2.0]])
    weights = np.array([0.7, 0.3])
    found = half_widths(weights, shifts, sd)
    held = weights @ (stats.norm.cdf(found, shifts, sd) - stats.norm.cdf(-found, shifts, sd))
    assert held == pytest.approx([0.95, 0.95], abs=1e-9)
    assert found[1] == pytest.approx(2.0 * stats.norm.ppf(0.975))


def test_a_prior_that_is_given_is_exact() -> None:
    picture, field, J, _ = linear(Smooth(size=0.4, length=0.015))
    weight = np.zeros(3)
    weight[:2] = 1.0 / field.modes.deviations(0.4, 0.015)
    covariance = np.linalg.inv(J.T @ J + np.diag(weight**2))
    about = field.modes.shapes
    whole = np.column_stack([about, np.ones(N)])
    half, left, of_modes = spread(picture, [field], 0, 2)
    assert half == pytest.approx(stats.norm.ppf(0.975) * np.sqrt(np.diag(whole @ covariance @ whole.T)))
    prior = np.sum((about / weight[:2]) ** 2, axis=1)
    assert left == pytest.approx(np.diag(about @ covariance[:2, :2] @ about.T) / prior)
    assert of_modes == pytest.approx(np.diag(covariance)[:2] * weight[:2] ** 2)


def test_intervals_of_size_and_length_are_those_of_exact_profiles() -> None:
    """Of 40 known modes: the best size at a length has a closed form, and a larger size goes with a longer length."""
    n, truth = 41, (0.3, 0.03)
    centers = np.column_stack([0.01 * np.arange(n), np.zeros((n, 2))])
    values, shapes = modes_of(centers, np.column_stack([np.arange(n - 1), np.arange(1, n)]))
    modes = StiffnessField("E", tuple(f"E_{k}" for k in range(1, n)), values, shapes[:, 1:], centers, np.zeros((n, 0)))
    q = modes.deviations(*truth) * np.random.default_rng(4).standard_normal(n - 1)
    picture = Picture(np.column_stack([np.eye(n - 1) / 1e-7, np.zeros(n - 1)]), (np.arange(n - 1),), q)
    found = picture.bounded([picture.likeliest([Field(modes, Smooth(), *truth)], 0)], 0)

    def height(size: float, length: float) -> float:
        d = modes.deviations(size, length)
        return float(np.sum(np.log(d**2) + (q / d) ** 2))

    def over_sizes(length: float) -> float:
        return height(math.sqrt(np.mean((q / modes.deviations(1.0, length)) ** 2)), length)

    def over_lengths(size: float) -> float:
        return float(optimize.minimize_scalar(lambda t: height(size, math.exp(t)), bounds=(-5.0, 2.0)).fun)

    best = optimize.minimize_scalar(lambda t: over_sizes(math.exp(t)), bounds=(-5.0, 2.0))
    for value, ends, profile in (
        (found.size, found.size_ends, over_lengths),
        (found.length, found.length_ends, over_sizes),
    ):
        for end, sign in zip(ends, (-1.0, 1.0), strict=True):
            exact = optimize.brentq(
                lambda t, profile=profile: profile(math.exp(t)) - best.fun - 3.841,
                math.log(value),
                math.log(value) + 2 * sign,
            )
            assert end is not None and abs(math.log(end) - exact) < 0.03 * abs(math.log(value) - exact), (end, exact)


def test_a_prior_that_was_found_is_integrated_out() -> None:
    """Against draws of size, length and modes from their priors, weighted by the likelihood of the data."""
    picture, field, J, r = linear(Smooth())
    half, _, _ = spread(picture, [field], 0, None)
    exact, _, _ = spread(
        picture, [Field(field.modes, Smooth(field.size, field.length), field.size, field.length)], 0, None
    )
    n = 400_000
    rng = np.random.default_rng(7)
    modes = field.modes
    size = np.exp(rng.uniform(*np.log(SIZES), n))
    wave = 1.0 / math.sqrt(modes.eigenvalues[-1])
    length = np.exp(rng.uniform(math.log(LENGTHS[0] * wave), math.log(LENGTHS[1] * modes.extent), n))
    falls = 1.0 / (1.0 + length[:, None] ** 2 * modes.eigenvalues[1:])
    deviations = size[:, None] * falls[:, :2] / np.linalg.norm(falls, axis=1)[:, None]
    q = deviations * rng.standard_normal((n, 2))
    # The mean stiffness has no prior and is integrated out: what its column explains of the residuals is taken out.
    outside = np.eye(len(J)) - np.outer(J[:, 2], J[:, 2]) / (J[:, 2] @ J[:, 2])
    off = (outside @ r) + (q - picture.u[:2]) @ (outside @ J[:, :2]).T
    weights = np.exp(-0.5 * (np.sum(off**2, axis=1) - np.sum(off**2, axis=1).min()))
    assert weights.sum() ** 2 / np.sum(weights**2) > 5000  # draws that count
    distances = np.abs((q - picture.u[:2]) @ modes.shapes.T)
    for c in range(N):
        order = np.argsort(distances[:, c])
        share = np.cumsum(weights[order]) / weights.sum()
        assert half[c] == pytest.approx(distances[order, c][np.searchsorted(share, 0.95)], rel=0.03)
    assert np.max(half / exact) > 1.1


def test_heights_are_those_of_the_marginal_likelihood() -> None:
    """Of residuals with the covariance 1 + A D^2 A', the mean stiffness integrated out."""
    picture, field, J, r = linear(Smooth())
    size, length = np.log([0.1, 0.5, 3.0]), np.log([0.005, 0.02, 0.3])
    found = picture.heights([field], 0, size, length)
    direct = np.zeros((3, 3))
    for row, s in enumerate(size):
        for column, t in enumerate(length):
            weight = np.append(1.0 / field.at(s, t).deviations, 0.0)
            J_all, r_all = np.vstack([J, np.diag(weight)]), np.append(r, weight * picture.u)
            left = r_all - J_all @ np.linalg.lstsq(J_all, r_all, rcond=None)[0]
            logs = np.linalg.slogdet(J_all.T @ J_all)[1] - 2.0 * np.log(weight[:2]).sum()
            direct[row, column] = left @ left + logs
    assert found - found[0, 0] == pytest.approx(direct - direct[0, 0], abs=1e-9)


def test_data_that_tell_nothing_leave_all_of_the_prior() -> None:
    picture, field, _, _ = linear(Smooth(), informative=1e-7)
    _, left, of_modes = spread(picture, [field], 0, 2)
    assert left == pytest.approx(np.ones(N), abs=1e-6) and of_modes == pytest.approx([1.0, 1.0], abs=1e-6)
