"""The shipped pendulum recordings: predictions of unseen motion, and what the tool says motion alone cannot tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study
from sheetbend.gauge import null_space
from sheetbend.problem import FitProblem, as_parameters

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
AUTHORS_LENGTH = 0.1527591  # a + I/(m a), m


def study(name: str) -> Study:
    path = EXPERIMENTS / name / f"{name}.toml"
    return build(parse(path), path.parent)


@pytest.fixture(scope="module")
def single() -> sb.Fit:
    s = study("pendulum")
    return sb.fit(s.experiments, parameters=s.parameters, **s.options)


def test_unseen_pieces_of_5_s_are_predicted_from_their_first_samples(single: sb.Fit) -> None:
    pieces = [r for r in single.result.recordings if r.rows == 0]
    held = [e.held_out for e in study("pendulum").experiments if e.predict]
    assert len(pieces) == 6 and all(5.0 - (stop - start) < 0.11 for start, stop in held)
    assert all(r.unit == "rad" and r.held_out < 0.015 for r in pieces), [(r.name, r.held_out) for r in pieces]


def test_the_reported_angles_are_angles(single: sb.Fit) -> None:
    piece = next(c for c in single.comparisons if c.experiment.name == "from_20s")
    measured, simulated = (
        np.arctan2(x[piece.held_out, 0, 0], -x[piece.held_out, 0, 2])
        for x in (piece.recording.positions, piece.simulated)
    )
    assert next(r for r in single.result.recordings if r.name == "from_20s").held_out == pytest.approx(
        np.sqrt(np.mean((measured - simulated) ** 2)), rel=1e-3
    )


def test_only_the_ratio_of_friction_and_mass_is_known(single: sb.Fit) -> None:
    assert single["arm_length"].verdict == "identified"
    assert single["arm_length"].value == pytest.approx(AUTHORS_LENGTH, rel=5e-3)
    assert {single[f"arm_{q}"].verdict for q in ("mass", "hinge_viscosity")} == {"not identifiable"}
    (gauge,) = single.result.gauges
    assert "only the ratio arm_hinge_viscosity/arm_mass is known: " in gauge
    ratio = single.values["arm_hinge_viscosity"] / single.values["arm_mass"]
    value, half = (float(word) for word in gauge.rpartition(": ")[2].split(" +/- "))
    assert value == pytest.approx(ratio, rel=1e-3) and 0 < half < 0.02 * value
    assert "only the ratio arm_hinge_viscosity/arm_mass is known" in " ".join(single.report().split())


def test_double_pendulum_knows_ratios_only() -> None:
    s = study("double_pendulum")
    short = [replace(e, fit=(e.fit[0], e.fit[0] + 0.6)) for e in s.experiments if e.predict is None]
    private = {name: given for name, given in s.parameters.items() if given.get("private")}
    body = [f"{arm}_{q}" for arm in ("upper", "lower") for q in ("mass", "first_moment", "inertia", "hinge_viscosity")]
    problem = FitProblem(short, as_parameters(dict.fromkeys(body) | private, short))
    names = problem.parameters.free
    _, _, jacobian = problem.evaluate(problem.parameters.initial())
    space = null_space(jacobian, names, [problem.parameters[name].log for name in names])
    assert space.flat == ("upper_mass",) and len(space.gauges) == 2
    assert {member for gauge in space.gauges for member in gauge.members} == set(body) - {"upper_mass"}
    # What the configuration holds is enough to set the scale.
    fitted = FitProblem(short, as_parameters(s.parameters, short))
    _, _, jacobian = fitted.evaluate(fitted.parameters.initial())
    space = null_space(
        jacobian, fitted.parameters.free, [fitted.parameters[name].log for name in fitted.parameters.free]
    )
    assert not space.flat and not space.gauges


def test_double_pendulum_is_predicted_over_2_s() -> None:
    s = study("double_pendulum")
    chosen = [e for e in s.experiments if e.name in ("fitted_17s", "fitted_36s", "from_20s", "from_40s")]
    fixed = s.parameters | {"lower_hinge_viscosity": {"fixed": True, "initial": 1e-5}}
    found = sb.fit(chosen, parameters=fixed, threads=2)
    pieces = [r for r in found.result.recordings if r.rows == 0]
    assert [r.name for r in pieces] == ["from_20s", "from_40s"]
    assert all(r.held_out < 0.02 * r.baseline for r in pieces)
    for name, value in (
        ("upper_first_moment", 0.0101882),
        ("lower_first_moment", 0.0160683),
        ("lower_inertia", 0.00314527),
    ):
        assert found[name].value == pytest.approx(value, rel=0.02)
