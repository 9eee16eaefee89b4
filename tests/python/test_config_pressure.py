"""Pressure and kept volumes of cloths in configurations: what they build, a fit under pressure, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli.app import app
from sheetbend.config import load, parse, scene_alone
from sheetbend.scene.volume import enclosed_volume
from support import refusal
from typer.testing import CliRunner

pytestmark = pytest.mark.filterwarnings("ignore:.*warp direction jumps")  # as on every sphere

TRUE = {"warp": 140.0, "weft": 90.0, "shear": 40.0, "poisson": 0.3}  # N/m
PRESSURE = 200.0  # Pa
PLACES = {"a": [0.05, 0.05], "b": [0.1, 0.1], "c": [0.15, 0.1], "d": [0.1, 0.16]}
BULGE = f"""\
[experiment]
name = "bulge"

[solver]
method = "newton"

[scene]
gravity = [0, 0, 0]

[[scene.cloth]]
density = 0.2
warp = 100.0
weft = 90.0
shear = 40.0
poisson = 0.3
pressure = {PRESSURE}
pinned = ["left", "right", "bottom", "top"]
markers = {{ {", ".join(f"{name} = {place}" for name, place in PLACES.items())} }}

[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.2
nx = 6
ny = 6

[[recording]]
file = "bulge.npz"
sigma = 1e-4
static = true

[parameters.cloth_warp]
lower = 10.0
upper = 1e3

[output]
figures = "none"
"""
MATCHED = ("[output]", "[fit]\ndouble_segments = false\n\n[output]")  # recorded on the mesh that is fitted
BALLOON = """\
[experiment]
name = "balloon"

[solver]
h = 1e-3
method = "gauss_seidel"

[scene]
gravity = [0, 0, 0]

[[scene.cloth]]
density = 0.2
warp = 100.0
shear = 40.0
poisson = 0.3

[scene.cloth.mesh]
kind = "file"
file = "ball.obj"

[scene.cloth.volume]
rest = 6e-3
compliance = 1e-8
"""


def sheet(pressure: float) -> tuple[sb.Scene, sb.Cloth]:
    """What BULGE describes, with the fabric of TRUE."""
    mesh = sb.mesh.grid(0.2, 0.2, 6, 6, "one_way")
    rim = np.unique(mesh.borders)
    scene = sb.Scene("bulge", gravity=(0, 0, 0))
    cloth = sb.add_cloth(scene, mesh, density=0.2, held=rim, **TRUE)
    scene.pin(cloth.particles[rim])
    scene.add_pressure(cloth.particles[mesh.triangles], pressure)
    return scene, cloth


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a recording of the sheet at rest under its pressure: 20 frames with errors of 0.1 mm."""
    monkeypatch.chdir(tmp_path)
    scene, cloth = sheet(PRESSURE)
    rest = sb.equilibrium(scene).positions[None, cloth.particles]
    x = cloth.mesh.at(list(PLACES.values())).positions(rest)
    noise = 1e-4 * np.random.default_rng(5).standard_normal((20, *x.shape[1:]))
    times = np.arange(20) / 60
    sb.Recording(positions=x + noise, times=times, markers=tuple(PLACES), name="bulge").save(tmp_path / "bulge.npz")
    return tmp_path


def changed(folder: Path, text: str, *edits: tuple[str, str]) -> Path:
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "my.toml").write_text(text)
    return folder / "my.toml"


def alone(folder: Path, *edits: tuple[str, str]) -> sb.Scene:
    """The scene of BALLOON."""
    pytest.importorskip("trimesh")
    sb.mesh.write_obj(folder / "ball.obj", sb.mesh.icosphere(0.1, 1))
    scene, _ = scene_alone(parse(changed(folder, BALLOON, *edits)), folder)
    return scene


def test_pressure_is_that_of_add_pressure(folder: Path) -> None:
    (e,) = load(changed(folder, BULGE, ("warp = 100.0", "warp = 140.0"))).experiments
    by_hand, _ = sheet(PRESSURE)
    assert {n: q.value for n, q in e.scene.quantities.items()} == {n: q.value for n, q in by_hand.quantities.items()}
    np.testing.assert_allclose(e.scene.compiled.inputs(), by_hand.compiled.inputs(), rtol=1e-12, atol=1e-12)


def test_volume_is_that_of_add_volume(folder: Path) -> None:
    built = alone(folder)
    by_hand = sb.Scene("balloon", gravity=(0, 0, 0))
    mesh = sb.read_mesh(folder / "ball.obj")
    cloth = sb.add_cloth(by_hand, mesh, density=0.2, warp=100.0, shear=40.0, poisson=0.3)
    by_hand.add_volume(cloth.particles[mesh.triangles], rest=6e-3, compliance=1e-8)
    assert {n: q.value for n, q in built.quantities.items()} == {n: q.value for n, q in by_hand.quantities.items()}
    np.testing.assert_allclose(built.compiled.inputs(), by_hand.compiled.inputs(), rtol=1e-12, atol=1e-12)


def test_a_volume_may_be_an_empty_table(folder: Path) -> None:
    built = alone(folder, ("rest = 6e-3\ncompliance = 1e-8\n", ""))
    mesh = sb.read_mesh(folder / "ball.obj")
    assert built.quantities["cloth_volume"].value == enclosed_volume(mesh.triangles, mesh.vertices)
    assert "cloth_volume_compliance" not in built.quantities


