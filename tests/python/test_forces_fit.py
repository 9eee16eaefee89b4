"""Recorded forces as residuals of a fit: what they identify, their Jacobian, the report, and the configuration."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.cli.app import app
from sheetbend.config import load
from sheetbend.experiment.wanted import as_parameters
from sheetbend.pictures.force_plot import plot_forces
from sheetbend.problem.jacobian_check import check_jacobian
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.covariance import covariance
from sheetbend.statistics.layout import Layout
from typer.testing import CliRunner

TRUTH = {"rod_density": 0.12, "rod_EI": 6e-3}
RATIO = 0.8  # GJ/EI
SOLVER = sb.Solver(h=1 / 150)
SPAN = 1.2  # s
NOISE, FORCE_NOISE = 5e-4, 0.02  # m, N


def rod(knots: int = 201) -> sb.Scene:
    """A rod of 0.6 m between two grips; one shakes it along and across."""
    t = np.linspace(0.0, 2.0, knots)
    rise = np.minimum(t / 0.2, 1.0) ** 2 * (3 - 2 * np.minimum(t / 0.2, 1.0))
    place = np.stack([0.5 + 0.05 * rise * np.sin(7 * t), 0.0 * t, 0.08 * rise * np.sin(9 * t)], axis=1)
    turns = np.stack([0 * t, np.sin(0.1 * rise * np.sin(8 * t)), 0 * t, np.cos(0.1 * rise * np.sin(8 * t))], axis=1)
    scene = sb.Scene("twin", (0.0, 0.0, -9.81))
    x = np.linspace(0.0, 0.5, 50)
    points = np.stack([x, 0 * x, -0.16 * np.sin(np.pi * x / 0.5) ** 2], axis=1)
    sb.add_rod(
        scene,
        "rod",
        length=0.6,
        segments=12,
        points=points,
        density=TRUTH["rod_density"],
        EI=TRUTH["rod_EI"],
        GJ=RATIO * TRUTH["rod_EI"],
        start=sb.Grip.fixed([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        end=sb.Grip.from_poses(t, place, turns),
        bend_damping=0.01,
        twist_damping=0.01,
    )
    return scene


MARKS = (2, 4, 6, 8, 10)


@pytest.fixture(scope="module")
def twin() -> tuple[np.ndarray, np.ndarray, sb.ForceRecording]:
    """Frames, markers without noise, and forces without noise."""
    scene = rod()
    frames = np.arange(0, 37) * 5 * SOLVER.h
    forces = sb.simulate_forces(scene, np.arange(2, 120) * 0.01, ("rod", "start"), SOLVER, start="equilibrium")
    start = sb.equilibrium(scene).nodes
    places = sb.simulate(scene, frames, SOLVER, start=start).positions[:, scene.ropes["rod"].particles[list(MARKS)]]
    return frames, places, forces


def experiment(twin, seed: int, with_forces: bool = True, scene: sb.Scene | None = None, **more) -> sb.Experiment:
    frames, places, forces = twin
    scene, rng = rod() if scene is None else scene, np.random.default_rng(seed)
    recording = sb.Recording(places + NOISE * rng.standard_normal(places.shape), frames)
    noisy = replace(forces, forces=forces.forces + FORCE_NOISE * rng.standard_normal(forces.forces.shape))
    sensor = sb.ForceSensor(recording=noisy, at=("rod", "start"), sigma=FORCE_NOISE, name="wrist")
    return sb.Experiment(
        scene=scene,
        recording=recording,
        name="shaken",
        markers=[sb.on_particle(int(scene.ropes["rod"].particles[k])) for k in MARKS],
        solver=SOLVER,
        start="equilibrium",
        sigma=NOISE,
        forces=[sensor] if with_forces else [],
        **more,
    )


PARAMETERS = {
    "rod_density": {"initial": 0.15},
    "rod_EI": {"initial": 5e-3},
    "rod_GJ": {"tied_to": "rod_EI", "factor": RATIO},
}
QUICK = {"refine": False, "profiles": False, "windows": ()}


@pytest.mark.slow
def test_forces_tell_density_and_stiffness_apart_in_twenty_draws(twin) -> None:
    inside = dict.fromkeys(TRUTH, 0)
    for seed in range(20):
        found = sb.fit(experiment(twin, seed), parameters=PARAMETERS, **QUICK).result
        for name, truth in TRUTH.items():
            estimate = found[name]
            assert estimate.verdict == "identified"
            assert estimate.half_width < 0.03 * truth
            inside[name] += estimate.lower <= truth <= estimate.upper
    assert min(inside.values()) >= 17, inside


def test_without_forces_only_the_ratio_is_known(twin) -> None:
    found = sb.fit(experiment(twin, 0, with_forces=False), parameters=PARAMETERS, **QUICK).result
    assert {found[name].verdict for name in TRUTH} == {"not identifiable"}
    assert any("rod_density" in words and "rod_EI" in words for words in found.gauges)
    ratio = found["rod_EI"].value / found["rod_density"].value
    assert ratio == approx(TRUTH["rod_EI"] / TRUTH["rod_density"], rel=0.02)


def test_the_report_tells_the_forces_beside_a_constant(twin) -> None:
    e = experiment(twin, 3, fit=(0.0, 0.8), held_out=(0.8, SPAN))
    result = sb.fit(e, parameters=PARAMETERS, **QUICK).result
    (row,) = result.forces
    assert (row.recording, row.sensor, row.unit) == ("shaken", "wrist", "N")
    assert row.rows == 3 * 75  # from 0.02 s to the last fitted frame, at 0.767 s
    assert row.rms == approx(FORCE_NOISE, rel=0.15)
    assert row.held_out == approx(FORCE_NOISE, rel=0.2)
    assert row.baseline > 4 * row.held_out
    assert sb.FitResult.from_dict(result.to_dict()) == result
    text = result.report()
    assert "Forces" in text
    assert "wrist" in text
    assert "constant" in text
    assert result.misfit.model_error < NOISE  # of markers, in m
    assert result.misfit.reduced_chi_square == approx(1.0, abs=0.2)


def test_the_limit_of_short_substeps_takes_forces_along(twin) -> None:
    coarse = replace(experiment(twin, 3), solver=replace(SOLVER, h=5 * SOLVER.h / 3))  # than the twin's
    found = sb.fit(coarse, parameters=PARAMETERS, profiles=False).result
    plain = sb.fit(coarse, parameters=PARAMETERS, **QUICK).result
    for name in TRUTH:
        assert found[name].value - plain[name].value == approx(found[name].moved, rel=1e-3)
        assert 0 < abs(found[name].moved) < 0.05 * TRUTH[name]


@pytest.mark.parametrize("method", ["direct", "gauss_seidel", "implicit"])
def test_the_jacobian_is_that_of_differences(method: str) -> None:
    """Also of the sensor's own numbers; the complex step is taken in tests/cpp/test_support.cpp."""
    scene = sb.Scene("shaken", (0.0, 0.0, -9.81))
    t = np.linspace(0.0, 1.0, 101)
    built = sb.add_rope(scene, length=0.5, segments=5, density=0.1, EA=50.0, EI=1e-3, points=None, start=(0, 0, 0))
    scene.drive([built.particles[0]], t, np.stack([0.03 * np.sin(20 * t) ** 2, 0 * t, 0 * t], 1)[:, None])
    solver = sb.Solver(h=1 / 500, method=method)
    times, rng = np.linspace(0.02, 0.1, 9), np.random.default_rng(4)
    turns = rng.standard_normal((9, 4))
    recording = sb.ForceRecording(times, np.zeros((9, 3)), np.zeros((9, 3)), turns)
    sensor = sb.ForceSensor(
        recording=recording,
        at=("rope", "start"),
        name="wrist",
        sigma=0.01,
        torque_sigma=0.002,
        arm=(0.01, 0.02, 0.03),
        reads="body",
        average=0.004,
        bias=True,
        torque_bias=True,
        tool=True,
        time_offset=True,
    )
    sensor.declare(scene)
    seen = sb.Recording(np.zeros((3, 1, 3)), np.array([0.0, 0.05, 0.1]))
    tip = [sb.on_particle(int(built.particles[-1]))]
    e = sb.Experiment(scene=scene, recording=seen, markers=tip, solver=solver, forces=[sensor])
    names = ["rope_density", "rope_EI", "rope_EA", *sensor.quantities]
    assert len(names) == 3 + 3 + 3 + 4 + 1
    own = {name: {"initial": 0.02 * (k + 1)} for k, name in enumerate(sensor.quantities)}
    own["wrist_time_offset"] = {"initial": 0.7e-3}  # between substeps, where the interpolation is smooth
    problem = FitProblem([e], as_parameters(dict.fromkeys(names) | own, [e]))
    assert problem.core.data_rows == 9 + 54
    report = check_jacobian(problem, "shaken")
    assert report.passed, str(report)
    assert max(row.differences for row in report.rows) < 1e-6
    assert min(row.largest for row in report.rows) > 1e-2


