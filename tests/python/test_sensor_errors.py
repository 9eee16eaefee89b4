"""Errors of force sensors: what each changes of residuals, and what becomes of fits to sensors that are off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
import test_forces_fit as shaken
from sheetbend.doubts.given import premises
from sheetbend.doubts.sensor_errors import SensorError, sensor_errors
from sheetbend.doubts.told import told_numbers
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

SIGMA = 0.005  # N; torques 0.002 N m
SAMPLES = np.arange(2, 120) * 0.01
LITTLE = 1e-4  # of an error


def readings(times: np.ndarray = SAMPLES) -> sb.ForceRecording:
    return sb.simulate_forces(shaken.rod(), times, ("rod", "start"), shaken.SOLVER, start="equilibrium")


@pytest.fixture(scope="module")
def exact() -> tuple[np.ndarray, np.ndarray, sb.ForceRecording]:
    """Frames, places and readings without noise."""
    scene, frames = shaken.rod(), np.arange(0, 37) * 5 * shaken.SOLVER.h
    start = sb.equilibrium(scene).nodes
    x = sb.simulate(scene, frames, shaken.SOLVER, start=start).positions
    return frames, x[:, scene.ropes["rod"].particles[list(shaken.MARKS)]], readings()


def watched(exact, recording: sb.ForceRecording, noise: float = 0.0, **sensor) -> sb.Experiment:
    frames, places, _ = exact
    rng, scene = np.random.default_rng(0), shaken.rod()
    seen = sb.Recording(places + noise * shaken.NOISE * rng.standard_normal(places.shape), frames)
    told = replace(recording, forces=recording.forces + noise * SIGMA * rng.standard_normal(recording.forces.shape))
    wrist = sb.ForceSensor(recording=told, at=("rod", "start"), sigma=SIGMA, name="wrist", **sensor)
    wrist.declare(scene)
    nodes = scene.ropes["rod"].particles[list(shaken.MARKS)]
    return sb.Experiment(
        scene=scene,
        recording=seen,
        name="shaken",
        markers=[sb.on_particle(int(p)) for p in nodes],
        solver=shaken.SOLVER,
        start="equilibrium",
        sigma=shaken.NOISE,
        forces=[wrist],
    )


def asked(e: sb.Experiment) -> tuple[FitProblem, np.ndarray, dict[str, SensorError]]:
    problem = FitProblem([e], as_parameters(["rod_EI"], [e]))
    u = problem.parameters.initial()
    return problem, u, {error.label: error for error in sensor_errors(problem, u, 0)}


def residuals(e: sb.Experiment) -> np.ndarray:
    problem = FitProblem([e], as_parameters(["rod_EI"], [e]))
    return problem.evaluate(problem.parameters.initial(), jacobian=False)[1]


def off(recording: sb.ForceRecording, label: str) -> sb.ForceRecording:
    """A recording with a little of an error."""
    forces, torques, turn = recording.forces, recording.torques, np.eye(3)
    assert torques is not None
    axis = turn["xyz".index(label[-1])] if label[-2:-1] == " " else np.zeros(3)
    if label == "size of wrist":
        return replace(recording, forces=(1 + LITTLE) * forces, torques=(1 + LITTLE) * torques)
    if label.startswith("wrist about"):  # a vector in axes that are turned turns back
        turned = (each - LITTLE * np.cross(axis, each) for each in (forces, torques))
        return replace(recording, **dict(zip(("forces", "torques"), turned, strict=True)))
    kind = label.partition(" ")[0] + "s"
    return replace(recording, **{kind: getattr(recording, kind) + LITTLE * axis})


LABELS = (
    "size of wrist",
    *(f"wrist about {axis}" for axis in "xyz"),
    *(f"{kind} zero of wrist along {axis}" for kind in ("force", "torque") for axis in "xyz"),
)


def test_each_error_moves_residuals_as_readings_with_a_little_of_it(exact) -> None:
    told = {"torque_sigma": 0.002}
    e = watched(exact, exact[2], **told)
    r, (_, _, errors) = residuals(e), asked(e)
    assert set(errors) == {*LABELS, "clock of wrist"}
    for label in LABELS:
        change = residuals(watched(exact, off(exact[2], label), **told)) - r
        assert np.allclose(change, -LITTLE * errors[label].column, atol=1e-6 * np.abs(change).max()), label


def test_a_sensor_whose_clock_is_late_reads_what_was_a_little_ago(exact) -> None:
    """By central differences over samples that are 10 ms apart, as the column has them."""
    moved = [readings(SAMPLES[1:-1] + lag) for lag in (-1e-2, 1e-2)]
    plain = replace(readings(SAMPLES[1:-1]), times=SAMPLES[1:-1])
    _, _, errors = asked(watched(exact, plain, torque_sigma=0.002))
    r = [
        residuals(watched(exact, replace(plain, forces=m.forces, torques=m.torques), torque_sigma=0.002)) for m in moved
    ]
    ends = slice(-6 * len(plain.times) + 6, -6)  # six rows for each sample, of which the outer ones have one neighbor
    change, expected = (r[0] - r[1])[ends], -2e-2 * errors["clock of wrist"].column[ends]
    assert (np.abs(expected.reshape(-1, 2, 3)).max(axis=(0, 2)) > 1.0).all()  # forces and torques
    assert np.allclose(change, expected, atol=1e-6 * np.abs(change).max())


def test_what_a_sensor_has_a_number_for_is_not_told(exact) -> None:
    _, _, errors = asked(watched(exact, exact[2], bias=True, axes="xz", time_offset=True))
    assert set(errors) == {"size of wrist", *(f"wrist about {axis}" for axis in "xyz")}
    _, _, errors = asked(watched(exact, exact[2], axes="z"))
    assert "force zero of wrist along z" in errors and "force zero of wrist along x" not in errors


def test_the_zero_of_each_sensor_has_its_own_step(exact) -> None:
    e = watched(exact, replace(exact[2], torques=None))
    coarse = replace(e.forces[0], name="cell", sigma=100 * SIGMA)
    both = replace(e, forces=[*e.forces, coarse])
    problem = FitProblem([both], as_parameters(["rod_EI"], [both]))
    u = problem.parameters.initial()
    steps = {one.name: one.off_by for one in premises(problem, u, {}, told_numbers(problem, u)[0])}
    assert steps["force zero of wrist along x"] == pytest.approx(SIGMA)
    assert steps["force zero of cell along x"] == pytest.approx(100 * SIGMA)


def fitted(exact, change) -> sb.FitResult:
    e = watched(exact, change(replace(exact[2], torques=None)), noise=1.0)
    return sb.fit(e, parameters=shaken.PARAMETERS, refine=False, profiles=False, beginnings=False).result


def test_a_gain_that_is_off_is_what_density_and_stiffness_rest_on(exact) -> None:
    """They were "identified" 15 half-widths off (3 %), 4 in all, and nothing told of the sensor."""
    result = fitted(exact, lambda readings: replace(readings, forces=1.03 * readings.forces))
    for name, truth in shaken.TRUTH.items():
        estimate = result[name]
        assert estimate.verdict == "identified" and estimate.value == pytest.approx(1.03 * truth, rel=0.005)
        assert "if the error in size of wrist is below 0.2" in estimate.words or "below 0.1" in estimate.words
        assert estimate.in_all is not None and abs(estimate.value - truth) < 2.5 * estimate.in_all


def test_a_zero_that_is_off_is_named_with_its_size(exact) -> None:
    """Density was "identified" 2.3 half-widths off."""
    result = fitted(exact, lambda readings: replace(readings, forces=readings.forces + np.array([0.0, 0.0, 0.02])))
    density = result["rod_density"]
    assert density.verdict == "doubtful" and "as if wrist read 0.021 N too much along z (its zero)" in density.words
    assert "With that it would be 0.1199" in density.words


def test_readings_that_are_late_are_named_with_their_delay(exact) -> None:
    late = readings(SAMPLES - 0.01).forces
    result = fitted(exact, lambda own: replace(own, forces=late))
    assert any("as if wrist read 9.8 ms too late (its clock)" in words for words in result.warnings)


def test_noise_is_no_gain(exact) -> None:
    """Of measured readings instead of simulated ones it would be: readings of nothing have none."""
    e = watched(exact, replace(exact[2], torques=None), noise=1.0)
    problem = FitProblem([e], as_parameters(["rod_EI"], [e]))
    u = problem.parameters.initial()
    _, r, _ = problem.evaluate(u, jacobian=False)
    (size,) = (one.column for one in told_numbers(problem, u)[0] if one.name == "force_size")
    assert abs(size @ r) < 4.0 * np.linalg.norm(size)
