"""The motion of driven markers that a fit estimated, kept beside fitted.toml, and what simulations do with it."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from commands import last_line, run
from pytest import approx
from sheetbend.config import load
from sheetbend.config.driven_motion import as_simulated
from sheetbend.experiment.driven_motion import continued, estimated_motion, following, recorded_motion
from test_driven_noise import NOISE, H, hand, shaken

Array = np.ndarray
TOML = f"""
[experiment]
name = "take"
[solver]
substeps = 4
[[scene.rope]]
name = "rope"
points = [[0, 0, 0], [0, 0, -0.4]]
segments = 8
density = 0.05
EI = 2.5e-3
bend_damping = 0.02
drag_linear = 5e-3
[scene.rope.markers]
hand = 0.0
m2 = 0.1
m4 = 0.2
m6 = 0.3
m8 = 0.4
[[scene.rope.grip]]
at = "start"
markers = ["hand"]
[[recording]]
file = "data/take.csv"
fit = [0.0, 0.7]
held_out = [0.7, 1.01]
sigma = {NOISE}
driven_sigma = {NOISE}
[parameters.rope_EI]
[fit]
profiles = false
halve_step = false
double_segments = false
"""
TIMES = np.arange(61) / 60


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording, its configuration, and what a fit wrote in `out`."""
    folder = tmp_path_factory.mktemp("take")
    (folder / "data").mkdir()
    replace(shaken(7, frames=61).recording, name="take").save(folder / "data/take.csv")
    (folder / "take.toml").write_text(TOML)
    done = run("fit", folder / "take.toml", "--output", folder / "out", "--json")
    assert done.exit_code == 0, done.output
    assert "driven_take.npz" in last_line(done)["files"]
    return folder


def copied(fitted: Path, to: Path, **changed: object) -> Path:
    """The fit's folder at another place, with keys of its recording changed (None: left out)."""
    shutil.copytree(fitted, to, dirs_exist_ok=True)
    content = tomllib.loads((to / "out/fitted.toml").read_text())
    recording = content["recording"][0] | changed
    content["recording"] = [{key: value for key, value in recording.items() if value is not None}]
    (to / "out/fitted.toml").write_text(tomli_w.dumps(content))
    return to / "out/fitted.toml"


def predicted(folder: Path) -> sb.Recording:
    return sb.Recording.load(folder / "predicted_take.npz")


def test_a_fit_leaves_the_estimated_motion_beside_its_configuration(fitted: Path) -> None:
    section = tomllib.loads((fitted / "out/fitted.toml").read_text())["recording"][0]
    assert section["driven_motion"] == "driven_take.npz" and section["file"] == "../data/take.csv"
    motion = sb.Recording.load(fitted / "out/driven_take.npz")
    recorded = sb.Recording.load(fitted / "data/take.csv").select(["hand"])
    assert motion.markers == ("hand",) and motion.times == approx(recorded.times, abs=1e-12)
    seen = TIMES < 0.7
    off = [np.sqrt(np.mean((x[seen, 0] - hand(TIMES)[seen]) ** 2)) for x in (recorded.positions, motion.positions)]
    assert off[1] < 0.9 * off[0]


def test_a_simulation_of_it_predicts_what_the_fit_did(fitted: Path, tmp_path: Path) -> None:
    done = run("simulate", fitted / "out/fitted.toml", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    told, again = predicted(fitted / "out"), predicted(tmp_path)
    assert again.markers == told.markers and again.times == approx(told.times)
    assert again.positions == approx(told.positions, abs=1e-12)
    # and so does the whole scene, whose end is where the motion says
    motion, trajectory = sb.Recording.load(fitted / "out/driven_take.npz"), np.load(tmp_path / "take.npz")
    assert trajectory["positions"][:, 0] == approx(motion.positions[:, 0], abs=1e-9)
    assert trajectory["positions"][:, [2, 4, 6, 8]] == approx(again.positions, abs=1e-9)


def test_without_it_a_simulation_follows_the_recording(fitted: Path, tmp_path: Path) -> None:
    file = copied(fitted, tmp_path, driven_motion=None)
    assert run("simulate", file, "--output", tmp_path / "plain").exit_code == 0
    plain = predicted(tmp_path / "plain").positions - predicted(fitted / "out").positions
    assert np.sqrt(np.mean(plain**2)) > 0.1 * NOISE


def test_a_fit_from_it_estimates_the_motion_anew(fitted: Path, tmp_path: Path) -> None:
    file = copied(fitted, tmp_path)
    done = run("fit", file, "--output", tmp_path / "again")
    assert done.exit_code == 0, done.output
    first, again = (sb.FitResult.load(f / "fit.json")["rope_EI"] for f in (fitted / "out", tmp_path / "again"))
    assert again.value == approx(first.value, rel=1e-4) and again.half_width == approx(first.half_width, rel=1e-2)
    motions = [sb.Recording.load(f / "driven_take.npz").positions for f in (fitted / "out", tmp_path / "again")]
    assert motions[1] == approx(motions[0], abs=1e-2 * NOISE)


def spoiled(motion: sb.Recording, how: str) -> sb.Recording:
    x, t = motion.positions.copy(), motion.times
    if how == "gap":
        x[20] = np.nan
    if how == "far":
        x += np.random.default_rng(0).normal(0.0, 30 * NOISE, x.shape)
    if how == "short":
        x, t = x[:50], t[:50]
    return sb.Recording(x, t, ("wrist",) if how == "other" else motion.markers, name="driven")


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("other", "must be of the markers that drive the scene, hand"),
        ("short", "lacks the frame at 0.833333 s"),
        ("gap", "has a gap at 0.333333 s"),
        ("far", "from the recorded motion (of one coordinate), as from another recording"),
    ],
)
def test_a_motion_that_fits_no_longer_is_refused(fitted: Path, tmp_path: Path, how: str, words: str) -> None:
    file = copied(fitted, tmp_path)
    motion = sb.Recording.load(tmp_path / "out/driven_take.npz")
    spoiled(motion, how).save(tmp_path / "out/driven_take.npz")
    done = run("simulate", file, "--output", tmp_path / "again")
    assert done.exit_code == 2, done.output
    told = " ".join(done.stderr.split())
    assert "recording[0].driven_motion" in told and words in told and "Fix: fit again" in told
    with pytest.raises(sb.ConfigError, match="driven_motion"):
        as_simulated(load(file))


