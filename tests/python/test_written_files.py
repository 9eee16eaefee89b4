"""Names become files: none leads out of the output folder, and no command writes over what it has read."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from commands import run

ROPE = """\
[experiment]
name = "swing"

[solver]
substeps = 4

[[scene.rope]]
name = "rope"
length = 0.6
segments = 4
density = 0.05
EA = 1e3
EI = 2e-3
pinned = [0]

[[recording]]
file = "swing.npz"

[parameters.rope_EI]
"""


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    scene = sb.rope(0.6, 4, density=0.05, EA=1e3, EI=1e-3)
    motion = sb.simulate(scene, np.arange(6) / 100, sb.Solver(h=1 / 400))
    sb.Recording(motion.positions, motion.times, name="swing").save("swing.npz")
    path = tmp_path / "my.toml"
    path.write_text(ROPE)
    return path


def refused(config: Path, *arguments: object) -> dict[str, Any]:
    """The error of a command, after which every file is what it was."""
    before = {p: p.read_bytes() for p in config.parent.rglob("*") if p.is_file()}
    result = run(*arguments, "--json")
    assert result.exit_code == 2, result.output
    assert {p: p.read_bytes() for p in config.parent.rglob("*") if p.is_file()} == before
    found: dict[str, Any] = json.loads(result.stdout)["error"]
    return found


# ---- names ----------------------------------------------------------------------------------------------

NO_FILES = {
    "folder above": "../swing",
    "folder": "a/b",
    "root": "/swing",
    "backslash": "a\\b",
    "hidden": ".swing",
    "dots": "..",
    "blank at the end": "swing ",
    "point at the end": "swing.",
    "escape": "a\x1b[31m",
    "line": "a\nb",
    "null": "a\x00",
    "half a pair": "a\udc80",
    "turned": "a\u202egpj",
    "device": "NUL.take",
    "long": "x" * 101,
    "long in bytes": "\u5e03" * 34,
    "empty": "",
}


@pytest.mark.parametrize("name", NO_FILES.values(), ids=NO_FILES)
def test_a_recording_has_the_name_of_a_file(tmp_path: Path, name: str) -> None:
    with pytest.raises(sb.RecordingError, match=r"name: .*Fix: "):
        sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0], name=name)
    sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0]).save(tmp_path / "a.npz")
    (tmp_path / "a.json").write_text(json.dumps({"name": name}))
    with pytest.raises(sb.RecordingError, match=r"a\.json: name: .*Fix: "):
        sb.Recording.load(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "name", ["Take 2023-11-22 (3)", "布 1", "seil_ä", "x" * 100, "a.b", "conical", "rope [3]", "~1"]
)
def test_other_names_stay(tmp_path: Path, name: str) -> None:
    recording = sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0], name=name)
    recording.save(tmp_path / f"{name}.npz")
    assert sb.Recording.load(tmp_path / f"{name}.npz").name == name
    (tmp_path / f"{name}.json").unlink()
    assert sb.Recording.load(tmp_path / f"{name}.npz").name == name


def test_a_stem_that_is_no_name_says_how_to_give_one(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[31m.npz"
    sb.Recording(np.zeros((2, 1, 3)), [0.0, 1.0], name="a").save(path)
    assert sb.Recording.load(path).name == "a"
    path.with_suffix(".json").unlink()
    with pytest.raises(sb.RecordingError, match=r"rename the file, or write .*name"):
        sb.Recording.load(path)


@pytest.mark.parametrize("name", ["nul", "x" * 101, "a.", "com1.rope"])
def test_names_of_a_configuration_are_those_of_files(config: Path, name: str) -> None:
    config.write_text(ROPE.replace('name = "swing"', f'name = "{name}"'))
    assert refused(config, "simulate", config)["field"] == "experiment.name"
    config.write_text(ROPE.replace('name = "rope"', f'name = "{name}"'))
    assert refused(config, "simulate", config)["field"] == "scene.rope[0].name"


# ---- inputs stay what they are --------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["simulate", "fit"])
def test_the_json_of_a_recording_does_not_say_where_to_write(config: Path, command: str) -> None:
    Path("swing.json").write_text(json.dumps({"name": "../swing"}))
    error = refused(config, command, config, "--output", "out")
    assert "holds a separator of folders" in error["message"] and "swing.json" in error["field"]


@pytest.mark.parametrize("folder", [".", "", "elsewhere/..", "here"])
def test_simulate_does_not_write_over_its_recording(config: Path, folder: str) -> None:
    Path("elsewhere").mkdir()
    Path("here").symlink_to(config.parent)
    error = refused(config, "simulate", config, "--output", folder or config.parent)
    assert error["field"] == "--output" and error["problem"] == "would write over a file that was read"


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_simulate_does_not_write_through_a_link_to_its_recording(config: Path, link: Any) -> None:
    Path("out").mkdir()
    link(config.parent / "swing.npz", "out/swing.npz")
    assert "was read" in refused(config, "simulate", config, "--output", "out")["problem"]
    link(config.parent / "swing.npz", "film.gif")
    error = refused(config, "simulate", config, "--output", "other", "--movie", "film.gif")
    assert error["field"] == "--movie" and "was read" in error["problem"]


def test_nothing_is_written_outside_the_folder(config: Path) -> None:
    Path("out").mkdir()
    Path("away").mkdir()
    Path("away/old.npz").write_bytes(b"of somebody else")
    Path("out/swing.npz").symlink_to(config.parent / "away" / "old.npz")
    assert "outside its folder" in refused(config, "simulate", config, "--output", "out")["problem"]
    Path("out/swing.npz").unlink()
    Path("out/swing.npz").symlink_to("swing.npz")  # to itself
    assert refused(config, "simulate", config, "--output", "out")["problem"] == "is not a path"


def test_a_fit_does_not_write_over_its_inputs(config: Path) -> None:
    config.rename("fitted.toml")
    assert "fitted.toml" in refused(config, "fit", "fitted.toml", "--output", ".")["message"]
    sb.Recording.load("swing.npz").save("fit.npz")  # whose JSON is fit.json
    Path("fitted.toml").rename("my.toml")
    config.write_text(ROPE.replace("swing.npz", "fit.npz"))
    assert "fit.json" in refused(config, "fit", config, "--output", ".")["message"]
    Path("fit.json").unlink()  # and would be, if it were written
    assert "fit.json" in refused(config, "fit", config, "--output", ".")["message"]
    folder = config.parent / "out"
    folder.mkdir()
    (folder / "report.txt").symlink_to(config)
    assert "report.txt" in refused(config, "fit", config, "--output", "out")["message"]


def test_figures_do_not_write_over_inputs(config: Path) -> None:
    Path("out").mkdir()
    Path("out/swing_markers.svg").symlink_to(config.parent / "swing.npz")
    config.write_text(ROPE + '\n[output]\nfigures = "svg"\n')
    assert "swing_markers.svg" in refused(config, "fit", config, "--output", "out")["message"]
    Path("out/swing_markers.svg").unlink()
    result = run("fit", config, "--output", "out", "--json")
    assert result.exit_code == 0, result.output
    written = {p.name for p in Path("out").iterdir()}
    assert {"swing_markers.svg", "swing_residuals.svg", "estimates.svg"} < written
    for name in written:  # every file that a fit writes was checked before
        if name.startswith("journal") or name.startswith("."):
            continue
        Path("out", name).unlink()
        Path("out", name).symlink_to(config)
        assert name in refused(config, "fit", config, "--output", "out")["message"]
        Path("out", name).unlink()


def test_names_that_differ_in_case_alone_are_one_file(config: Path) -> None:
    config.write_text(ROPE + '\n[[recording]]\nfile = "swing.npz"\nname = "Swing"\n')
    for command in ("simulate", "fit"):
        assert "two files of one name" in refused(config, command, config)["problem"]


def test_meshes_do_not_write_over_meshes(config: Path) -> None:
    pytest.importorskip("trimesh")
    mesh = sb.mesh.grid(0.2, 0.2, 2, 2)
    Path("out/towel_cloth").mkdir(parents=True)
    for frame in range(11):
        sb.mesh.write_obj(f"out/towel_cloth/frame_{frame:05d}.obj", mesh)
    cloth = """\
