"""The way of each kind of user, with nothing but what the documentation says: its scripts and its commands as they
stand, in an empty folder."""

from __future__ import annotations

import json
import re
import struct
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from commands import run
from test_whole_fabric import pull, wavy

DOCS = Path(__file__).resolve().parents[2] / "docs"


def blocks(page: str, language: str, heading: str = "") -> list[str]:
    """Code of a page, from a heading on to the next one of its kind; of the whole page without."""
    text = (DOCS / page).read_text()
    if heading:
        _, _, text = text.partition(f"\n## {heading}\n")
        assert text, heading
        text = text.partition("\n## ")[0]
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def commands(page: str, heading: str = "") -> list[list[str]]:
    """Arguments of the commands in a page's only block for a shell."""
    (block,) = blocks(page, "sh", heading)
    lines = [line.split() for line in block.splitlines()]
    assert all(line[0] == "sheetbend" for line in lines)
    return [line[1:] for line in lines]


def run_script(block: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(block, "documentation", "exec"), names)
    return names


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_garment_goes_to_gltf_in_two_commands(folder: Path) -> None:
    page = "tutorials/garment.md"
    (script,), (seen,) = blocks(page, "python"), blocks(page, "text")
    run_script(script)
    new, simulate = commands(page)
    first = run(*new)
    assert first.exit_code == 0 and seen in first.stdout
    assert f"next: sheetbend {' '.join(simulate)}" in first.stdout
    done = run(*simulate)
    assert done.exit_code == 0, done.output
    content = (folder / "out/skirt/skirt.glb").read_bytes()
    (length,) = struct.unpack("<I", content[12:16])
    (mesh,) = json.loads(content[20 : 20 + length])["meshes"]
    assert len(mesh["primitives"][0]["targets"]) > 50  # it moves
    motion = np.load(folder / "out/skirt/skirt.npz")
    x = motion["positions"]
    top = x[0, :, 1] > 0.985
    assert top.sum() == 24 and np.array_equal(x[-1, top], x[0, top])
    assert 1e-3 < np.linalg.norm(x[-1] - x[0], axis=1).max() < 0.3  # and hangs


@pytest.mark.parametrize(("unit", "scale"), [("cm", 100.0), ("mm", 1000.0)])
def test_the_unit_of_a_garment_is_told_by_its_size(folder: Path, unit: str, scale: float) -> None:
    mesh = sb.mesh.grid(0.4, 0.6, 4, 6)
    sb.mesh.write_obj(folder / "panel.obj", mesh, scale * mesh.vertices)
    result = run("new", "panel.obj")
    assert result.exit_code == 0 and f"lengths are taken as {unit}" in result.stdout
    assert "0.4 x 0.6 x 0 m, 0.24 m^2 of fabric" in result.stdout
    assert "5 vertices lie within" in result.stdout


def test_pieces_of_a_garment_that_fall_are_told(folder: Path) -> None:
    """Two panels that share no vertex, one below the other, each face twice, as a two-sided export has them."""
    panel = sb.mesh.grid(0.4, 0.6, 4, 6)
    both = np.concatenate([panel.vertices, panel.vertices - [0, 0.7, 0]])
    faces = np.concatenate([panel.triangles, panel.triangles + len(panel.vertices)]) + 1
    lines = [f"v {x} {y} {z}" for x, y, z in both] + [f"f {a} {b} {c}\nf {c} {b} {a}" for a, b, c in faces]
    (folder / "panels.obj").write_text("\n".join(lines))
    result = run("new", "panels.obj")
    assert result.exit_code == 0 and "70 vertices, 96 triangles" in result.stdout
    assert "96 triangles that repeat others are left out" in result.output
    assert "what joins its 2 pieces: 1 of them hang" in result.stdout