TOML = """
[experiment]
name = "forces"

[solver]
h = 0.002

[scene]
gravity = [0.0, 0.0, -9.81]

[[scene.rope]]
name = "rope"
length = 0.5
segments = 5
density = 0.15
EA = 50.0
points = "recording"
pinned = [0]

[[recording]]
file = "seen.npz"
sigma = 1e-3

[[recording.force]]
file = "cell.csv"
at = ["rope:start"]
sigma = 0.01
axes = "z"
bias = true

[fit]
halve_step = false
double_segments = false
profiles = false

[parameters.rope_density]

[parameters.cell_bias_z]
prior = [0.0, 0.005]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A rope of 0.1 kg/m that swings about its start, which hangs on a load cell with an axis of its own."""
    scene = sb.rope(0.5, 5, density=0.1, EA=50.0)
    frames = np.arange(51) * 0.02
    solver = sb.Solver(h=0.002)
    sb.Recording(sb.simulate(scene, frames, solver).positions, frames).save(tmp_path / "seen.npz")
    times = np.arange(1, 101) * 0.01
    read = sb.simulate_forces(scene, times, ("rope", "start"), solver).forces[:, 2]
    read = read + 0.01 * np.random.default_rng(2).standard_normal(len(read))
    rows = [f"{t!r},{f!r}" for t, f in zip(times.tolist(), read.tolist(), strict=True)]
    (tmp_path / "cell.csv").write_text("\n".join(["time,fz", *rows]), encoding="utf-8")
    (tmp_path / "forces.toml").write_text(TOML, encoding="utf-8")
    return tmp_path


