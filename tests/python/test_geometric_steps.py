"""Searches whose steps go on by one factor."""

from __future__ import annotations

import numpy as np
import pytest
from pytest import approx
from sheetbend.minimum.geometric import GeometricSteps


@pytest.mark.parametrize("factor", [-0.75, 0.6])
def test_a_geometric_series_has_its_sum(factor: float) -> None:
    """Four points tell it, whatever the scales of their coordinates are; one that does not move stays."""
    end, first = np.array([1.0, -2e3, 5e-6, 7.0]), np.array([0.1, 30.0, -2e-7, 0.0])
    steps = GeometricSteps()
    points = [end + first * factor**k for k in range(4)]
    assert [steps.add(point) for point in points] == [False, False, False, True]
    assert steps.sum == approx(end, rel=1e-12)


def test_of_one_that_fades_the_last_three_steps_count() -> None:
    """As in a search: the fast parts of its steps are gone after some, and what is left goes on by one factor."""
    steps = GeometricSteps()
    slow, fast = np.array([1.0, 0.5]), np.array([0.3, -1.0])
    found = [steps.add(slow * (-0.8) ** k + fast * 0.1**k) for k in range(6)]
    assert found[:3] == [False, False, False] and found[-1]
    assert np.linalg.norm(steps.sum) < 0.1 * np.linalg.norm(slow * 0.8**5)


@pytest.mark.parametrize(
    "factors",
    [[0.1, 0.1, 0.1], [-0.75, 0.75, -0.75], [0.97, 0.97, 0.97], [-1.5, -1.5, -1.5]],
    ids=["fast", "of changing sign", "slow", "growing"],
)
def test_other_steps_have_none(factors: list[float]) -> None:
    steps, point, step = GeometricSteps(), np.zeros(2), np.array([1.0, 2.0])
    for factor in factors:
        assert not steps.add(point)
        point, step = point + step, factor * step
    assert not steps.add(point) and steps.sum is None


def test_a_point_that_stays_has_none() -> None:
    steps = GeometricSteps()
    assert not any(steps.add(np.ones(3)) for _ in range(5))
