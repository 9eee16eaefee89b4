"""Moving pictures: what the GIF holds, its frames and its time, and what is refused before any work."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.pictures.movie as movie
from sheetbend.cli.app import app
from sheetbend.pictures.drawing import ACCENT, INK, WARM
from sheetbend.pictures.movie import Motion, movie_paths, save_movie
from typer.testing import CliRunner

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

ROPE = """\
[experiment]
name = "swing"

[[scene.rope]]
length = 0.4
segments = 8
density = 0.05
pinned = [0]
"""
RECORDED = """\
[solver]
h = 0.01

[[recording]]
file = "swing.npz"

[parameters.rope_density]
prior = [0.05, 0.1]

[output]
figures = "none"
"""


def near(image: np.ndarray, color: str) -> int:
    """Pixels of about that color."""
    rgb = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])
    return int((np.abs(image.astype(int) - rgb).max(axis=2) < 24).sum())


def frames(path: Path) -> list[np.ndarray]:
    with Image.open(path) as gif:
        found = []
        for k in range(gif.n_frames):
            gif.seek(k)
            found.append(np.asarray(gif.convert("RGB")))
        return found


def sheet(count: int) -> Motion:
    """A square that is pulled to 1.1 of its width, as many frames in one second."""
    scene = sb.Scene("sheet")
    cloth = sb.add_cloth(scene, sb.mesh.grid(0.2, 0.2, 4, 4, "one_way"), density=0.1, warp=10.0, shear=5.0)
    x = scene.positions
    widths = np.linspace(1.0, 1.1, count)[:, None, None] * [1, 0, 0] + [0, 1, 1]
    assert len(x) == len(cloth.particles)
    return Motion(scene, np.linspace(0.0, 1.0, count), x * widths)


@pytest.mark.slow
def test_a_cloth_darkens_as_it_is_strained(tmp_path: Path) -> None:
    count = save_movie(sheet(11), tmp_path / "sheet.gif", "sheet")
    pictures = frames(tmp_path / "sheet.gif")
    assert count == len(pictures) == 11
    dark = [near(picture, "#063d4e") for picture in pictures]
    assert dark[-1] > 4 * dark[0]


@pytest.mark.slow
def test_a_long_motion_keeps_its_time_in_fewer_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(movie.MOST_FRAMES, ".gif", 12)
    motion = sheet(1001)
    long = Motion(motion.scene, 10 * motion.times, motion.positions)
    count = save_movie(long, tmp_path / "long.gif")
    assert count == 12
    with Image.open(tmp_path / "long.gif") as gif:
        assert gif.info["duration"] * (count - 1) == pytest.approx(10_000, rel=0.05)


@pytest.mark.slow
def test_an_mp4_holds_every_frame(tmp_path: Path) -> None:
    reader = pytest.importorskip("imageio_ffmpeg")
    count = save_movie(sheet(11), tmp_path / "sheet.mp4", "sheet")
    seen, seconds = reader.count_frames_and_secs(str(tmp_path / "sheet.mp4"))
    assert count == seen == 11 and seconds == pytest.approx(1.1, abs=0.01)


@pytest.mark.slow
def test_measured_markers_and_where_they_should_be(tmp_path: Path) -> None:
    motion = sheet(3)
    x = motion.positions[:, [0, 12, 24]]
    measured = x + np.array([0.0, 0.0, 0.04])
    measured[1, 2] = np.nan
    save_movie(Motion(motion.scene, motion.times, motion.positions, measured, x), tmp_path / "a.gif")
    save_movie(Motion(motion.scene, motion.times, motion.positions, x, x), tmp_path / "b.gif")
    (off, lost, _), (on, *_) = frames(tmp_path / "a.gif"), frames(tmp_path / "b.gif")
    assert min(near(off, WARM), near(lost, WARM), near(on, WARM)) > 0
    assert near(off, INK) > near(lost, INK) > near(on, INK) + 20


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With rope.toml, and fit.toml of a recorded rope."""
    monkeypatch.chdir(tmp_path)
    motion = sb.simulate(sb.rope(0.4, 8, density=0.05, pinned=[0]), np.arange(6) / 50, sb.Solver(h=0.01))
    sb.Recording(positions=motion.positions[:, ::4], times=motion.times, name="swing").save(tmp_path / "swing.npz")
    (tmp_path / "rope.toml").write_text(ROPE)
    (tmp_path / "fit.toml").write_text(ROPE + RECORDED)
    return tmp_path


def run(*arguments: str) -> tuple[int, dict]:
    result = CliRunner().invoke(app, [*arguments, "--json"])
    return result.exit_code, json.loads(result.stdout.splitlines()[-1])


def test_simulate_draws_a_rope(folder: Path) -> None:
    code, told = run("simulate", "rope.toml", "--duration", "0.2", "--movie", "there/swing.gif")
    pictures = frames(folder / "there" / "swing.gif")
    assert code == 0 and told["simulated"]["swing"]["movie"] == ["there/swing.gif"]
    assert len(pictures) == 6 and all(near(picture, ACCENT) > 100 for picture in pictures)
    assert (pictures[0] != pictures[-1]).any()


def test_fit_draws_markers_and_motion(folder: Path) -> None:
    code, told = run("fit", "fit.toml", "--movie", "swing.gif")
    first, *_ = frames(folder / "swing.gif")
    assert code in (0, 3) and "swing.gif" in told["files"]
    assert near(first, WARM) > 20 and near(first, ACCENT) > 50


@pytest.mark.parametrize("command", [("simulate", "rope.toml"), ("fit", "fit.toml")])
def test_another_suffix_is_refused_before_any_work(folder: Path, command: tuple[str, str]) -> None:
    code, told = run(*command, "--movie", "swing.avi")
    assert code == 2 and told["error"]["field"] == "--movie" and ".gif" in told["error"]["fix"]
    assert not (folder / "out").exists()


def test_what_has_neither_cloth_nor_rope_is_refused(folder: Path) -> None:
    (folder / "arm.toml").write_text('[experiment]\nname = "arm"\n\n[[scene.pendulum]]\nlength = 1.0\n')
    code, told = run("simulate", "arm.toml", "--movie", "arm.gif")
    assert code == 2 and "cloth or a rope" in told["error"]["problem"]


def test_a_recording_at_rest_has_no_motion(folder: Path) -> None:
    text = (folder / "fit.toml").read_text().replace('"swing.npz"', '"swing.npz"\nstatic = true')
    (folder / "still.toml").write_text(text)
    code, told = run("fit", "still.toml", "--movie", "still.gif")
    assert code == 2 and told["error"]["field"] == "--movie"


def test_several_motions_get_a_file_each() -> None:
    assert movie_paths(Path("a/m.gif"), ["one"]) == {"one": Path("a/m.gif")}
    assert movie_paths(Path("a/m.gif"), ["one", "two"])["two"] == Path("a/m_two.gif")