def test_a_fit_finds_the_stiffness_under_a_given_pressure(folder: Path) -> None:
    result = CliRunner().invoke(app, ["fit", str(changed(folder, BULGE, MATCHED)), "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout.splitlines()[-1])["parameters"]["cloth_warp"]
    low, high = found["interval"]
    assert found["verdict"] == "identified"
    assert low < TRUE["warp"] < high
    assert high - low < 0.05 * TRUE["warp"]


def test_a_fit_finds_the_pressure_of_a_given_fabric(folder: Path) -> None:
    wanted = ("[parameters.cloth_warp]\nlower = 10.0\nupper = 1e3", "[parameters.cloth_pressure]\ninitial = 100.0")
    path = changed(folder, BULGE, ("warp = 100.0", "warp = 140.0"), wanted)
    found = sb.fit(*(study := load(path)).experiments, parameters=study.parameters, refine=False)
    assert found["cloth_pressure"].value == pytest.approx(PRESSURE, rel=0.02)


def recorded_balloon(folder: Path, line: str = "") -> str:
    """A configuration of BALLOON with a recording of its top, which does not move."""
    top = alone(folder).positions[None, :1]
    sb.Recording(np.repeat(top, 3, axis=0), np.arange(3) / 60, ("top",), name="ball").save(folder / "ball.npz")
    marker = '[[marker]]\nmarker = "top"\nparticle = "cloth:0"\n'
    return f'{BALLOON}\n[[recording]]\nfile = "ball.npz"\n{line}\n\n{marker}\n[parameters.cloth_shear]\n'


def test_a_closed_mesh_rests_under_pressure(folder: Path) -> None:
    volume = BALLOON[BALLOON.index("[scene.cloth.volume]") :]
    edits = (volume, ""), ("density = 0.2", "density = 0.2\npressure = 10.0")
    (e,) = load(changed(folder, recorded_balloon(folder, "static = true"), *edits)).experiments
    assert e.static
    assert e.scene.quantities["cloth_pressure"].value == 10.0


BAD = [
    ("pressure = 200.0", 'pressure = "high"', "scene.cloth[0].pressure", "a number"),
    ("[[recording]]", "[scene.cloth.volume]\n[[recording]]", "scene.cloth[0].pressure", "beside a volume"),
    ("pressure = 200.0", "volume = {}", "scene.cloth[0].volume.triangles", "not a closed surface"),
    ("pressure = 200.0", "volume = { rest = 0.0 }", "scene.cloth[0].volume.rest", "greater than 0"),
    ("pressure = 200.0", "volume = { compliance = -1.0 }", "scene.cloth[0].volume.compliance", "at least 0"),
    ('"bottom", "top"]', '"bottom"]', "recording[0].static", "pin or grip all of its rim"),
]


@pytest.mark.parametrize(("old", "new", "field", "words"), BAD)
def test_what_is_refused(folder: Path, old: str, new: str, field: str, words: str) -> None:
    with refusal(field, words, sb.ConfigError):
        load(changed(folder, BULGE, (old, new)))


def test_the_command_line_refuses_a_volume_before_it_starts(folder: Path) -> None:
    path = changed(folder, recorded_balloon(folder), ('"gauss_seidel"', '"implicit"'))
    for command in ("info", "simulate", "fit"):
        result = CliRunner().invoke(app, [command, str(path), "--json"])
        assert result.exit_code == 2, result.output
        error = json.loads(result.stdout.splitlines()[-1])["error"]
        assert error["field"] == "solver.method"
        assert "use newton" in error["fix"]
        assert not (folder / "out").exists()


def test_a_fit_finds_the_volume_of_a_balloon_at_rest(folder: Path) -> None:
    held = [[0.0, 0.0, 0.1], [0.0, 0.0, -0.1], [0.1, 0.0, 0.0]]
    pins = f'pinned = ["some"]\nset = [{{ name = "some", points = {held} }}]\n\n[scene.cloth.mesh]'
    scene = alone(folder, ("[scene.cloth.mesh]", pins))
    rest = sb.equilibrium(scene)
    seen = scene.free[::5]
    assert rest.pressures["cloth"] > 100.0
    frames = np.repeat(rest.positions[None, seen], 3, axis=0)
    names = tuple(f"m{k}" for k in range(len(seen)))
    sb.Recording(frames, np.arange(3) / 60, names, name="ball").save(folder / "ball.npz")
    markers = "".join(
        f'[[marker]]\nmarker = "{name}"\nparticle = "cloth:{k}"\n' for name, k in zip(names, seen, strict=True)
    )
    recording = '[[recording]]\nfile = "ball.npz"\nstatic = true\nsigma = 1e-5\n\n'
    text = BALLOON.replace("[scene.cloth.mesh]", pins).replace("rest = 6e-3", "rest = 5e-3")
    path = changed(folder, f"{text}\n{recording}{markers}\n[parameters.cloth_volume]\n")
    result = CliRunner().invoke(app, ["fit", str(path), "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout.splitlines()[-1])["parameters"]["cloth_volume"]
    assert found["value"] == pytest.approx(6e-3, rel=1e-6)


@pytest.mark.parametrize("method", ["gauss_seidel", "newton"])
def test_a_balloon_that_keeps_its_volume_is_simulated(folder: Path, method: str) -> None:
    path = changed(folder, recorded_balloon(folder), ('"gauss_seidel"', f'"{method}"'))
    result = CliRunner().invoke(app, ["simulate", str(path), "--json"])
    assert result.exit_code == 0, result.output
    with np.load(folder / "out/balloon/ball.npz") as motion:
        last, pressure = motion["positions"][-1], motion["pressure_cloth"]
    triangles = sb.read_mesh(folder / "ball.obj").triangles
    assert enclosed_volume(triangles, last) == pytest.approx(6e-3, rel=0.01)
    assert pressure.shape == (3,)
    assert pressure[-1] > 0.0
