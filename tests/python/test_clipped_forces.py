"""A force sensor that adds its noise after the end of its range: named by what the other readings ask for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
import test_forces_fit as shaken
from sheetbend.doubts.clipped import clipped
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.problem import FitProblem

twin = shaken.twin


def limited(twin, part: float, seed: int = 1) -> sb.Experiment:
    """The shaken rod; the sensor reads up to a part of the largest force, and noise comes on top."""
    frames, places, forces = twin
    most = part * np.abs(forces.forces).max()
    return shaken.experiment((frames, places, replace(forces, forces=np.clip(forces.forces, -most, most))), seed)


def test_readings_that_end_at_a_limit_make_their_fit_doubtful(twin) -> None:
    """Density was 16 % low, "identified" to 9 %, and no word."""
    found = sb.fit(limited(twin, 0.5), parameters=shaken.PARAMETERS, **shaken.QUICK).result
    assert any("wrist read forces of 0.4" in w and "at most" in w for w in found.warnings), found.warnings
    for name, truth in shaken.TRUTH.items():
        assert found[name].verdict == "doubtful" and "the end of its range" in found[name].words
        assert abs(found[name].value / truth - 1) > 0.1


@pytest.mark.parametrize("off", [1.0, 1.3])
def test_readings_within_the_range_end_at_no_limit(twin, off: float) -> None:
    """Neither at the true values nor where the model is too heavy by a third."""
    e = limited(twin, 1.0)
    problem = FitProblem([e], as_parameters(shaken.PARAMETERS, [e]))
    at = [off * shaken.TRUTH[name] for name in problem.parameters.free]
    assert clipped(problem, np.log(at), 0) == []


def test_without_forces_nothing_is_asked(twin) -> None:
    e = shaken.experiment(twin, 0, with_forces=False)
    problem = FitProblem([e], as_parameters(shaken.PARAMETERS, [e]))
    assert clipped(problem, problem.parameters.initial(), 0) == []