def test_a_configuration_weighs_a_rope_by_a_load_cell(folder: Path) -> None:
    study = load(folder / "forces.toml")
    (e,) = study.experiments
    (cell,) = e.forces
    assert (cell.name, cell.axes, cell.sigma) == ("cell", "z", 0.01)
    result = sb.fit(list(study.experiments), parameters=study.parameters, **study.options).result
    density = result["rope_density"]
    assert density.verdict == "identified"
    assert density.lower < 0.1 < density.upper
    assert result.forces[0].rms == approx(0.01, rel=0.2)


def test_a_figure_shows_every_component_that_counts(folder: Path) -> None:
    study = load(folder / "forces.toml")
    found = sb.fit(list(study.experiments), parameters=study.parameters, **study.options)
    (panel,) = plot_forces(found.comparisons[0].forces[0])
    assert panel.get_ylabel() == "force z [N]"
    dots, line = panel.get_lines()
    assert len(dots.get_xdata()) == len(line.get_xdata()) == 100


def test_simulate_writes_what_sensors_read(folder: Path) -> None:
    done = CliRunner().invoke(app, ["simulate", str(folder / "forces.toml"), "--output", str(folder / "out")])
    assert done.exit_code == 0, done.output
    with np.load(folder / "out" / "seen.npz") as arrays:
        times, read = arrays["sensor_cell_times"], arrays["sensor_cell_forces"]
        assert times == approx(np.arange(1, 101) * 0.01)
        assert read.shape == arrays["sensor_cell_torques"].shape == (100, 3)
    scene = sb.rope(0.5, 5, density=0.15, EA=50.0)
    assert read == approx(sb.simulate_forces(scene, times, ("rope", "start"), sb.Solver(h=0.002)).forces, abs=1e-6)


