"""The look-alike of rope recordings is what its files say, and the simulator gives it back from them alone."""

from __future__ import annotations

import importlib
import json
import pickle
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion, RopeModel
from sheetbend.gripped.start import started
from sheetbend.objects.grip import Grip, any_across

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "gripped_ropes"
SECONDS, FRAMES = 1.0, 100
Array = np.ndarray


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        yield importlib.import_module("make_data")
        for name in ("make_data", "grip_motion", "spoil", "strange", "altered", "laboratory", "true_ropes"):
            del sys.modules[name]


def made(script: ModuleType, folder: Path, noise: float, seed: int = 7) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "NOISE", noise)
        script.main(folder, train=1, evaluation=1, count=1, seconds=SECONDS, seed=seed)
    return folder


@pytest.fixture(scope="module")
def noisy(script: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(script, tmp_path_factory.mktemp("noisy"), script.NOISE)


@pytest.fixture(scope="module")
def clean(script: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(script, tmp_path_factory.mktemp("clean"), 0.0)


def positions(folder: Path, part: str) -> Array:
    """(frames, markers, 3) m."""
    frames = pickle.loads((folder / "rope_1" / part / "00.pkl").read_bytes())
    assert isinstance(frames, list) and {(f.shape, str(f.dtype)) for f in frames} == {((3, 13), "float64")}
    return np.array(frames).transpose(0, 2, 1)


def truth(folder: Path) -> dict:
    return json.loads((folder / "rope_1.json").read_text())


def from_files(script: ModuleType, folder: Path, part: str, **changed: float) -> Array:
    """(frames, free markers, 3) m: the true values, simulated between the recorded grips."""
    x, told = positions(folder, part), truth(folder)
    times = np.arange(FRAMES) / told["made_with"]["rate"]
    nominal = told["nominal_directions"]
    start = Grip.from_markers(times, x[:, 0], x[:, 1], nominal=nominal["start"])
    end = Grip.from_markers(times, x[:, -2], x[:, -1], end=True, nominal=nominal["end"])
    rope = script.ropes(told["made_with"]["seed"])[0]
    assert rope.values == {k: v for k, v in told["true"].items() if k != "length"}
    assert rope.slack.tolist() == told["marker_slack"] and rope.free_length == told["true"]["length"]
    rope.values.update(changed)
    return script.free_markers(rope, *script.simulated(rope, start, end, SECONDS))


def test_the_layout_is_that_of_the_rope_data(noisy: Path) -> None:
    assert sorted(str(p.relative_to(noisy)) for p in noisy.rglob("*.*")) == [
        "rope_1.json",
        "rope_1/eval/00.pkl",
        "rope_1/train/00.pkl",
    ]
    assert len(positions(noisy, "train")) == FRAMES
    assert truth(noisy)["what"].startswith("SYNTHETIC")


def test_the_same_seed_gives_the_same_files_and_another_seed_another_rope(
    script: ModuleType, noisy: Path, tmp_path: Path
) -> None:
    again, other = made(script, tmp_path / "again", script.NOISE), made(script, tmp_path / "other", script.NOISE, 8)
    for file in ("rope_1.json", "rope_1/eval/00.pkl", "rope_1/train/00.pkl"):
        assert (again / file).read_bytes() == (noisy / file).read_bytes()
        assert (other / file).read_bytes() != (noisy / file).read_bytes()


def test_the_noise_is_what_the_file_says(noisy: Path, clean: Path) -> None:
    noise = np.concatenate([positions(noisy, part) - positions(clean, part) for part in ("train", "eval")])
    assert noise.std() == pytest.approx(truth(noisy)["made_with"]["noise"], rel=4.0 / np.sqrt(2 * noise.size))
    assert abs(noise.mean()) < 4.0 * noise.std() / np.sqrt(noise.size)


def test_the_rope_rests_at_first_and_then_moves(clean: Path) -> None:
    x = positions(clean, "train")
    still = round(0.1 * truth(clean)["made_with"]["rate"])
    assert np.abs(x[: still + 1] - x[0]).max() < 2e-5
    assert np.abs(x - x[0]).max() > 0.05


@pytest.mark.parametrize("part", ["train", "eval"])
def test_the_true_values_give_the_recording_from_its_files_alone(script: ModuleType, clean: Path, part: str) -> None:
    error = np.abs(from_files(script, clean, part) - positions(clean, part)[:, 2:-2])
    assert error.mean() < 1e-5 and error.max() < 1e-4


def test_without_twist_the_recording_is_missed(script: ModuleType, clean: Path) -> None:
    GJ = 1e-3 * truth(clean)["true"]["GJ"]
    error = np.abs(from_files(script, clean, "train", GJ=GJ) - positions(clean, "train")[:, 2:-2])
    assert error.mean() > 1e-3


def test_with_noise_the_true_values_miss_by_about_the_noise(script: ModuleType, noisy: Path) -> None:
    error = np.abs(from_files(script, noisy, "train") - positions(noisy, "train")[:, 2:-2])
    assert 0.6 * script.NOISE < error.mean() < 3.0 * script.NOISE


@pytest.fixture(scope="module")
def folder(script: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a rope with everything that the clean ones leave out, in short recordings."""
    folder = tmp_path_factory.mktemp("nasty")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "SEGMENTS", 40)
        patch.setattr(script, "SUBSTEPS", 8)
        patch.setattr(script, "CREEP", ((1 / 100, 10.0),))
        script.main(folder, train=4, evaluation=1, count=1, seconds=0.5, seed=7, nasty=True)
    return folder


class TestNasty:
    def test_its_pickles_are_lists_of_numbers_and_are_read(self, folder: Path) -> None:
        path = folder / "rope_1" / "eval" / "00.pkl"
        frames = pickle.loads(path.read_bytes())
        assert {type(part) for part in (frames, frames[0], frames[0][0])} == {list} and type(frames[0][0][0]) is float
        assert (len(frames), len(frames[0]), len(frames[0][0])) == (50, 3, 13)
        assert np.array_equal(sb.Recording.load(path).positions, np.array(frames).transpose(0, 2, 1))

    def test_the_last_grip_is_exchanged_in_two_files(self, folder: Path) -> None:
        told = truth(folder)
        assert told["spoiled"] == {"02": "exchanged_midway", "03": "exchanged"}
        away = []
        for k in range(4):
            x = sb.Recording.load(folder / "rope_1" / "train" / f"{k:02d}.pkl").positions
            away.append(((x[:, -1] - x[:, -2]) * (x[:, -2] - x[:, -3])).sum(axis=1) < 0.0)
        assert not away[0].any() and not away[1].any() and away[3].all()
        assert np.flatnonzero(away[2])[0] == round(0.858 * 50) and away[2][round(0.858 * 50) :].all()

    def test_the_true_values_miss_the_unseen_recording_by_little_more_than_the_noise(
        self, script: ModuleType, folder: Path
    ) -> None:
        told = truth(folder)
        (missed,) = told["missed_by_true_values"]
        assert 0.5 * script.NOISE < missed < 3.0 * script.NOISE
        names = set(told["true"])
        assert {f"curvature_{axis}_{k}" for axis in (1, 2) for k in range(9)} <= names
        assert {f"softness_{k}" for k in range(1, 7)} <= names and {"yield_curvature", "yield_share"} <= names
        gaps = np.diff(told["marker_places"])
        assert gaps.max() > 1.2 * gaps.min() and told["marker_mass"] > 0.0

    def test_the_judge_predicts_the_true_values_as_a_fit_does(self, folder: Path) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(str(FOLDER))
            judge = importlib.import_module("judge")
        told = truth(folder)
        unseen = judge.screened(sb.read_recordings(folder / "rope_1" / "eval"), judge.SMOOTHING)
        given = told["nominal_directions"]
        nominal = np.array(given["start"]), np.array(given["end"])
        model = RopeModel(density=0.04, nominal=nominal, values={}, segments=24)
        start = started(model, unseen.motions, 0.25)
        (error,) = judge.missed_from_first_frame(start, told, unseen)
        assert error < 2.0 * told["missed_by_true_values"][0]

    def test_a_marker_weighs_what_the_file_says(self, script: ModuleType) -> None:
        rope = script.ropes(7, nasty=True)[0]
        heavy, light = (self.masses(script, r) for r in (rope, replace(rope, marker_mass=0.0)))
        assert heavy.sum() - light.sum() == pytest.approx(9 * rope.marker_mass, rel=1e-9)

    def masses(self, script: ModuleType, rope: object) -> Array:
        start, end = (Grip.fixed(place, nominal) for place, nominal in zip(self.ENDS, script.NOMINAL, strict=True))
        compiled = script.scene(rope, start, end, 40).compiled
        return compiled.unpack(compiled.inputs())["mass"]

    ENDS = ((0.0, 0.0, 0.0), (0.6, 0.0, 0.0))


class TestStrange:
    """Ropes of which the recipe has no model."""

    def test_a_recording_tells_its_rate_and_holds_the_knot_and_the_turned_axes(
        self, script: ModuleType, tmp_path: Path
    ) -> None:
        knotted, flat, _, stretching = script.strange(7)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(script, "SEGMENTS", 40)
            patch.setattr(script, "SUBSTEPS", 8)
            patch.setattr(script, "CREEP", ((1 / 100, 10.0),))
            script.main(tmp_path, train=1, evaluation=1, count=2, seconds=0.5, seed=7, odd=script.strange)
        turned, quick = (sb.read_recordings(tmp_path / f"rope_{k}" / "train")[0] for k in (1, 2))
        assert turned.positions.shape == (50, 16, 3) and quick.positions.shape == (60, 8, 3)
        assert quick.times[1] == pytest.approx(1 / 120)
        sag = GrippedMotion.of(turned, 0.08).sag
        assert sag[1] < -0.9 * np.linalg.norm(sag)
        assert truth(tmp_path)["knot"] == list(knotted.knot) and truth(tmp_path)["made_with"]["noise"] == 1e-3
        assert flat.values["EI2"] == pytest.approx(0.4 * flat.values["EI"])
        sags = stretching.values["density"] * 9.81 * stretching.length / stretching.values["EA"]
        assert sags == pytest.approx(0.02)


class TestLaboratory:
    """Ropes that change or slip, and files that lose time."""

    @pytest.fixture(autouse=True)
    def coarse(self, script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
        for name, value in {"SEGMENTS": 40, "SUBSTEPS": 8, "CREEP": ((1 / 100, 10.0),), "NOISE": 0.0}.items():
            monkeypatch.setattr(script, name, value)

    def test_a_rope_differs_from_recording_to_recording(self, script: ModuleType) -> None:
        drum, *_ = script.laboratory(7)
        found = script.as_recorded(drum, np.random.default_rng(0)).values
        share = {name: found[name] / drum.values[name] for name in ("EI", "GJ", "curvature_1_0", "curvature_2_3")}
        assert share["EI"] == pytest.approx(share["GJ"]) and 0.9 < share["EI"] < 1.1
        assert share["curvature_1_0"] == pytest.approx(share["curvature_2_3"]) and share["curvature_1_0"] != 1.0

    def test_connectors_make_the_ends_stiffer(self, script: ModuleType) -> None:
        _, sleeved, *_ = script.laboratory(7)
        plain = script.ropes(7, nasty=True)[2]

        def stiffness(rope: object, s: float) -> float:
            modes = {k: v for k, v in rope.values.items() if k.startswith("softness_")}
            return rope.values["EI"] / np.exp(sum(v * np.cos(int(k[9:]) * np.pi * s) for k, v in modes.items()))

        for s, times in ((0.02, 4.0), (0.5, 1.0), (0.98, 4.0)):
            assert stiffness(sleeved, s) / stiffness(plain, s) == pytest.approx(times, rel=0.2)  # a step as a series

    def test_wrists_roll_as_they_lean(self, script: ModuleType) -> None:
        wrist = script.laboratory(7)[3]
        level, plain = (script.motion(replace(wrist, wrist=by), np.random.default_rng(1), 1.5) for by in (1e-9, 0.0))
        rolled = script.motion(wrist, np.random.default_rng(1), 1.5)
        for flat, carried, grip, nominal in zip(level, plain, rolled, script.NOMINAL, strict=True):
            base = any_across(nominal)
            across = np.cross(flat.direction, flat.director)
            assert np.abs(across @ base).max() < 1e-8 and np.abs(carried.director - flat.director).max() > 0.02
            leans = np.arcsin(np.clip(flat.direction @ np.cross(nominal, base), -1.0, 1.0))
            angle = np.arctan2((grip.director * across).sum(axis=1), (grip.director * flat.director).sum(axis=1))
            np.testing.assert_allclose(angle, 0.4 * leans, atol=1e-7)

    def test_grips_come_late_and_frames_are_lost_or_repeat(self, script: ModuleType) -> None:
        rope = replace(script.laboratory(7)[2], late=0.02)
        kept = script.recording(rope, "train", 0, 7, 1.5)
        assert len(kept) == 144 and 4 <= (np.diff(kept, axis=0) == 0.0).all(axis=(1, 2))[12:].sum() <= 6
        late, prompt = (script.recording(replace(rope, late=by), "eval", 0, 7, 1.0) for by in (0.02, 0.0))
        np.testing.assert_array_equal(late[:, 2:-2], prompt[:, 2:-2])
        np.testing.assert_array_equal(late[2:, [0, 1, -2, -1]], prompt[:-2, [0, 1, -2, -1]])

    def test_a_rope_slips_through_its_grips(self, script: ModuleType) -> None:
        rope = script.laboratory(7)[1]
        grips = script.motion(rope, np.random.default_rng(0), 2.0)
        for grip, slid in zip(grips, script.slipping(rope, *grips, np.random.default_rng(1)), strict=True):
            by = ((slid.position - grip.position) * grip.direction).sum(axis=1)
            assert abs(by[0]) < 1e-6 and abs(by[-1]) == pytest.approx(rope.slip, abs=1e-6)