[experiment]
name = "towel"
[[scene.cloth]]
name = "cloth"
density = 0.2
warp = 100.0
weft = 100.0
shear = 10.0
mesh = {kind = "file", file = "out/towel_cloth/frame_00003.obj", material = "texture"}
[solver]
h = 0.001
"""
    config.write_text(cloth)
    error = refused(config, "simulate", config, "--output", "out", "--mesh", "obj", "--duration", "0.1")
    assert "frame_00003.obj" in error["message"]


def test_textile_does_not_write_over_its_curves(config: Path) -> None:
    rows = "\n".join(f"{0.1 * k};{0.2 * k}" for k in range(20))
    for name in ("report.txt", "mean.csv"):
        Path(name).write_text(f"Weg [mm];Kraft [N]\n{rows}\n")
        error = refused(config, "textile", name, "--length", "20cm", "--width", "5cm", "--output", ".")
        assert name in error["message"]
        Path(name).unlink()


def test_a_trajectory_that_cannot_be_written_leaves_the_earlier_one(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("simulate", config).exit_code == 0
    whole = Path("out/swing/swing.npz").read_bytes()

    def full(file: Path, **arrays: np.ndarray) -> None:
        Path(file).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    result = run("simulate", config, "--json")
    assert result.exit_code == 2 and "No space left" in json.loads(result.stdout)["error"]["message"]
    assert Path("out/swing/swing.npz").read_bytes() == whole
    assert sorted(p.name for p in Path("out/swing").iterdir()) == [
        "predicted_swing.json",
        "predicted_swing.npz",
        "swing.npz",
    ]
