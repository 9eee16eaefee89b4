"""sheetbend compare: paired errors on data that no fit saw, and what differs between fits."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.cli.app import app
from sheetbend.cli.written_fits import HeldOut, in_common
from sheetbend.statistics.paired import paired
from typer.testing import CliRunner, Result

CONFIG = """
[experiment]
name = "swing"
[solver]
h = 0.005
[[scene.rope]]
name = "rope"
length = 0.5
segments = 8
density = 0.05
EI = 2e-3
bend_damping = 3e-3
DRAG
clamp_start = [1, 0, 0]
[scene.rope.markers]
a = 0.25
b = 0.375
c = 0.5
[[recording]]
file = "../swing.npz"
fit = [0.0, 0.4]
held_out = [0.4, 1.0]
sigma = 5e-4
[fit]
halve_step = false
double_segments = false
profiles = false
[output]
figures = "none"
[parameters.rope_EI]
"""


def errors(rng: np.random.Generator, frames: int, sizes: tuple[float, float], common: float = 0.0) -> tuple:
    """Mean squared errors of two predictions, of a common part and one of their own."""
    shared = common * rng.standard_normal((frames, 30))
    return tuple(((shared + size * rng.standard_normal((frames, 30))) ** 2).mean(axis=1) for size in sizes)


class TestPaired:
    def test_the_interval_holds_the_ratio_as_often_as_it_says(self) -> None:
        """White errors of 24 frames in each of three recordings; 95 % of 300 intervals, give or take 3 %."""
        rng = np.random.default_rng(0)
        held = 0
        for _ in range(300):
            found = paired([errors(rng, 24, (1.0, 1.2)) for _ in range(3)])
            assert found.lower is not None and found.upper is not None
            held += found.lower < 1.2 < found.upper
        assert 0.92 <= held / 300 <= 0.98

    def test_frames_that_err_alike_count_as_few(self) -> None:
        rng = np.random.default_rng(1)
        a, b = errors(rng, 40, (1.0, 1.3))
        alone, repeated = paired([(a, b)]), paired([(np.repeat(a, 10), np.repeat(b, 10))])
        assert repeated.ratio == approx(alone.ratio) and repeated.stretches <= 40
        width = [p.upper / p.lower for p in (alone, repeated)]
        assert width[1] > 0.8 * width[0]  # as wide, though there are ten times as many frames

    def test_too_short_a_series_has_no_interval(self) -> None:
        found = paired([(np.array([1.0, 1.0]), np.array([4.0, 4.0]))])
        assert found.ratio == approx(2.0) and found.lower is None and not found.clear
        with pytest.raises(ValueError, match="no frames"):
            paired([])

    def test_a_clear_difference_is_told_apart_from_chance(self) -> None:
        rng = np.random.default_rng(3)
        worse, same = paired([errors(rng, 60, (1.0, 2.0), 1.0)]), paired([errors(rng, 60, (1.0, 1.0), 1.0)])
        assert worse.clear and worse.lower > 1.0 and worse.worse > 0.9
        assert not same.clear and same.lower < 1.0 < same.upper
        recordings = [(np.full(5, 1.0 + k), np.full(5, 2.0 + 2 * k)) for k in range(4)]
        assert paired(recordings).stretches == 8 and paired(recordings).ratio == approx(2**0.5)

    def test_only_frames_and_markers_of_both_count(self) -> None:
        measured = np.zeros((4, 2, 3))
        one = HeldOut(np.arange(4) / 10, ("a", "b"), measured, measured + 1.0)
        other = HeldOut(np.arange(2, 6) / 10, ("b", "c"), measured, measured + 2.0)
        times, first, second = in_common(one, other)
        np.testing.assert_allclose(times, [0.2, 0.3])
        np.testing.assert_allclose([first, second], [[3.0, 3.0], [12.0, 12.0]])
        assert in_common(one, replace(other, markers=("c", "d"))) is None
        assert in_common(one, replace(other, times=other.times + 1)) is None


@pytest.fixture(scope="module")
def fits(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rope in air, fitted with the right model, with one without drag, and on another part."""
    folder = tmp_path_factory.mktemp("fits")
    true = sb.rope(0.5, 8, density=0.05, EI=1e-3, bend_damping=3e-3, drag_linear=0.08, clamp_start=(1, 0, 0))
    motion = sb.simulate(true, np.arange(101) / 100, sb.Solver(h=0.005))
    x = motion.positions[:, true.ropes["rope"].particles[[4, 6, 8]]]
    x = x + 5e-4 * np.random.default_rng(2).standard_normal(x.shape)
    sb.Recording(x, motion.times, markers=("a", "b", "c")).save(folder / "swing.npz")
    texts = {
        "right": CONFIG.replace("DRAG", "drag_linear = 0.03") + "[parameters.rope_drag_linear]\n",
        "vacuum": CONFIG.replace("DRAG", ""),
        "early": CONFIG.replace("DRAG", "").replace("[0.0, 0.4]", "[0.4, 1.0]").replace("held_out = [0.4, 1.0]", ""),
    }
    for name, text in texts.items():
        (folder / name).mkdir()
        (folder / name / "swing.toml").write_text(text)
        if name == "early":
            continue
        done = CliRunner().invoke(
            app, ["fit", str(folder / name / "swing.toml"), "--output", str(folder / name / "out")]
        )
        assert done.exit_code in (0, 4), done.output
    return folder


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


def test_the_better_model_is_told_in_words(fits: Path) -> None:
    fitted = fits / "right" / "out" / "fitted.toml"
    fitted.write_text(fitted.read_text().replace("[parameters.rope_EI]\n", "[parameters.rope_EI]\nfiner = 0.0021\n"))
    done = run(fits / "right" / "out", fits / "vacuum" / "out", "--output", fits / "compared", "--json")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    (other,) = told["others"]
    found = told["others"][other]
    assert found["paired"]["ratio"] > 2.0 and 1e3 * found["paired"]["first"] < 2.0
    assert found["settings"]["scene.rope[0].drag_linear"] == [0.03, None]
    assert not [key for key in found["settings"] if "finer" in key]  # what a fit found is no setting
    text = " ".join((fits / "compared" / "compare.txt").read_text().split())
    assert "times that of right/out, and larger in 100% of the frames" in text and "one independent stretch" in text
    assert "rope_drag_linear is fitted in" in text
    assert (fits / "compared" / "compare.txt").read_text() and told["files"][0] == "compare.txt"


def test_the_other_way_around_the_ratio_is_the_inverse(fits: Path) -> None:
    one, two = (
        json.loads(run(fits / a / "out", fits / b / "out", "--json").stdout)["others"]
        for a, b in (("right", "vacuum"), ("vacuum", "right"))
    )
    (first,), (second,) = one.values(), two.values()
    assert first["paired"]["ratio"] * second["paired"]["ratio"] == approx(1.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["right/out"], "too few to compare"),
        (["right/out", "right/out/fit.json"], "name a fit twice"),
        (["right/out", "early"], "has no fit.json"),
        (["right/out", "nowhere"], "has no fit.json"),
    ],
)
def test_bad_arguments(fits: Path, arguments: list[str], words: str) -> None:
    done = run(*(fits / a for a in arguments))
    assert done.exit_code == 2 and words in " ".join(done.output.split())
