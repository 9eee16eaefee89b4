"""Ends of likelihood intervals by a path of few evaluations, against full refits of nonlinear models."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.optimize import brentq, least_squares
from sheetbend.doubts.profiles import Profiles
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.optimizers import minimize, named
from sheetbend.minimum.profile_path import Linear, ProfilePath
from sheetbend.objects.markers import on_particle
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.profile import Wanted, profile_interval

T = np.linspace(0.0, 3.0, 60)
RISE = 2.0  # of the cost: a 95 % interval for residuals of unit variance
Residuals = Callable[[np.ndarray], np.ndarray]


@dataclass
class Model:
    """A least-squares problem with derivatives by complex step, and what was asked of it."""

    residuals: Residuals
    lower: np.ndarray
    upper: np.ndarray
    evaluations: int = 0
    jacobians: int = 0
    asked: list[np.ndarray] = field(default_factory=list)

    def jacobian(self, u: np.ndarray) -> np.ndarray:
        steps = u + 1e-30j * np.eye(len(u))
        return np.column_stack([self.residuals(step).imag / 1e-30 for step in steps])

    def __call__(self, u: np.ndarray, jacobian: bool) -> tuple[bool, np.ndarray, np.ndarray]:
        self.evaluations += 1
        self.jacobians += jacobian
        self.asked.append(u)
        r = self.residuals(u)
        return bool(np.isfinite(r).all()), r, self.jacobian(u) if jacobian else np.zeros((0, len(u)))

    def fitted(self, start: np.ndarray, held: int | None = None) -> np.ndarray:
        """The minimum, one parameter held at its start where asked."""
        free = np.arange(len(start)) != (-1 if held is None else held)

        def whole(some: np.ndarray) -> np.ndarray:
            u = np.array(start)
            u[free] = some
            return u

        found = least_squares(
            lambda some: self.residuals(whole(some)),
            np.clip(start[free], self.lower[free], self.upper[free]),
            jac=lambda some: self.jacobian(whole(some))[:, free],
            bounds=(self.lower[free], self.upper[free]),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        return whole(found.x)

    def path(self, u: np.ndarray, column: int, linear: float) -> ProfilePath:
        picture = Linear(u, self.residuals(u), self.jacobian(u))
        return ProfilePath(self, picture, column, linear, (self.lower, self.upper), np.ones(len(u)))

    def exact(self, u: np.ndarray, column: int, side: float, farthest: float) -> float:
        """The end by refits of all others at every value."""

        def height(t: float) -> float:
            there = self.fitted(np.where(np.arange(len(u)) == column, u + side * t, u), column)
            return float(0.5 * np.sum(self.residuals(there) ** 2) - 0.5 * np.sum(self.residuals(u) ** 2)) - RISE

        return side * brentq(height, 1e-6, farthest, rtol=1e-6)


def reach(J: np.ndarray, column: int) -> float:
    return math.sqrt(2 * RISE * np.linalg.pinv(J.T @ J, rcond=1e-10)[column, column])


def model(curve: Residuals, truth: np.ndarray, noise: float, lower: float = -np.inf, upper: float = np.inf) -> Model:
    error = noise * np.random.default_rng(1).standard_normal(len(T))
    measured = curve(truth) + error
    wide = np.full(len(truth), 1.0)
    return Model(lambda u: (curve(u) - measured) / noise, lower * wide, upper * wide)


def decay(u: np.ndarray) -> np.ndarray:
    """An amplitude and a rate in logarithms, and an offset: short against its time, so that they trade."""
    return np.exp(u[0]) * np.exp(-np.exp(u[1]) * T) + u[2]


def test_asymmetric_ends_are_those_of_refits_at_a_few_evaluations() -> None:
    """Half-widths of 0.2 to 0.8 in logarithms; the sides of the offset differ by a factor of more than two."""
    m = model(decay, np.array([0.0, -0.5, 0.2]), 0.09)
    u = m.fitted(np.array([0.0, -0.5, 0.2]))
    lopsided = []
    for column in range(3):
        first, before = reach(m.jacobian(u), column), m.evaluations
        ends = m.path(u, column, first).ends(first)
        exact = [m.exact(u, column, side, 8 * first) for side in (-1.0, 1.0)]
        half = 0.5 * (exact[1] - exact[0])
        assert ends == approx(exact, abs=0.02 * half)
        assert m.evaluations - before <= 12
        lopsided.append(-exact[0] / exact[1])
    assert max(lopsided) > 2.0


def test_ends_that_the_cost_confirms_take_two_evaluations_and_stay() -> None:
    m = model(decay, np.array([0.0, 0.3, 0.2]), 0.002)
    u = m.fitted(np.array([0.0, 0.3, 0.2]))
    first = reach(m.jacobian(u), 1)
    assert m.path(u, 1, first).ends(first) == (-first, first)
    assert (m.evaluations, m.jacobians) == (2, 0)
    assert np.ptp(np.array(m.asked)[:, 1]) == approx(2 * first)


@pytest.mark.parametrize("share", [0.5, 0.93, 0.99])
def test_an_end_beyond_the_limit_is_open(share: float) -> None:
    m = model(decay, np.array([0.0, -0.5, 0.2]), 0.09)
    u = m.fitted(np.array([0.0, -0.5, 0.2]))
    first = reach(m.jacobian(u), 1)
    exact, beyond = (m.exact(u, 1, side, 8 * first) for side in (-1.0, 1.0))
    m.upper[1] = u[1] + share * beyond
    lower, upper = m.path(u, 1, first).ends(first)
    assert upper == math.inf and lower == approx(exact, rel=0.04)
    assert max(at[1] for at in m.asked) <= m.upper[1]


def test_another_parameter_at_its_bound_leaves_it_where_that_lowers_the_cost() -> None:
    """The offset is held at zero, below which the data want it; along the rate it comes off on one side."""
    m = model(decay, np.array([0.0, -0.4, 0.02]), 0.05)
    m.lower[2] = 0.1
    u = m.fitted(np.array([0.0, -0.5, 0.3]))
    assert u[2] == approx(0.1, abs=1e-9)
    u[2] = 0.1
    J = m.jacobian(u)
    first = math.sqrt(2 * RISE * np.linalg.inv(J[:, :2].T @ J[:, :2])[1, 1])
    exact = [m.exact(u, 1, side, 8 * first) for side in (-1.0, 1.0)]
    ends = m.path(u, 1, first).ends(first)
    assert exact[1] > 1.3 * first  # with the offset held it would end near `first`
    assert ends == approx(exact, abs=0.04 * 0.5 * (exact[1] - exact[0]))
    assert min(at[2] for at in m.asked) >= 0.1


def test_a_direction_without_effect_does_not_run_off() -> None:
    """Amplitude and gain enter as their product; the rate's interval is as without one of them."""
    three = model(decay, np.array([0.0, -0.5, 0.2]), 0.06)
    u = three.fitted(np.array([0.0, -0.5, 0.2]))
    four = Model(
        lambda w: three.residuals(np.array([w[0] + w[3], w[1], w[2]])), np.full(4, -np.inf), np.full(4, np.inf)
    )
    first = reach(three.jacobian(u), 1)
    plain, beside = three.path(u, 1, first).ends(first), four.path(np.append(u, 0.0), 1, first).ends(first)
    assert beside == approx(plain, rel=0.01)
    assert max(abs(at[3]) for at in four.asked) < 1.0


