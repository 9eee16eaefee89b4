"""Priors that the data contradict: of a density that is told wrong, they are the only trace."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sheetbend as sb

TIMES, SIGMA, AT = np.arange(76) / 50, 3e-4, [2, 4, 6, 8]


def rope(density: float) -> sb.Scene:
    return sb.rope(0.5, 8, density=density, EI=2e-3, bend_damping=0.01, clamp_start=(1, 0, 0))


def fitted(density: float, sd: float, **asked: Any) -> sb.FitResult:
    """Of a rope of 50 g/m that falls, with a prior about the true stiffness."""
    x = sb.simulate(rope(0.05), TIMES, sb.Solver(h=1 / 1600)).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    places, model = [sb.on_particle(i) for i in AT], rope(density)
    recording = sb.Recording(positions=x, times=TIMES, name="fall")
    e = sb.Experiment(scene=model, recording=recording, markers=places, solver=sb.Solver(h=1 / 400), sigma=SIGMA)
    wanted = {"rope_EI": {"prior": (2e-3, sd)}, "rope_bend_damping": {}}
    return sb.fit(e, parameters=wanted, profiles=False, beginnings=False, **asked).result


def test_a_prior_that_the_data_contradict_is_named() -> None:
    """The stiffness was 20 % too large, as the density, with residuals like noise and without a word."""
    found = fitted(0.06, 0.05)
    EI = found["rope_EI"]
    assert EI.value == pytest.approx(2.4e-3, rel=2e-3) and found.misfit.reduced_chi_square < 1.1
    (words,) = found.warnings
    assert words.startswith("the data alone give rope_EI = 0.002399") and "3.6 standard deviations" in words
    assert "contradicts its prior (0.002 N m^2, sd 5 %)" in words and EI.verdict == "identified"


def test_what_such_a_prior_moves_out_of_its_interval_is_doubtful() -> None:
    """The prior pulls the estimate off what the data ask for."""
    found = fitted(0.06, 2e-3)
    EI = found["rope_EI"]
    assert EI.verdict == "doubtful" and "the data alone give rope_EI = 0.002" in EI.words


def test_a_right_prior_and_one_that_the_data_hardly_narrow_are_not() -> None:
    assert not fitted(0.05, 0.05).warnings
    assert not fitted(0.055, 0.05).warnings  # 10 % off are two standard deviations


def test_a_given_value_that_may_be_as_wrong_is_no_contradiction() -> None:
    """The density is 9 % too large, and known to 4.8 %. With the prior's 5 % that makes 1.3 standard deviations."""
    assert not fitted(0.0545, 0.05, given={"rope_density": 0.048}).warnings
