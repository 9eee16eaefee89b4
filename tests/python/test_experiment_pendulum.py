"""The shipped pendulum recordings: predictions of unseen motion, and what the tool says motion alone cannot tell."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.gauge import null_space

pytestmark = pytest.mark.slow

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"
AUTHORS_LENGTH = 0.1527591  # a + I/(m a), m


def study(name: str) -> Study:
    path = EXPERIMENTS / name / f"{name}.toml"
    return build(parse(path), path.parent)


def edited(name: str, folder: Path, *edits: tuple[str, str]) -> Study:
    """The study with parts of its configuration exchanged."""
    text = (EXPERIMENTS / name / f"{name}.toml").read_text()
    for before, after in edits:
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    (folder / "edited.toml").write_text(text)
    return build(parse(folder / "edited.toml"), EXPERIMENTS / name)


def fitted(s: Study, **options: Any) -> sb.Fit:
    return sb.fit(s.experiments, parameters=s.parameters, **s.options | options)


@pytest.fixture(scope="module")
def single() -> sb.Fit:
    return fitted(study("pendulum"))


@pytest.fixture(scope="module")
def last_third(tmp_path_factory: pytest.TempPathFactory) -> sb.Fit:
    """The same fit to the last third of the recording; nothing is predicted."""
    windows = {
        "fit = [0.0, 3.0]": "fit = [24.6, 27.6]",
        "values = { arm_angle = 1.6, arm_rate = -2.1 }": "values = { arm_angle = -0.4, arm_rate = 5.4 }",
        "fit = [3.0, 6.0]": "fit = [27.6, 30.6]",
        "values = { arm_angle = -0.2, arm_rate = -10.7 }": "values = { arm_angle = -0.5, arm_rate = -4.4 }",
        "fit = [6.0, 9.0]": "fit = [30.6, 33.6]",
        "values = { arm_angle = -1.0, arm_rate = 6.3 }": "values = { arm_angle = 0.6, arm_rate = -2.0 }",
        "fit = [9.0, 12.0]": "fit = [33.6, 36.6]",
        "values = { arm_angle = 1.2, arm_rate = -2.3 }": "values = { arm_angle = 0.1, arm_rate = 4.7 }",
    }
    found = edited("pendulum", tmp_path_factory.mktemp("last"), *windows.items())
    return fitted(replace(found, experiments=found.experiments[:4]))


def test_unseen_pieces_are_predicted_from_their_first_samples(single: sb.Fit) -> None:
    pieces = {r.name: r for r in single.result.recordings if r.rows == 0}
    held = [e.held_out for e in study("pendulum").experiments if e.predict]
    assert [round(stop - start) for start, stop in held] == [5, 5, 5, 9]
    assert all(r.unit == "rad" and r.held_out < 0.01 for r in pieces.values()), pieces
    assert pieces["last_9s"].held_out < 0.005


def test_friction_of_the_first_and_of_the_last_third_agree_or_are_doubted(single: sb.Fit, last_third: sb.Fit) -> None:
    """The bearing's friction wanders by a tenth; intervals that miss each other do not go unmarked."""
    for name in ("arm_friction", "arm_drag"):
        one, other = single[name], last_third[name]
        assert other.value == pytest.approx(one.value, rel=0.17)
        meet = max(one.lower, other.lower) < min(one.upper, other.upper)
        assert meet or "doubtful" in (one.verdict, other.verdict), (str(one), str(other))