@pytest.mark.parametrize(("up", "gravity", "corner"), [("x", -9.81, "lower"), ("-x", 9.81, "upper")])
def test_the_axis_of_a_garment_that_points_up_is_told(folder: Path, up: str, gravity: float, corner: str) -> None:
    sb.mesh.write_obj(folder / "panel.obj", sb.mesh.grid(0.4, 0.6, 4, 6))
    result = run("new", "panel.obj", "--up", up)
    assert result.exit_code == 0 and "7 vertices lie within" in result.stdout and "which axis" not in result.stdout
    draft = tomllib.loads((folder / "panel.toml").read_text())
    assert draft["scene"]["gravity"] == [gravity, 0.0, 0.0] and corner in draft["scene"]["cloth"][0]["set"][0]
    assert run("simulate", "panel.toml", "--duration", "0.05").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["panel.obj", "--length", "1"], "--length"),
        (["panel.obj", "panel.obj"], "give one mesh"),
        (["panel.obj", "--units", "inch"], "--units"),
        (["large.obj"], "--units: is in doubt"),
        (["none.obj"], "is not a file"),
    ],
)
def test_what_is_wrong_with_a_garment_is_named(folder: Path, arguments: list[str], words: str) -> None:
    mesh = sb.mesh.grid(0.4, 0.6, 2, 2)
    sb.mesh.write_obj(folder / "panel.obj", mesh)
    sb.mesh.write_obj(folder / "large.obj", mesh, 1e5 * mesh.vertices)
    result = run("new", *arguments, "--output", "draft.toml")
    assert result.exit_code == 2 and words in result.stderr and "Fix:" in result.stderr
    assert not (folder / "draft.toml").exists()


@pytest.mark.slow
def test_a_policy_is_trained_in_forty_lines(folder: Path) -> None:
    (script,) = blocks("tutorials/learning.md", "python", "A feedback policy in 40 lines")
    assert len(script.splitlines()) <= 40
    worst = run_script(script)["worst"]
    assert len(worst) == 200 and float((worst < 0.02).float().mean()) > 0.9


@pytest.mark.slow
def test_a_rope_of_mujoco_in_three_commands(folder: Path) -> None:
    """One marker in the hand, 0.5 mm of noise in each coordinate; new, fit, and a prediction of the next 3 s.

    Measured: EI 0.3 %, drag 0.04 % and the time constant of the bending damping 2.6 % off, inside their intervals, and
    the prediction by 1.03 mm, of which the markers' own noise is 0.86 (1.15 mm on the mesh of the fit).
    """
    pytest.importorskip("mujoco")
    import mujoco_rope as truth

    times, x = truth.motion(6.5)
    markers = x[:, ::3] + np.random.default_rng(0).normal(0.0, 5e-4, x[:, ::3].shape)
    sb.Recording(markers, times, name="take").save("take.csv")
    for command in commands("tutorials/one_hand.md", "What comes out"):
        done = run(*command)
        assert done.exit_code == 0, done.output
    fit = sb.FitResult.load("out/take/fit.json")
    for name, true in {
        "rope_EI": truth.EI,
        "rope_bend_damping": truth.DAMPING,
        "rope_drag_linear": truth.DRAG,
    }.items():
        assert fit[name].verdict == "identified", name
        assert fit[name].lower < true < fit[name].upper, name
        assert fit[name].value == pytest.approx(true, rel=0.03 if name == "rope_bend_damping" else 0.01), name
    predicted = sb.Recording.load("out/predicted/predicted_take.npz").piece(3.4, 6.4)
    seen = sb.Recording.load("take.csv").select(predicted.markers).piece(3.4, 6.4)
    error = np.sqrt(np.mean(np.sum((predicted.positions - seen.positions) ** 2, axis=2)))
    assert error < 1.12e-3  # 1.3 times the noise


@pytest.mark.slow
def test_a_fabric_in_one_command(folder: Path) -> None:
    """The file of tests that the page shows, with what it names: pulls of Fung's law, and a drape like the other
    readings'."""
    for k, share in enumerate((0.98, 1.0, 1.02), 1):
        pull(Path(f"warp_{k}.csv"), 600.0, 150.0, share)
    pull(Path("weft.csv"), 350.0, 150.0, 1.0)
    np.savetxt("drape_1.csv", 1e3 * wavy(mean=0.138, wave=0.006), fmt="%.2f", delimiter=",")
    text, scene = blocks("fabric.md", "toml")
    Path("tests.toml").write_text(text)
    (command,) = commands("fabric.md")
    done = run(*command, "--json")
    assert done.exit_code == 0, done.stderr
    found = {e["name"]: e for e in json.loads(done.stdout)["estimates"]}
    for name, true in {"warp": 600.0, "weft": 350.0, "density": 0.2}.items():
        assert found[name]["lower"] < true < found[name]["upper"], name
        assert found[name]["value"] == pytest.approx(true, rel=0.1), name
    assert Path(tomllib.loads(scene)["scene"]["cloth"][0]["fabric_file"]).is_file()
