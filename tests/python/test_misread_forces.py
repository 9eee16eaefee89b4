"""Forces of the opposite sign or in another unit: they are named, and nothing is said to be unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
import test_forces_fit as shaken
from sheetbend.doubts.misread_forces import _of, misread_forces
from sheetbend.doubts.prediction import Comparison
from sheetbend.doubts.unexplained import unexplained
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

Twin = tuple[np.ndarray, np.ndarray, sb.ForceRecording]


@pytest.fixture(scope="module")
def twin() -> Twin:
    scene, frames = shaken.rod(), np.arange(0, 37) * 5 * shaken.SOLVER.h
    times = np.arange(2, 120) * 0.01
    forces = sb.simulate_forces(scene, times, ("rod", "start"), shaken.SOLVER, start="equilibrium")
    start = sb.equilibrium(scene).nodes
    x = sb.simulate(scene, frames, shaken.SOLVER, start=start).positions
    return frames, x[:, scene.ropes["rod"].particles[list(shaken.MARKS)]], forces


def watched(twin: Twin, times: float = 1.0) -> sb.Experiment:
    """The shaken rod, with so many times the forces that act."""
    frames, places, forces = twin
    return shaken.experiment((frames, places, replace(forces, forces=times * forces.forces)), 0)


def said(e: sb.Experiment) -> tuple[str, ...]:
    problem = FitProblem([e], as_parameters(shaken.PARAMETERS, [e]))
    return misread_forces(problem, problem.parameters.initial())


def test_forces_on_the_other_side_are_named_and_nothing_is_unknown(twin: Twin) -> None:
    """Density and stiffness ran off to nothing, "not identifiable": "the data do not contain it"."""
    found = sb.fit(watched(twin, -1.0), parameters=shaken.PARAMETERS, **shaken.QUICK).result
    assert any("are -0.9" in w and 'reads = "body"' in w for w in found.warnings), found.warnings
    for name in shaken.TRUTH:
        assert found[name].verdict == "doubtful" and "of the forces of wrist" in found[name].words


@pytest.mark.parametrize("times", [101.97, 0.10197])
def test_forces_in_another_unit_are_named(twin: Twin, times: float) -> None:
    """In grams a density of 12 kg/m was "identified" for 0.12, 70 half-widths in all off."""
    (words,) = said(watched(twin, times))
    assert "times what the model reads at the values that the fit began with." in words
    assert words.endswith("Either it began far off, or they are not in N")


def test_right_forces_are_not(twin: Twin) -> None:
    """Nor are those of a start that is five times off, beside which a unit cannot be told."""
    assert said(watched(twin)) == said(watched(twin, 5.0)) == ()
    e = sb.rope(0.5, 8, density=0.05, EI=1e-3)
    recording = sb.Recording(positions=e.positions[None, 4:5] + np.zeros((3, 1, 1)), times=[0.0, 0.1, 0.2])
    alone = sb.Experiment(scene=e, recording=recording, markers=[sb.on_particle(4)], solver=sb.Solver(h=0.01))
    assert misread_forces(FitProblem([alone], as_parameters(["rope_EI"], [alone])), np.zeros(1)) == ()


def test_a_start_of_the_other_sign_is_none_where_the_fit_explains_the_forces(twin: Twin) -> None:
    """It was asked whether forces in N, -1 times those of the start, were in N."""
    (sensor,), x = watched(twin).forces, np.ones((9, 6))
    assert list(_of(sensor, x, -x, x)) == []
    assert [words for words in _of(sensor, x, -x, -x) if 'reads = "body"' in words]


def test_most_of_the_forces_must_be_left(twin: Twin) -> None:
    found = sb.fit(watched(twin), parameters=shaken.PARAMETERS, **shaken.QUICK)
    (c,) = found.comparisons
    problem = FitProblem([c.experiment], found.parameters)

    def doubts(part: float, sigma: float = shaken.FORCE_NOISE) -> dict[str, str]:
        """Where the model reads only a part of how the forces vary, and where so large an error of them is expected."""
        (one,) = c.forces
        mean = np.nanmean(one.simulated, axis=0)
        less = replace(one, simulated=mean + part * (one.simulated - mean))
        e = replace(c.experiment, forces=[replace(c.experiment.forces[0], sigma=sigma)])
        other: Comparison = replace(c, experiment=e, forces=(less,))
        return unexplained(problem, [other], 1.0)

    assert doubts(1.0) == doubts(0.5) == {}
    assert "of the forces of wrist" in doubts(0.1)["rod_EI"]
    assert doubts(0.1, sigma=2.0 * float(np.nanstd(c.forces[0].measured[:, :3]))) == {}