def test_where_the_model_bends_away_the_jacobian_is_made_again() -> None:
    """Two numbers in a valley that is curved like a parabola; the end lies where J has turned by half."""
    m = Model(
        lambda u: np.array([u[0] / 1.5, 4.0 * (u[1] - u[0] ** 2), 0.3 * u[0] * u[1]]),
        np.full(2, -np.inf),
        np.full(2, np.inf),
    )
    u = np.zeros(2)
    first = reach(m.jacobian(u), 0)
    exact = [m.exact(u, 0, side, 4.0) for side in (-1.0, 1.0)]
    ends = m.path(u, 0, first).ends(first)
    assert 0 < m.jacobians <= 4
    assert ends == approx(exact, rel=0.05)


def test_a_cost_that_levels_off_is_left_to_refits() -> None:
    """It rises up to 1.62, however far one goes."""
    m = Model(lambda u: 1.8 * np.tanh(u), np.full(1, -np.inf), np.full(1, np.inf))
    lower, upper = m.path(np.zeros(1), 0, 2 / 1.8).ends(2 / 1.8)
    assert math.isnan(lower) and math.isnan(upper)


def test_a_point_without_an_answer_is_left_to_refits() -> None:
    m = Model(
        lambda u: np.where(np.abs(u[0]) > 0.1, np.nan, u[0]) * np.ones(3), np.full(1, -np.inf), np.full(1, np.inf)
    )
    lower, upper = m.path(np.zeros(1), 0, 1.0).ends(1.0)
    assert math.isnan(lower) and math.isnan(upper) and m.evaluations <= 4


