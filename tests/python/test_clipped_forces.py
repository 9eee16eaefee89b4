"""A force sensor that adds its noise after the end of its range: named by what the other readings ask for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
import test_forces_fit as shaken
from sheetbend.doubts.clipped import clipped
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

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


def hung(density: float) -> sb.Scene:
    """A rod at rest between two grips."""
    scene, points = sb.Scene("hung"), np.array([[0.0, 0.0, 0.0], [0.25, 0.0, -0.14], [0.5, 0.0, 0.0]])
    EI, GJ = shaken.TRUTH["rod_EI"], shaken.RATIO * shaken.TRUTH["rod_EI"]
    grips = [sb.Grip.fixed([x, 0.0, 0.0], [1.0, 0.0, 0.0]) for x in (0.0, 0.5)]
    made = {"length": 0.6, "segments": 12, "points": points, "density": density, "EI": EI, "GJ": GJ}
    sb.add_rod(scene, "rod", **made, start=grips[0], end=grips[1], bend_damping=0.01, twist_damping=0.01)  # type: ignore[arg-type]
    return scene


def test_a_force_that_never_changes_shows_no_limit(twin) -> None:
    """A rod at rest whose density is told too small or too large; its sensor was said to end at what it reads."""
    true, start = hung(0.12), sb.equilibrium(hung(0.12)).nodes
    places = np.repeat(start[None, true.ropes["rod"].particles[list(shaken.MARKS)]], len(twin[0]), axis=0)
    forces = sb.simulate_forces(true, np.arange(2, 120) * 0.01, ("rod", "start"), shaken.SOLVER, start="equilibrium")
    for density in (0.1, 0.12, 0.16):
        e = shaken.experiment((twin[0], places, forces), 1, scene=hung(density))
        problem = FitProblem([e], as_parameters({"rod_EI": {"initial": 6e-3}}, [e]))
        assert clipped(problem, np.log([6e-3]), 0) == []


def test_without_forces_nothing_is_asked(twin) -> None:
    e = shaken.experiment(twin, 0, with_forces=False)
    problem = FitProblem([e], as_parameters(shaken.PARAMETERS, [e]))
    assert clipped(problem, problem.parameters.initial(), 0) == []
