"""A sequence of meshes, as simulators write it, as a recording; and a sequence of PLY files out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli.app import app
from sheetbend.config import load
from sheetbend.errors import ConfigError, MeshError, RecordingError
from typer.testing import CliRunner

pytest.importorskip("trimesh")

MESH = sb.mesh.grid(0.2, 0.1, 4, 2, pattern="one_way")
TIMES = np.arange(11) / 50
TRUE = {"cloth_warp": 80.0, "cloth_shear": 8.0}
CLOTH = """
[experiment]
name = "flap"

[solver]
method = "newton"
substeps = 4

[[scene.cloth]]
density = 0.2
warp = 60.0
shear = 12.0
bending = 1e-3
drag_linear = 0.2
markers = "vertices"
shape = "recording"
pinned = ["left"]

[scene.cloth.mesh]
kind = "file"
file = "rest.obj"

[[scene.cloth.set]]
name = "left"
upper = [1e-3, 1, 1]

[[recording]]
file = "frames"

[parameters.cloth_warp]
[parameters.cloth_shear]
"""


def moved() -> np.ndarray:
    """(frames, vertices, 3) m of a flap that falls from a bent start."""
    scene = sb.Scene("flap")
    x = MESH.vertices + np.outer(0.02 * np.sin(8 * MESH.vertices[:, 0]), [0.0, 0.0, 1.0])
    left = np.flatnonzero(MESH.vertices[:, 0] < 1e-3)
    fabric = {name.removeprefix("cloth_"): value for name, value in TRUE.items()}
    cloth = sb.add_cloth(scene, MESH, density=0.2, bending=1e-3, drag_linear=0.2, held=left, positions=x, **fabric)
    scene.pin(cloth.particles[left])
    return sb.simulate(scene, TIMES, sb.Solver(h=1 / 200, method="newton")).positions


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Frames in mm, numbered without zeros, and the mesh at rest."""
    at = tmp_path_factory.mktemp("flap")
    (at / "frames").mkdir()
    for k, x in enumerate(moved()):
        sb.mesh.write_obj(at / "frames" / f"flap_{k}.obj", MESH, 1e3 * x)
    (at / "frames.json").write_text(json.dumps({"rate": 50, "units": "mm"}))
    sb.mesh.write_obj(at / "rest.obj", MESH)
    (at / "flap.toml").write_text(CLOTH)
    return at


def test_every_vertex_is_a_marker(folder: Path) -> None:
    frames = sb.Recording.load(folder / "frames")
    assert frames.positions == pytest.approx(moved(), abs=1e-9)
    assert frames.times == pytest.approx(TIMES)
    assert frames.markers[:2] == ("v0", "v1") and frames.name == "frames"


def test_a_fit_to_a_sequence(folder: Path) -> None:
    study = load(folder / "flap.toml")
    (e,) = study.experiments
    assert e.scene.positions == pytest.approx(moved()[0], abs=1e-9)
    found = sb.fit(
        study.experiments, parameters=study.parameters, **study.options | {"profiles": False, "refine": False}
    )
    for name, value in TRUE.items():
        assert found[name].value == pytest.approx(value, rel=1e-4)


def test_vertices_keep_their_markers_on_a_finer_mesh(folder: Path) -> None:
    config = CLOTH + "\n[fit]\ndouble_segments = true\n"
    (folder / "finer.toml").write_text(config)
    (fine,) = load(folder / "finer.toml").options["refine"].finer()
    where = [np.array(p.weights) @ fine.scene.positions[list(p.particles)] for p in fine.compared_places]
    assert len(fine.scene.positions) > 2 * len(MESH.vertices)
    held = MESH.vertices[:, 0] < 1e-3  # and not compared
    assert np.array(where) == pytest.approx(moved()[0][~held], abs=1e-9)


def test_what_is_no_sequence_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"holds no sequence of .obj or of .ply"):
        sb.Recording.load(tmp_path)
    frames = tmp_path / "frames"
    frames.mkdir()
    sb.mesh.write_obj(frames / "a_1.obj", MESH)
    with pytest.raises(RecordingError, match=r"does not say the rate.*into frames.json"):
        sb.Recording.load(frames)
    (tmp_path / "frames.json").write_text('{"rate": 25}')
    sb.mesh.write_obj(frames / "a_2.obj", sb.mesh.grid(0.2, 0.1, 2, 2))
    with pytest.raises(RecordingError, match=r"a_2.obj: has not as many vertices as a_1.obj, 15 \(got 9\)"):
        sb.Recording.load(frames)
    (frames / "a_2.obj").write_text("v 1 2\n")
    with pytest.raises(RecordingError, match=r"a_2.obj"):
        sb.Recording.load(frames)


def test_markers_on_vertices_want_the_sequences_mesh(folder: Path) -> None:
    grid = '[scene.cloth.mesh]\nkind = "grid"\nwidth = 0.2\nheight = 0.1\nnx = 4\nny = 2'
    (folder / "grid.toml").write_text(CLOTH.replace('[scene.cloth.mesh]\nkind = "file"\nfile = "rest.obj"', grid))
    with pytest.raises(ConfigError, match="mesh that is from no file"):
        load(folder / "grid.toml")
    sb.mesh.write_obj(folder / "other.obj", sb.mesh.grid(0.2, 0.1, 6, 2))
    (folder / "other.toml").write_text(CLOTH.replace("rest.obj", "other.obj"))
    with pytest.raises(ConfigError, match=r"are on 21 vertices, and the recording has \(got 15\)"):
        load(folder / "other.toml")


def test_a_sequence_of_ply(folder: Path, tmp_path: Path) -> None:
    x = moved()[:3]
    height = x[:, :, 2]
    files = sb.mesh.write_ply_sequence(tmp_path / "out", MESH, x, vertex_fields={"height": height})
    assert [f.name for f in files] == ["frame_00000.ply", "frame_00001.ply", "frame_00002.ply"]
    (tmp_path / "out.json").write_text('{"rate": 50}')
    assert sb.Recording.load(tmp_path / "out").positions == pytest.approx(x, abs=1e-12)
    assert b"property double height" in files[2].read_bytes()
    with pytest.raises(MeshError, match="another sequence"):
        sb.mesh.write_ply_sequence(tmp_path / "out", MESH, x[:2])
    with pytest.raises(MeshError, match=r"height.*wrong shape"):
        sb.mesh.write_ply_sequence(tmp_path / "more", MESH, x, vertex_fields={"height": height[0]})
    done = CliRunner().invoke(
        app, ["simulate", str(folder / "flap.toml"), "--mesh", "ply-sequence", "--output", str(tmp_path / "sim")]
    )
    assert done.exit_code == 0, done.output
    written = sorted((tmp_path / "sim" / "frames_cloth").iterdir())
    assert len(written) == len(TIMES) and b"property double strain_warp" in written[-1].read_bytes()