def test_a_rigid_body_on_a_hinge_finds_what_the_pendulum_finds(single: sb.Fit) -> None:
    """Its length is a + I/(m a); frictions are those of its first moment m a, which is 0.26 % less."""
    body, m, a = fitted(study("pendulum_bodies")), 0.14757, 0.14775490106282646
    length, other = a + body["arm_inertia_2"].value / (m * a), single["arm_length"]
    assert abs(length - other.value) < 0.1 * other.half_width
    share = m * a / (0.14274 * other.value)
    for name, known in (("hinge_friction", single["arm_friction"]), ("air_drag", single["arm_drag"])):
        assert body[name].value == pytest.approx(share * known.value, rel=1e-3)
        assert body[name].half_width == pytest.approx(share * known.half_width, rel=0.02)
        assert body[name].verdict == known.verdict
    pieces = [[r.held_out for r in fit.result.recordings if r.rows == 0] for fit in (body, single)]
    assert len(pieces[0]) == 4 and pieces[0] == pytest.approx(pieces[1], rel=2e-3)


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> tuple[sb.Fit, sb.Fit]:
    """Fits with pushes to the first and to the last third."""
    folder = EXPERIMENTS / "pendulum_pushed"
    text = (folder / "pendulum_pushed.toml").read_text()
    edits = {"[0.0, 12.0]": "[24.665, 36.665]", "arm_angle = 1.6, arm_rate = -2.1": "arm_angle = 0.0, arm_rate = 6.2"}
    fits = []
    for changes in ({}, edits):
        changed = text
        for before, after in changes.items():
            assert changed.count(before) == 1, before
            changed = changed.replace(before, after)
        path = tmp_path_factory.mktemp("pushed") / "pushed.toml"
        path.write_text(changed)
        fits.append(fitted(build(parse(path), folder)))
    return fits[0], fits[1]


def test_with_pushes_friction_and_drag_of_both_thirds_agree(pushed: tuple[sb.Fit, sb.Fit], single: sb.Fit) -> None:
    """Each lies within 5 % for friction and in intervals that meet; the plain fit names pushes as a cause."""
    first, last = pushed
    assert last["arm_friction"].value == pytest.approx(first["arm_friction"].value, rel=0.05)
    for name in ("arm_friction", "arm_drag"):
        one, other = first[name], last[name]
        assert max(one.lower, other.lower) < min(one.upper, other.upper), (str(one), str(other))
        assert "such as small pushes along the motion (`shooting` allows for them)" in single[name].words
        assert "pushes" not in one.words + other.words
    for fit in pushed:
        (found,) = fit.result.shot
        assert 5e-5 < found.loss < 2e-4, found  # m/s


def test_slow_errors_within_sigma_do_not_contradict_the_first_third_of_a_second(single: sb.Fit) -> None:
    """Friction and drag of the first 0.333 s alone differ by 57 and 47 %. What is left of that stretch tells of 25 %;
    slow errors like those of the rest, below sigma, move 35 and 44 %."""
    misfit = single.result.misfit
    assert misfit is not None and misfit.model_error == 0.0
    assert not any("s alone ask for" in one.words for one in single.result.estimates)


def test_windows_that_decide_friction_and_drag_together_are_named(single: sb.Fit) -> None:
    """Each window knows one combination of the two. Without the last one friction moves by 20 %, without the first one
    drag by 8 %, where their intervals are 9 and 4 %."""
    for name, window, low, high in (
        ("arm_friction", "fitted_9s", 5.2e-4, 5.9e-4),
        ("arm_drag", "fitted_0s", 1.6e-5, 1.75e-5),
    ):
        one = single[name]
        assert one.verdict == "doubtful" and f"without {window} it would be" in one.words
        assert low < float(one.words.split("it would be ")[1].split(" ")[0]) < high


def test_viscosity_alone_misses_what_dry_friction_and_drag_predict(single: sb.Fit, tmp_path: Path) -> None:
    edits = (
        ("friction = 5e-4\ndrag = 1e-5", "viscosity = 1e-4"),
        ("[parameters.arm_friction]\n\n[parameters.arm_drag]", "[parameters.arm_hinge_viscosity]"),
    )
    found = edited("pendulum", tmp_path, *edits)
    viscous = fitted(replace(found, experiments=(*found.experiments[:4], found.experiments[5])), refine=None)
    for name, part in (("fitted_0s", "rms"), ("from_17_5s", "held_out")):
        ours, theirs = (next(r for r in f.result.recordings if r.name == name) for f in (single, viscous))
        assert getattr(theirs, part) > 1.5 * getattr(ours, part), (name, theirs, ours)


