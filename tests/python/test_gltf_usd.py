"""Motions as glTF and USD: other programs read them back as they were simulated."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from scipy.spatial.transform import Rotation
from sheetbend.cli.app import app
from sheetbend.pictures.gltf import MOST_FRAMES, write_gltf
from sheetbend.pictures.moving_shapes import tube
from sheetbend.pictures.usd import write_usd
from typer.testing import CliRunner


@pytest.fixture(scope="module")
def scene() -> sb.Scene:
    """A cloth and a rope, hanging."""
    scene = sb.Scene("flag and line")
    mesh = sb.mesh.grid(0.2, 0.1, 4, 2, pattern="one_way")
    sb.add_cloth(scene, mesh, density=0.1, warp=50.0, shear=10.0, held=[0, 5])
    rope = sb.add_rope(scene, length=0.3, segments=6, density=0.05, EI=1e-3, start=(0.0, 0.5, 0.0))
    scene.pin(rope.particles[:1])
    return scene


@pytest.fixture(scope="module")
def motion(scene: sb.Scene) -> sb.Trajectory:
    return sb.simulate(scene, np.arange(6) / 50, sb.Solver(h=1 / 200))


class Glb:
    """Just enough of a reader of binary glTF."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        magic, version, total = struct.unpack_from("<4sII", data)
        assert (magic, version, total) == (b"glTF", 2, len(data)) and total % 4 == 0
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json = json.loads(data[20 : 20 + size])
        length, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and length + size + 28 == total
        self.binary = data[28 + size :]

    def array(self, index: int) -> np.ndarray:
        a = self.json["accessors"][index]
        view = self.json["bufferViews"][a["bufferView"]]
        columns = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[a["componentType"]]
        assert view["byteOffset"] % 4 == 0 and view["byteLength"] == 4 * columns * a["count"]
        return np.frombuffer(self.binary, kind, columns * a["count"], view["byteOffset"]).reshape(-1, columns)


