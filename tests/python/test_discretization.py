"""What refits on a finer discretization add to an interval."""

from __future__ import annotations

import numpy as np
import pytest
from pytest import approx
from sheetbend.discretization import to_the_limit
from sheetbend.identifiability import identify
from sheetbend.parameters import Parameter, Parameters
from sheetbend.result import Refit


def test_moves_are_carried_to_the_limit_and_summed_as_squares():
    parameters = Parameters([Parameter(name="p", initial=1.0), Parameter(name="q", initial=1.0, log=True)])
    refits = [
        Refit(name="half the step", to_limit=2.0, moved={"p": -0.3, "q": 0.1}),
        Refit(name="finer mesh", to_limit=4 / 3, moved={"p": 0.6, "q": -0.2}),
    ]
    sizes = to_the_limit(refits, parameters, {"p": 1.0, "q": 1.0})
    assert sizes["p"] == approx(np.hypot(0.6, 0.8))
    assert sizes["q"] == approx(np.expm1(np.hypot(2 * np.log(1.1), 4 / 3 * np.log(0.8))))


@pytest.mark.parametrize("moved", [-2.0, -2.0 + 1e-15, 1e300, np.inf], ids=["to zero", "nearly", "far up", "away"])
def test_a_refinement_that_leads_anywhere_leaves_a_factor_of_a_million(moved: float):
    parameters = Parameters([Parameter(name="p", initial=1.0, log=True)])
    refits = [Refit(name="finer", to_limit=4 / 3, moved={"p": moved})]
    assert to_the_limit(refits, parameters, {"p": 2.0})["p"] == approx(2e6, rel=1e-5)


def test_a_log_interval_reaches_where_a_refinement_leads():
    """Down to 0.4 of the value, and by the same factor up."""
    parameters = Parameters([Parameter(name="p", initial=1.0, log=True)])
    size = to_the_limit([Refit(name="finer", to_limit=1.0, moved={"p": -0.6})], parameters, {"p": 1.0})
    assert size["p"] == approx(1.5)
    rng = np.random.default_rng(0)
    data = (np.zeros(1), 1e-4 * rng.standard_normal(400), np.full((400, 1), 5.0))
    (moved,) = identify(parameters, *data, discretization=size).estimates
    assert (moved.lower, moved.upper) == approx((0.4, 2.5), rel=1e-3)
    assert moved.lower < 0.4
    assert moved.upper > 2.5