def test_an_end_beyond_a_kink_is_left_to_refits() -> None:
    """Behind 1.5 there is a residual that the other number lowers, of which the Jacobian at the estimate shows
    nothing."""

    def residuals(u: np.ndarray) -> np.ndarray:
        beyond = np.where(np.real(u[0]) > 1.5, u[0] - 1.5, 0.0)
        return np.array([u[0], u[1], 0.5 * beyond * (1.0 - 6.0 * u[1])])

    m, u, wide = Model(residuals, np.full(2, -np.inf), np.full(2, np.inf)), np.zeros(2), np.full(2, np.inf)
    picture, first = Linear(u, residuals(u), m.jacobian(u)), reach(m.jacobian(u), 0)
    assert ProfilePath(m, picture, 0, first, (-wide, wide), np.ones(2)).ends(first) == (-2.0, 2.0)
    lower, upper = ProfilePath(m, picture, 0, first, (-wide, wide), np.ones(2), kinked=True).ends(first)
    assert lower == -2.0 and math.isnan(upper) and m.jacobians == 2


# --- of a motion


def falling() -> tuple[FitProblem, np.ndarray]:
    """A short rope of which few noisy markers are seen, at the minimum for its stiffness, damping and drag."""
    truth = {"rope_EI": 2e-3, "rope_bend_damping": 0.01, "rope_drag_linear": 0.02}
    scene = sb.Scene("fall")
    given = {name.removeprefix("rope_"): value for name, value in truth.items()}
    sb.add_rope(scene, "rope", length=0.5, segments=8, density=0.05, clamp_start=(1, 0, 0), **given)
    times, solver = np.arange(41) / 100, sb.Solver(h=2.5e-3)
    x = sb.simulate(scene, times, solver).positions[:, [4, 8]]
    noisy = x + 0.01 * np.random.default_rng(2).standard_normal(x.shape)
    e = sb.Experiment(
        scene=scene,
        recording=sb.Recording(noisy, times),
        markers=[on_particle(4), on_particle(8)],
        solver=solver,
        sigma=0.01,
        start_time=0.0,
    )
    problem = FitProblem([e], as_parameters(list(truth), [e]))
    end, _ = minimize(problem, problem.parameters.initial())
    return problem, end.u


def test_the_ends_of_a_ropes_profiles_are_those_of_refits() -> None:
    problem, u = falling()
    _, r, J = problem.evaluate(u)
    variance, spread = float(r @ r) / len(r), np.linalg.inv(J.T @ J)
    rise = 2.0 * variance
    sides = []
    for column, name in enumerate(problem.parameters.free):
        first = math.sqrt(4.0 * variance * spread[column, column])
        profiles = Profiles(problem, u, named("auto"), np.zeros(3))
        p = problem.parameters[name]
        found = profiles.profile(Wanted(name, first))
        path = [None if end is None else p.to_internal(end) - u[column] for end in found.ends]
        assert list(found.away) == sorted(found.away) and 7 <= len(found.away) <= 15
        assert min(found.rises) == found.rises[found.away.index(0.0)] == 0.0
        for end, last, at in zip(path, (0, -1), found.ends, strict=True):
            assert (found.rises[last] < 1.0) == (at is None)
            assert at is None or (found.away[last], found.rises[last]) == (approx(end), 1.0)
        ends = profile_interval(
            lambda value, name=name, profiles=profiles: profiles(name, value),
            p.to_physical(u[column]),
            rise,
            step=min(first, 1.0),
            log=p.log,
        )
        for at, end in zip(path, ends, strict=True):
            if at is None or end is None:
                assert at is end
                continue
            assert at == approx(p.to_internal(end) - u[column], rel=0.025)
            sides.append(name)
        assert not profiles.lower
    assert len(sides) >= 4


def test_only_the_wanted_side_is_searched() -> None:
    asked: list[float] = []

    def profile(value: float) -> float:
        asked.append(value)
        return value**2

    ends = profile_interval(profile, 0.0, 4.0, step=1.0, sides=(1.0,))
    assert ends[0] is None and ends[1] == pytest.approx(2.0, rel=5e-3)
    assert min(asked) >= 0.0