class TestGltf:
    def test_every_frame_is_the_simulated_one(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        assert write_gltf(tmp_path / "m.glb", scene, motion) == 6
        file = Glb(tmp_path / "m.glb")
        cloth = scene.cloths["cloth"]
        (sheet,) = (m["primitives"][0] for m in file.json["meshes"] if m["name"] == "cloth")
        base = file.array(sheet["attributes"]["POSITION"])
        np.testing.assert_array_equal(file.array(sheet["indices"]).reshape(-1, 3), cloth.mesh.triangles)
        np.testing.assert_allclose(file.array(sheet["attributes"]["TEXCOORD_0"]), cloth.mesh.material, atol=1e-7)
        (animation,) = file.json["animations"]
        sampler = animation["samplers"][animation["channels"][0]["sampler"]]
        np.testing.assert_allclose(file.array(sampler["input"])[:, 0], motion.times, atol=1e-7)
        weights = file.array(sampler["output"]).reshape(6, 5)
        targets = np.array([file.array(t["POSITION"]) for t in sheet["targets"]])
        for k in range(6):
            shown = base + np.tensordot(weights[k], targets, axes=1)
            np.testing.assert_allclose(shown, motion.positions[k, cloth.particles], atol=1e-6)

    def test_z_is_up(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        """The root's quaternion turns z to y, which is up in glTF."""
        write_gltf(tmp_path / "m.glb", scene, motion)
        x, y, z, w = Glb(tmp_path / "m.glb").json["nodes"][0]["rotation"]
        q, v = np.array([x, y, z]), np.array([0.0, 0.0, 1.0])
        turned = v + 2 * np.cross(q, np.cross(q, v) + w * v)
        np.testing.assert_allclose(turned, [0, 1, 0], atol=1e-12)

    @pytest.mark.parametrize("axis", [0, 1, 2])
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_what_is_up_in_the_scene_is_up_in_the_file(self, axis: int, sign: float, tmp_path: Path) -> None:
        """A garment from an OBJ file, y up, lay on its side."""
        up = sign * np.eye(3)[axis]
        scene = sb.Scene(gravity=-9.81 * up)
        scene.pin(sb.add_rope(scene, length=0.3, segments=6, density=0.05, EI=1e-3).particles[:1])
        motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=1 / 200))
        write_gltf(tmp_path / "m.glb", scene, motion)
        turn = Rotation.from_quat(Glb(tmp_path / "m.glb").json["nodes"][0]["rotation"])
        np.testing.assert_allclose(turn.apply(up), [0.0, 1.0, 0.0], atol=1e-12)
        usd, geometry = pytest.importorskip("pxr.Usd"), pytest.importorskip("pxr.UsdGeom")
        write_usd(tmp_path / "m.usda", scene, motion)
        stage = usd.Stage.Open(str(tmp_path / "m.usda"))
        turned = geometry.Xformable(stage.GetDefaultPrim()).GetLocalTransformation().TransformDir(tuple(up))
        upward = {"Y": [0.0, 1.0, 0.0], "Z": [0.0, 0.0, 1.0]}[geometry.GetStageUpAxis(stage)]
        np.testing.assert_allclose(turned, upward, atol=1e-6)

    def test_another_reader_takes_it(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        trimesh = pytest.importorskip("trimesh")
        write_gltf(tmp_path / "m.glb", scene, motion)
        loaded = trimesh.load(tmp_path / "m.glb")
        assert set(loaded.geometry) == {"cloth", "rope"}
        assert loaded.geometry["cloth"].faces.shape == scene.cloths["cloth"].mesh.triangles.shape

    def test_long_motions_are_thinned(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        n = MOST_FRAMES + 60
        x = np.repeat(motion.positions[:1], n, axis=0)
        long = sb.Trajectory(np.arange(n) / 10, x, np.zeros_like(x), {})
        assert write_gltf(tmp_path / "m.glb", scene, long) == MOST_FRAMES
        still = sb.Trajectory(long.times[:1], x[:1], x[:1], {})
        assert write_gltf(tmp_path / "s.glb", scene, still) == 1
        assert "animations" not in Glb(tmp_path / "s.glb").json

    def test_bad_input(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        with pytest.raises(sb.InputError, match=r"ends in .glb"):
            write_gltf(tmp_path / "m.obj", scene, motion)
        bare = sb.Scene("bare")
        bare.add_particles([[0, 0, 0]], 1.0)
        with pytest.raises(sb.InputError, match="neither cloth nor solid nor rope"):
            write_gltf(tmp_path / "m.glb", bare, sb.simulate(bare, [0.0]))


def test_a_tube_is_round_and_closed_around() -> None:
    t = np.linspace(0.0, 3.0, 40)
    line = np.stack([np.cos(t), np.sin(t), 0.2 * t], axis=1)[None]
    surface, triangles = tube(line, 0.01, 8)
    away = np.linalg.norm(surface.reshape(40, 8, 3) - line[0][:, None], axis=2)
    np.testing.assert_allclose(away, 0.01, rtol=1e-9)
    corners = np.repeat([[[0.0, 0.0], [1, 0], [0, 1]]], len(triangles), axis=0)
    mesh = sb.TriangleMesh(surface[0], triangles, corners)
    assert len(mesh.boundary) == 2 and {len(loop) for loop in mesh.boundary} == {8}
    x = surface[0][triangles]
    outward = x.mean(axis=1) - np.repeat((line[0][1:] + line[0][:-1]) / 2, 8, axis=0)[np.tile(np.arange(312), 2)]
    assert ((np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) * outward).sum(axis=1) > 0).all()  # they face outward


class TestUsd:
    def test_time_samples_attributes_and_units(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        usd, geometry = pytest.importorskip("pxr.Usd"), pytest.importorskip("pxr.UsdGeom")
        assert write_usd(tmp_path / "m.usda", scene, motion) == 6
        assert [p.name for p in tmp_path.iterdir()] == ["m.usda"]
        stage = usd.Stage.Open(str(tmp_path / "m.usda"))
        assert geometry.GetStageUpAxis(stage) == "Z" and geometry.GetStageMetersPerUnit(stage) == 1.0
        rate, root = stage.GetTimeCodesPerSecond(), stage.GetDefaultPrim()
        cloth = geometry.Mesh(root.GetChild("cloth"))
        own = scene.cloths["cloth"]
        samples = cloth.GetPointsAttr().GetTimeSamples()
        np.testing.assert_allclose(np.array(samples) / rate, motion.times, atol=1e-9)
        x, v = (np.array(a.Get(samples[3])) for a in (cloth.GetPointsAttr(), cloth.GetVelocitiesAttr()))
        np.testing.assert_allclose(x, motion.positions[3, own.particles], atol=1e-6)
        np.testing.assert_allclose(v, motion.velocities[3, own.particles], atol=1e-6)
        strain = geometry.PrimvarsAPI(cloth).GetPrimvar("strain")
        largest = sb.plot.largest_strain(own.mesh, motion.positions[3, own.particles])
        assert strain.GetInterpolation() == "uniform"
        np.testing.assert_allclose(np.array(strain.Get(samples[3])), largest, atol=1e-6)
        rope = geometry.BasisCurves(root.GetChild("rope"))
        x = np.array(rope.GetPointsAttr().Get(samples[5]))
        np.testing.assert_allclose(x, motion.positions[5, scene.ropes["rope"].particles], atol=1e-6)
        assert root.GetAttribute("sheetbend:cloth_warp").Get() == 50.0
        assert root.GetAttribute("sheetbend:cloth_warp").GetDocumentation() == "N/m"

    def test_bad_names(self, scene: sb.Scene, motion: sb.Trajectory, tmp_path: Path) -> None:
        with pytest.raises(sb.InputError, match="not a USD file"):
            write_usd(tmp_path / "m.obj", scene, motion)


def test_a_garment_goes_to_gltf_in_one_command(tmp_path: Path) -> None:
    (tmp_path / "flag.toml").write_text(
        """
[experiment]
name = "flag"
[[scene.cloth]]
density = 0.1
warp = 50.0
shear = 10.0
pinned = ["left"]
[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.1
nx = 4
ny = 2
"""
    )
    arguments = ["simulate", str(tmp_path / "flag.toml"), "--duration", "0.1", "--output", str(tmp_path)]
    done = CliRunner().invoke(app, [*arguments, "--mesh", "gltf"])
    assert done.exit_code == 0, done.output
    assert Glb(tmp_path / "flag.glb").json["meshes"][0]["name"] == "cloth"