@pytest.mark.parametrize(
    ("line", "wrong", "path", "word"),
    [
        ('file = "cell.csv"', 'file = "none.csv"', "recording[0].force[0].file", "does not exist"),
        ('at = ["rope:start"]', 'at = ["rope:end"]', "recording[0].force[0].at", "nothing holds"),
        ('at = ["rope:start"]', 'at = ["cord:end"]', "recording[0].force[0].at", "names no rope"),
        ('axes = "z"', 'axes = "x"', "axes", "nothing to compare"),
        ("bias = true", 'time_offset = "late"', "quantities", "not in the scene"),
    ],
)
def test_what_does_not_suit_is_named(folder: Path, line: str, wrong: str, path: str, word: str) -> None:
    (folder / "forces.toml").write_text(TOML.replace(line, wrong), encoding="utf-8")
    with pytest.raises(sb.ConfigError) as error:
        load(folder / "forces.toml")
    assert path in str(error.value)
    assert word in str(error.value)


def test_tables_of_forces_are_refused_by_line(tmp_path: Path) -> None:
    file = tmp_path / "cell.csv"
    for text, word in (
        ("", "no header"),
        ("time,fz\n", "no rows"),
        ("time,force\n0,1\n", "line 1"),
        ("time,fz\n0,1\n0.1\n", "line 3"),
        ("time,fz\n0,1\n0,2\n", "repeats"),
        ("time,qx\n0,1\n", "no column"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(sb.RecordingError, match=word):
            sb.ForceRecording.load(file)
    with pytest.raises(sb.RecordingError, match="unknown kind"):
        sb.ForceRecording.load(tmp_path / "cell.txt")


def test_a_recording_of_forces_is_kept_to_the_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    forces = rng.standard_normal((4, 3))
    forces[1] = np.nan
    made = sb.ForceRecording(np.arange(4) / 3, forces, rng.standard_normal((4, 3)), rng.standard_normal((4, 4)))
    made.save(tmp_path / "wrist.npz")
    read = sb.ForceRecording.load(tmp_path / "wrist.npz")
    assert read.name == "wrist"
    for field in ("times", "forces", "torques"):
        np.testing.assert_array_equal(getattr(read, field), getattr(made, field))
    assert read.quaternions == approx(made.quaternions, abs=1e-15)


def test_forces_are_of_motions_and_of_what_is_held(twin) -> None:
    e = experiment(twin, 0)
    with pytest.raises(sb.InputError, match="motions, not at rest"):
        replace(e, static=True)
    with pytest.raises(sb.InputError, match="share a name"):
        replace(e, forces=[*e.forces, *e.forces])
    with pytest.raises(sb.InputError, match="nothing holds"):
        replace(e, forces=[replace(e.forces[0], at=[int(e.scene.ropes["rod"].particles[3])])])


def test_rows_of_two_clocks_do_not_correlate() -> None:
    """The covariance of two series on clocks of their own is that of two recordings."""
    rng = np.random.default_rng(5)
    r, J = rng.standard_normal(60), rng.standard_normal((60, 2))
    r[30:] += 0.8 * r[:30]
    first, frame = np.repeat([0, 1], 30), np.tile(np.arange(30), 2)
    zeros = np.zeros(60, dtype=int)
    together = covariance(r, J, Layout(zeros, first, frame))
    clocks = covariance(r, J, Layout(zeros, zeros, frame, clock=first))
    apart = covariance(r, J, Layout(first, zeros, frame))
    np.testing.assert_array_equal(clocks.matrix, apart.matrix)
    assert not np.allclose(clocks.matrix, together.matrix, rtol=1e-3)


def test_noise_of_what_drives_is_told_where_forces_feel_it() -> None:
    """With 0.2 mm of noise the recorded hand jerks the rope by much more than the sensor's noise."""
    frames, solver, rng = np.arange(41) * 0.02, sb.Solver(h=0.005), np.random.default_rng(1)
    hand = np.stack([0.03 * np.sin(9 * frames) ** 2, 0 * frames, 0 * frames], 1)

    def followed(motion: np.ndarray) -> sb.Scene:
        scene = sb.Scene("followed", (0.0, 0.0, -9.81))
        rope = sb.add_rope(scene, length=0.5, segments=5, density=0.2, EA=50.0, direction=(0, 0, -1))
        scene.follow([rope.particles[0]], frames, motion[:, None], ["hand"])
        return scene

    true = followed(hand)
    tip = sb.simulate(true, frames, solver).positions[:, -1]
    read = sb.simulate_forces(true, frames[1:], ("rope", "start"), solver)
    noisy = hand + 2e-4 * rng.standard_normal(hand.shape)
    force = replace(read, forces=read.forces + 0.02 * rng.standard_normal(read.forces.shape))
    scene = followed(noisy)
    e = sb.Experiment(
        scene=scene,
        recording=sb.Recording(np.stack([noisy, tip], axis=1), frames, ("hand", "tip")),
        markers=[None, sb.on_particle(int(scene.ropes["rope"].particles[-1]))],
        solver=solver,
        sigma=1e-2,
        forces=[sb.ForceSensor(recording=force, at=("rope", "start"), sigma=0.02)],
    )
    result = sb.fit(e, parameters=["rope_density"], **QUICK).result
    (told,) = [w for w in result.warnings if "moves what force reads" in w]
    assert "smoother poses" in told
    with pytest.raises(sb.InputError, match="do not go with driven_sigma"):
        replace(e, driven_sigma=2e-4)


def test_two_grips_share_what_the_momentum_needs() -> None:
    """Their forces add up to the rate of the rod's momentum less its weight, and so do their torques, those on the
    directors among them. The rates are those of BDF2; knots are close together, for accelerations jump at each."""
    h, n = 1 / 1200, 300
    scene, solver = rod(knots=4001), sb.Solver(h=h)
    rope = scene.ropes["rod"].particles
    start = sb.equilibrium(scene).nodes
    x = sb.simulate(scene, np.arange(n + 1) * h, solver, start=start).positions[:, rope]
    mass = TRUTH["rod_density"] * 0.6 / 12 * np.array([0.5, *[1.0] * 11, 0.5])
    steps = np.arange(60, n - 20, 16)
    v = np.zeros_like(x)
    v[2:] = (3 * x[2:] - 4 * x[1:-1] + x[:-2]) / (2 * h)
    rate = (3 * v[steps] - 4 * v[steps - 1] + v[steps - 2]) / (2 * h)
    needed = mass[:, None] * (rate - np.array([0.0, 0.0, -9.81]))
    force, torque = needed.sum(axis=1), np.cross(x[steps], needed).sum(axis=1)
    ends = [sb.simulate_forces(scene, steps * h, ("rod", e), solver, start="equilibrium") for e in ("start", "end")]
    about = sum(e.torques + np.cross(x[steps, k], e.forces) for e, k in zip(ends, (0, -1), strict=True))
    assert np.abs(ends[0].forces - ends[1].forces).max() > 0.5
    assert ends[0].forces + ends[1].forces == approx(force, abs=1e-4 * np.abs(force).max())
    assert about == approx(torque, abs=1e-4 * np.abs(torque).max())