def test_the_reported_angles_are_angles(single: sb.Fit) -> None:
    piece = next(c for c in single.comparisons if c.experiment.name == "from_17_5s")
    measured, simulated = (
        np.arctan2(x[piece.held_out, 0, 0], -x[piece.held_out, 0, 2])
        for x in (piece.recording.positions, piece.simulated)
    )
    assert next(r for r in single.result.recordings if r.name == "from_17_5s").held_out == pytest.approx(
        np.sqrt(np.mean((measured - simulated) ** 2)), rel=1e-3
    )


def test_only_ratios_to_the_mass_are_known(single: sb.Fit, tmp_path: Path) -> None:
    assert single["arm_length"].value == pytest.approx(AUTHORS_LENGTH, rel=5e-3)
    free = ("[parameters.arm_friction]", "[parameters.arm_mass]\n\n[parameters.arm_friction]")
    s = edited("pendulum", tmp_path, free)
    found = fitted(replace(s, experiments=s.experiments[:4]), refine=None)
    assert {found[f"arm_{q}"].verdict for q in ("mass", "friction", "drag")} == {"not identifiable"}
    (gauge,) = found.result.gauges
    for torque in ("friction", "drag"):
        ratio = found.values[f"arm_{torque}"] / found.values["arm_mass"]
        assert ratio == pytest.approx(single.values[f"arm_{torque}"] / 0.14274, rel=1e-3)
        assert f"arm_{torque}" in gauge
    assert "arm_mass" in gauge


def test_double_pendulum_knows_ratios_only() -> None:
    s = study("double_pendulum")
    short = [replace(e, fit=(e.fit[0], e.fit[0] + 0.6)) for e in s.experiments if e.predict is None]
    private = {name: given for name, given in s.parameters.items() if given.get("private")}
    body = [f"{arm}_{q}" for arm in ("upper", "lower") for q in ("mass", "first_moment", "inertia", "friction")]
    body.append("lower_drag")
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
    found = sb.fit(chosen, parameters=s.parameters, threads=2)
    pieces = [r for r in found.result.recordings if r.rows == 0]
    assert [r.name for r in pieces] == ["from_20s", "from_40s"]
    assert all(r.held_out < 0.02 * r.baseline for r in pieces)
    for name, value in (
        ("upper_first_moment", 0.0101882),
        ("lower_first_moment", 0.0160683),
        ("lower_inertia", 0.00314527),
    ):
        assert found[name].value == pytest.approx(value, rel=0.02)


@pytest.fixture(scope="module")
def whole() -> ModuleType:
    """experiments/double_pendulum_whole/whole.py"""
    spec = importlib.util.spec_from_file_location("whole", EXPERIMENTS / "double_pendulum_whole" / "whole.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["whole"] = module
    spec.loader.exec_module(module)
    return module


def test_windows_that_no_fit_saw_are_predicted(whole: ModuleType) -> None:
    """The first 10.7 s of the whole motion in four windows, of which the second and the fourth are hidden."""
    every, parameters = whole.study(4)
    assert [e.name for e in every] == ["whole", "from_2s", "from_8s"]
    seen = every[0].fitted()
    hidden = ~seen.mask.any(axis=1)
    assert 0.45 < hidden.mean() < 0.55
    for piece in every[1:]:
        start, stop = piece.fit[0], piece.held_out[1]
        inside = (seen.times >= start - 1e-9) & (seen.times < stop - 1e-9)
        assert inside.any() and hidden[inside].all()
    found = whole.fitted(every[0], parameters)
    assert found.shot.windows == 4
    assert 0.0 < found.shot.lower < found.shot.loss < found.shot.upper < 1e-3  # m/s
    pieces = whole.predicted(every, parameters, found.values)
    assert set(pieces) == {"from_2s", "from_8s"} and max(pieces.values()) < 0.008, pieces
    unbroken = whole.fitted(every[0], parameters, 1e-6)
    assert unbroken.rms > 1.2 * found.rms, (unbroken.rms, found.rms)