def test_a_missing_file_is_named(fitted: Path, tmp_path: Path) -> None:
    file = copied(fitted, tmp_path)
    (tmp_path / "out/driven_take.npz").unlink()
    done = run("simulate", file, "--output", tmp_path / "again")
    told = " ".join(done.stderr.split())
    assert done.exit_code == 2 and "recording[0].driven_motion: does not exist" in told and "Fix: fit again" in told
    load(file)  # which a fit needs, and not the motion


def test_it_belongs_to_a_fit_that_estimates(fitted: Path, tmp_path: Path) -> None:
    with pytest.raises(sb.ConfigError, match="driven_motion without driven_sigma"):
        load(copied(fitted, tmp_path, driven_sigma=None))


@pytest.mark.parametrize("placed", [None, [[0.0, 0.0, 0.0]]])
def test_a_scene_follows_what_was_added_to_its_markers(placed: list[list[float]] | None) -> None:
    """Like a scene that was built on that motion."""
    follow: dict[str, object] = {} if placed is None else {"placed": placed}
    e = shaken(3, frames=31, follow=follow)
    recorded = recorded_motion(e)
    assert recorded is not None
    assert recorded.positions[:, 0] == approx(e.recording.positions[:, 0])
    added = np.random.default_rng(1).normal(0.0, NOISE, (31, 1, 3))
    motion = estimated_motion(e, added)
    assert motion is not None
    assert motion.positions == approx(recorded.positions + added)
    moved = following(e, motion).scene.boundary.values[:, 0]
    x = motion.positions[:, 0]
    assert moved == approx(x if placed is None else x - x[0] + placed[0], abs=1e-15)
    assert e.scene.boundary.values[:, 0] == approx(
        recorded.positions[:, 0] - (0 if placed is None else recorded.positions[0, 0])
    )


def noisy(noise: float, seed: int = 0, frames: int = 241) -> sb.Experiment:
    """One marker that drives a particle, 0.5 s of it fitted."""
    times = np.arange(frames) / 60
    x = hand(times)[:, None] + np.random.default_rng(seed).normal(0.0, noise, (frames, 1, 3))
    scene = sb.Scene("one")
    particles = scene.add_particles(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]), 1.0)
    scene.follow(particles[:1], times, x, ["hand"])
    recording = sb.Recording(np.tile(x, (1, 2, 1)), times, ("hand", "free"), name="one")
    places = [None, sb.on_particle(int(particles[1]))]
    return sb.Experiment(
        scene=scene, recording=recording, markers=places, fit=(0.0, 0.5), driven_sigma=max(noise, 1e-8)
    )


@pytest.mark.parametrize("noise", [1e-3, 1e-4, 1e-5])
def test_behind_the_fitted_part_the_motion_is_smoothed(noise: float) -> None:
    e = noisy(noise)
    times, true = e.recording.times, hand(e.recording.times)
    correction = true[:33, None] - e.recording.positions[:33, :1]  # as if the fit had found the truth
    motion = estimated_motion(e, correction)
    assert motion is not None
    x, known = motion.positions[:, 0], times < 0.5
    assert x[known] == approx(true[known], abs=1e-12)
    left, before = (np.sqrt(np.mean((y - true)[~known] ** 2)) for y in (x, e.recording.positions[:, 0]))
    assert left <= {1e-3: 0.5, 1e-4: 0.7, 1e-5: 1.0}[noise] * before
    step = np.abs((x - true)[30] - (x - true)[29]).max()
    assert step < 2.0 * noise  # where the correction ends, no more than between frames of the recording
    assert continued(e, correction)[:, 0] == approx(x - e.recording.positions[:, 0])


def test_a_clean_motion_stays_as_recorded() -> None:
    e = noisy(0.0)
    motion = estimated_motion(e, np.zeros((33, 1, 3)))
    assert motion is not None and np.array_equal(motion.positions, e.recording.positions[:, :1])


def test_a_shape_at_rest_follows_it_too() -> None:
    e = shaken(4, frames=5, static=True)
    recorded = recorded_motion(e)
    assert recorded is not None and recorded.positions.shape == (1, 1, 3)
    motion = estimated_motion(e, np.full((1, 1, 3), 1e-4))
    assert motion is not None
    moved = following(e, motion).scene.boundary.values
    assert moved[0] == approx(e.scene.boundary.values[0] + 1e-4)


def test_a_motion_that_is_not_in_the_recording_is_none() -> None:
    e = shaken(5, frames=21)
    elsewhere = sb.Experiment(
        scene=e.scene,
        recording=e.recording.select([f"m{i}" for i in (2, 4, 6, 8)]),
        markers=[sb.on_particle(k) for k in (2, 4, 6, 8)],
        solver=sb.Solver(h=H),
        driven_sigma=NOISE,
    )
    assert recorded_motion(elsewhere) is None and estimated_motion(elsewhere, np.zeros((21, 1, 3))) is None
