"""Cloth in configurations: what [[scene.cloth]] builds, how markers and grips sit on it, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli.app import app
from sheetbend.config import load, parse, scene_alone
from sheetbend.config.values import with_values, write
from sheetbend.pictures.strain import green_strain
from support import refusal
from typer.testing import CliRunner

CLOTH = """\
[experiment]
name = "sheet"

[solver]
substeps = 2

[[scene.cloth]]
density = 0.2
warp = 100.0
weft = 60.0
shear = 15.0
poisson = 0.2
bending = 1e-3
membrane_damping = 0.004
drag_linear = 0.2
origin = [0, 0, 1]
y_axis = [0, 0, 2]
pinned = ["left"]
markers = { a = [0.2, 0.0], b = [0.2, 0.1], c = [0.1, 0.05] }

[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.1
nx = 4
ny = 2

[[recording]]
file = "sheet.npz"
sigma = 1e-4

[parameters.cloth_shear]
lower = 0.1
upper = 1e3

[output]
figures = "none"
"""
AXIS, SPEED = "y_axis = [0, 0, 2]", 'velocity = "recording"'
PLACED = np.array([[0.2, 0.0, 1.0], [0.2, 0.0, 1.1], [0.1, 0.0, 1.05]])  # of a, b and c at the start


def scene(shear: float, **options: float) -> tuple[sb.Scene, sb.Cloth]:
    """What CLOTH describes."""
    flat = sb.mesh.grid(0.2, 0.1, 4, 2, "one_way")
    upright = np.array([0, 0, 1]) + flat.vertices[:, [0, 2, 1]]
    mesh = sb.TriangleMesh(upright, flat.triangles, flat.material, flat.sets)
    built = sb.Scene("sheet")
    fabric = {"warp": 100.0, "weft": 60.0, "shear": shear, "poisson": 0.2, "bending": 1e-3}
    damped = {"membrane_damping": 0.004, "drag_linear": 0.2}
    cloth = sb.add_cloth(built, mesh, density=0.2, held=mesh.sets["left"], **fabric, **damped, **options)
    built.pin(cloth.particles[mesh.sets["left"]])
    return built, cloth


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a recording of the sheet sinking under its weight, of shear stiffness 10 N/m."""
    monkeypatch.chdir(tmp_path)
    built, cloth = scene(10.0)
    motion = sb.simulate(built, np.arange(13) / 60, sb.Solver(h=1 / 120))
    x = cloth.mesh.at([[0.2, 0.0], [0.2, 0.1], [0.1, 0.05]]).positions(motion.positions[:, cloth.particles])
    noise = 1e-4 * np.random.default_rng(3).standard_normal(x.shape)
    noise[0] = 0.0
    sb.Recording(positions=x + noise, times=motion.times, markers=("a", "b", "c"), name="sheet").save(
        tmp_path / "sheet.npz"
    )
    return tmp_path


def changed(folder: Path, *edits: tuple[str, str]) -> Path:
    text = CLOTH
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "my.toml").write_text(text)
    return folder / "my.toml"


def run(*arguments: object) -> dict:
    result = CliRunner().invoke(app, [*(str(a) for a in arguments), "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    "options",
    [{}, {"yield_curvature": 20.0, "yield_share": 0.4}, {"warp_size": 1.01, "weft_size": 0.99}],
    ids=["", "yields", "sizes"],
)
def test_it_is_the_scene_of_add_cloth(folder: Path, options: dict[str, float]) -> None:
    keys = "".join(f"\n{key} = {value}" for key, value in options.items())
    (e,) = load(changed(folder, ("bending = 1e-3", f"bending = 1e-3{keys}"))).experiments
    by_hand, cloth = scene(15.0, **options)
    assert e.scene.positions == pytest.approx(by_hand.positions, abs=1e-12)
    assert {n: q.value for n, q in e.scene.quantities.items()} == {n: q.value for n, q in by_hand.quantities.items()}
    assert e.scene.pinned == by_hand.pinned
    assert {n for n in by_hand.pinned if n >= 0} == set(cloth.particles[cloth.mesh.sets["left"]].tolist())
    np.testing.assert_allclose(e.scene.compiled.inputs(), by_hand.compiled.inputs(), rtol=1e-12, atol=1e-12)


def test_markers_by_material_coordinates_and_nearest(folder: Path) -> None:
    given = "markers = { a = [0.2, 0.0], b = [0.2, 0.1], c = [0.1, 0.05] }"
    for text in (given, "nearest_at = 0.0"):
        (e,) = load(changed(folder, (given, text))).experiments
        where = [np.array(p.weights) @ e.scene.positions[list(p.particles)] for p in e.compared_places]
        assert e.names == ("a", "b", "c")
        np.testing.assert_allclose(where, PLACED, atol=1e-9)


@pytest.mark.parametrize("bar", ['"c"', "2"], ids=["by name", "by number"])
def test_a_marker_that_moves_a_grip_is_not_compared(folder: Path, bar: str) -> None:
    recording = sb.Recording.load(folder / "sheet.npz")
    positions = recording.positions.copy()
    positions[:, 2] = [0.001, 0.001, 1.05]  # beside the bar, by the noise of a camera
    sb.Recording(positions, recording.times, recording.markers).save(folder / "sheet.npz")
    grip = f'[[scene.cloth.grip]]\nset = "left"\nmarkers = [{bar}]\n\n[[recording]]'
    nearest = (MARKERS, "nearest_at = 0.0")
    (e,) = load(changed(folder, ('pinned = ["left"]\n', ""), nearest, ("[[recording]]", grip))).experiments
    assert e.names == ("a", "b")


def test_a_marker_table_goes_before_the_cloths_own(folder: Path) -> None:
    table = '[[recording.marker]]\nmarker = "c"\nmaterial = [0.15, 0.05]\n\n[parameters.cloth_shear]'
    (e,) = load(changed(folder, ("[parameters.cloth_shear]", table))).experiments
    place = e.places[2]
    assert place is not None
    assert np.array(place.weights) @ e.scene.positions[list(place.particles)] == pytest.approx([0.15, 0, 1.05])


def test_sets_by_box_points_and_markers(folder: Path) -> None:
    sets = """
    [[scene.cloth.set]]
    name = "right_half"
    lower = [0.09, -1, -1]
    [[scene.cloth.set]]
    name = "middle"
    points = [[0.11, 0.3, 1.04]]
    [[scene.cloth.set]]
    name = "tips"
    markers = ["b", "a"]
    [[scene.cloth.set]]
    name = "patch"
    points = [[0.0, 0.0, 1.0]]
    radius = 0.06
    [[scene.point_mass]]
    name = "hung"
    particle = "cloth:tips:1"
    mass = 0.01
    """
    (e,) = load(changed(folder, ("[[recording]]", f"{sets}\n[[recording]]"))).experiments
    cloth = e.scene.cloths["cloth"]
    x = {name: cloth.mesh.vertices[ids] for name, ids in cloth.mesh.sets.items()}
    assert len(x["right_half"]) == 9 and x["right_half"][:, 0].min() == pytest.approx(0.1)
    assert x["middle"] == pytest.approx(np.array([[0.1, 0, 1.05]]))
    near = np.linalg.norm(cloth.mesh.vertices - [0.0, 0.0, 1.0], axis=1) <= 0.06
    assert x["patch"] == pytest.approx(cloth.mesh.vertices[near]) and len(x["patch"]) == 3
    assert x["tips"] == pytest.approx(PLACED[[1, 0]])
    (heavy,) = (t.index for t in e.scene.terms if t.factors[0][0] == "hung_mass")
    assert e.scene.positions[heavy] == pytest.approx(PLACED[0])


def test_a_grip_follows_the_line_through_its_markers(folder: Path) -> None:
    grip = '[[scene.cloth.grip]]\nset = "right"\nmarkers = ["a", "b"]\n\n[[recording]]'
    (e,) = load(changed(folder, ("[[recording]]", grip))).experiments
    measured = sb.Recording.load(folder / "sheet.npz").positions
    driven = e.scene.base_arrays()["boundary"]
    ends = driven[:, [0, 2]]
    np.testing.assert_allclose(ends, measured[:, :2], atol=1e-12)
    np.testing.assert_allclose(driven[:, 1], ends.mean(axis=1), atol=1e-12)
    assert e.names == ("c",)


def test_a_grip_of_one_marker_keeps_its_distance(folder: Path) -> None:
    grip = '[[scene.cloth.grip]]\nset = "right"\nmarkers = ["c"]\n\n[[recording]]'
    (e,) = load(changed(folder, ("[[recording]]", grip))).experiments
    measured = sb.Recording.load(folder / "sheet.npz").positions[:, 2]
    x = e.scene.cloths["cloth"].mesh.vertices[e.scene.cloths["cloth"].mesh.sets["right"]]
    np.testing.assert_allclose(
        e.scene.base_arrays()["boundary"], x + (measured - measured[0])[:, None], rtol=0, atol=1e-12
    )


AIR = "drag_linear = 0.2\nair_normal = 0.7\nair_tangential = 0.02\n"
WIND = "[scene.wind]\nvelocity = [0.5, 2.0, 0.0]\n\n[[recording]]"
GUST = "[scene.wind]\nvelocity = [[0.0, 0.0, 0.0], [0.5, 2.0, 0.0]]\ntimes = [0.0, 0.1]\n\n[[recording]]"


@pytest.mark.parametrize("wind", [WIND, GUST, "[[recording]]"])
def test_air_is_that_of_add_air(folder: Path, wind: str) -> None:
    (e,) = load(changed(folder, ("drag_linear = 0.2\n", AIR), ("[[recording]]", wind))).experiments
    by_hand, cloth = scene(15.0)
    given = {WIND: {"wind": [0.5, 2, 0]}, GUST: {"wind": [[0, 0, 0], [0.5, 2, 0]], "times": [0, 0.1]}}.get(wind, {})
    by_hand.add_air(cloth.particles[cloth.mesh.triangles], 0.7, 0.02, **given)
    assert {n: q.value for n, q in e.scene.quantities.items()} == {n: q.value for n, q in by_hand.quantities.items()}
    np.testing.assert_allclose(e.scene.compiled.inputs(), by_hand.compiled.inputs(), rtol=1e-12, atol=1e-12)


def test_wind_and_coefficients_start_where_their_parameters_do(folder: Path) -> None:
    wanted = "[parameters.wind_y]\ninitial = 3.0\n\n[parameters.cloth_air_normal]\ninitial = 0.5\n\n[output]"
    edits = ("drag_linear = 0.2\n", AIR), ("[[recording]]", WIND), ("[output]", wanted)
    (e,) = load(changed(folder, *edits)).experiments
    values = {name: q.value for name, q in e.scene.quantities.items()}
    assert (values["wind_x"], values["wind_y"], values["cloth_air_normal"]) == (0.5, 3.0, 0.5)


def test_a_wind_that_starts_from_zero_has_an_equilibrium(folder: Path) -> None:
    at_rest = ("sigma = 1e-4", 'sigma = 1e-4\nstart = "equilibrium"')
    load(changed(folder, ("drag_linear = 0.2\n", AIR), ("[[recording]]", GUST), at_rest))
    with pytest.raises(sb.ConfigError, match="state of rest") as caught:
        load(changed(folder, ("drag_linear = 0.2\n", AIR), ("[[recording]]", WIND), at_rest))
    assert caught.value.field == "recording[0].start"


@pytest.mark.parametrize(
    ("wind", "field", "fix"),
    [
        ("velocity = [1, 2]", "scene.wind.velocity", "3"),
        ("velocity = [[1, 2, 3], [4, 5, 6]]", "scene.wind", "give the time of each"),
        ("velocity = [1, 2, 3]\ntimes = [0, 1]", "scene.wind", "not one velocity at each of its 2 times"),
        ("velocity = [[1, 2, 3], [4, 5, 6]]\ntimes = [1, 0]", "scene.wind.times", "must increase"),
        ("speed = 3.0", "scene.wind.speed", "did you mean 'velocity'?"),
    ],
)
def test_winds_that_are_refused(folder: Path, wind: str, field: str, fix: str) -> None:
    table = f"[scene.wind]\n{wind}\n\n[[recording]]"
    with refusal(field, fix, sb.ConfigError):
        load(changed(folder, ("drag_linear = 0.2\n", AIR), ("[[recording]]", table)))


@pytest.mark.parametrize(
    ("law", "quantity"),
    [
        ('kind = "exponential"\nwarp = 20.0\nweft = 10.0\nshear = 5.0', "cloth_weft_stiffening"),
        ('kind = "sinh"\nwarp = 20.0\nweft = 10.0\nshear = 5.0', "cloth_weft_stiffening"),
        ('kind = "spline"\nspacing = [0.05, 0.05, 0.1]\nweft = [2.0, 10.0, 4.0, 5.0]', "cloth_weft_ratio_2"),
    ],
)
def test_laws(folder: Path, law: str, quantity: str) -> None:
    (e,) = load(changed(folder, ("[[recording]]", f"[scene.cloth.law]\n{law}\n\n[[recording]]"))).experiments
    assert e.scene.quantities[quantity].value == 10.0


def test_the_refit_has_twice_the_cells_and_the_same_references(folder: Path) -> None:
    mass = '[[scene.point_mass]]\nname = "hung"\nparticle = "cloth:14"\nmass = 0.01\n\n[[recording]]'
    path = changed(folder, ("[[recording]]", mass), ("[output]", "[fit]\ndouble_segments = true\n\n[output]"))
    study = load(path)
    (coarse,), (fine,) = study.experiments, study.options["refine"].finer()
    assert len(fine.scene.cloths["cloth"].mesh.triangles) == 4 * len(coarse.scene.cloths["cloth"].mesh.triangles)
    heavy = [
        e.scene.positions[t.index] for e in (coarse, fine) for t in e.scene.terms if t.factors[0][0] == "hung_mass"
    ]
    assert heavy[0] == pytest.approx(heavy[1]) and len(fine.scene.pinned) == 5


def test_a_mesh_from_a_file_is_split_and_keeps_its_path(folder: Path) -> None:
    pytest.importorskip("trimesh")
    sb.mesh.write_obj(folder / "disk.obj", sb.mesh.disk(0.1, 4))
    mesh = 'kind = "grid"\nwidth = 0.2\nheight = 0.1\nnx = 4\nny = 2'
    sets = '[[scene.cloth.set]]\nname = "rim"\nupper = [-0.05, 1, 9]\n\n[[recording]]'
    path = changed(
        folder,
        (mesh, 'kind = "file"\nfile = "disk.obj"'),
        ('pinned = ["left"]', 'pinned = ["rim"]'),
        ("markers = { a = [0.2, 0.0], b = [0.2, 0.1], c = [0.1, 0.05] }", "nearest_at = 0.0"),
        ("[[recording]]", sets),
        ("[output]", "[fit]\ndouble_segments = true\n\n[output]"),
    )
    study = load(path)
    (fine,) = study.options["refine"].finer()
    areas = [e.scene.cloths["cloth"].mesh.areas for e in (*study.experiments, fine)]
    assert len(areas[1]) == 4 * len(areas[0]) and areas[1].sum() == pytest.approx(areas[0].sum())
    (folder / "deeper").mkdir()
    write(with_values(study.config, {"cloth_shear": 12.0}), folder / "deeper" / "fitted.toml", folder)
    (again,) = load(folder / "deeper" / "fitted.toml").experiments
    assert again.scene.quantities["cloth_shear"].value == 12.0


def test_a_piece_cut_on_the_bias(folder: Path) -> None:
    bias = ("ny = 2", "ny = 2\nwarp = [1, 1, 0]")
    (e,) = load(changed(folder, bias, (MARKERS, "markers = { a = [0.1, 0.0] }"))).experiments
    mesh = e.scene.cloths["cloth"].mesh
    along, across = mesh.material.T
    assert mesh.vertices[:, 0] == pytest.approx((along - across) / np.sqrt(2.0))
    assert mesh.vertices[:, 2] == pytest.approx(1.0 + (along + across) / np.sqrt(2.0))
    (a,) = e.compared_places
    assert np.array(a.weights) @ e.scene.positions[list(a.particles)] == pytest.approx([0.0707107, 0, 1.0707107])


def test_a_recording_leaves_a_cloth_out(folder: Path) -> None:
    text = CLOTH.replace(MARKERS, "markers = { a = [0.2, 0.0] }")
    piece = text[text.index("[[scene.cloth]]") : text.index("[[recording]]")]
    second = piece.replace("density", 'name = "other"\ndensity').replace("{ a =", "{ b =")
    recordings = (
        '[[recording]]\nfile = "sheet.npz"\nleave_out = ["other"]\n'
        '[[recording]]\nfile = "sheet.npz"\nname = "second"\nleave_out = ["cloth"]\n'
    )
    tied = '[parameters]\ncloth_shear = { initial = 12.0 }\nother_shear = { tied_to = "cloth_shear" }\n'
    (folder / "my.toml").write_text(text[: text.index("[[recording]]")] + second + recordings + tied)
    first, other = load(folder / "my.toml").experiments
    assert [list(e.scene.cloths) for e in (first, other)] == [["cloth"], ["other"]]
    assert [e.recording.markers[i] for e in (first, other) for i in e.compared] == ["a", "b"]
    assert other.scene.quantities["other_shear"].value == 12.0


def test_without_a_recording(folder: Path) -> None:
    text = CLOTH[: CLOTH.index("[[recording]]")].replace("markers = {", "#")
    (folder / "my.toml").write_text(text)
    built, _ = scene_alone(parse(folder / "my.toml"), folder)
    assert built.particle_count == 15


class TestCommands:
    def test_fit_finds_the_shear_stiffness_and_draws_the_cloth(self, folder: Path) -> None:
        matched = ("[output]", "[fit]\nhalve_step = false\ndouble_segments = false\n\n[output]")
        path = changed(folder, matched, ('figures = "none"', 'figures = "png"'))
        found = run("fit", path)
        low, high = found["parameters"]["cloth_shear"]["interval"]
        assert found["parameters"]["cloth_shear"]["verdict"] == "identified"
        assert abs(found["parameters"]["cloth_shear"]["value"] - 10.0) < high - low < 1.0
        assert (folder / "out/sheet/sheet_cloth.png").stat().st_size > 10_000

    def test_check(self, folder: Path) -> None:
        assert run("check", changed(folder))["passed"]

    def test_simulate_writes_meshes(self, folder: Path) -> None:
        trimesh = pytest.importorskip("trimesh")
        path = changed(folder)
        (written,) = run("simulate", path, "--mesh", "obj")["simulated"]["sheet"]["meshes"]
        with np.load(folder / "out/sheet/sheet.npz") as motion:
            last = motion["positions"][-1]
        frames = sorted(Path(written).iterdir())
        assert len(frames) == 13
        np.testing.assert_allclose(sb.read_mesh(frames[-1]).vertices, last, atol=1e-9)
        (ply,) = run("simulate", path, "--mesh", "ply")["simulated"]["sheet"]["meshes"]
        raw = trimesh.load_mesh(ply, process=False).metadata["_ply_raw"]["face"]["data"]
        shear = green_strain(scene(15.0)[1].mesh, last)[:, 2]
        np.testing.assert_allclose(np.ravel(raw["strain_shear"]), shear, atol=1e-12)

    def test_meshes_need_a_cloth(self, folder: Path) -> None:
        text = '[experiment]\nname = "a"\n[[scene.rope]]\ndensity = 0.1\nlength = 1.0\npinned = [0]\n'
        (folder / "rope.toml").write_text(text)
        result = CliRunner().invoke(app, ["simulate", "rope.toml", "--mesh", "obj"])
        assert result.exit_code == 2 and "--mesh" in result.output


MARKERS = "markers = { a = [0.2, 0.0], b = [0.2, 0.1], c = [0.1, 0.05] }"
TABLE = "[[recording]]"
BAD = [
    ("nx = 4\n", "", "scene.cloth[0].mesh", "give width, height, nx, ny"),
    ("ny = 2", "ny = 2\nradius = 0.1", "scene.cloth[0].mesh", "leave out"),
    ('kind = "grid"', 'kind = "gird"', "scene.cloth[0].mesh.kind", "'grid'"),
    ('kind = "grid"', 'kind = "file"', "scene.cloth[0].mesh", "give file"),
    ("warp = 100.0", "warp = 0.0", "scene.cloth[0].warp", "greater than 0"),
    ("warp = 100.0\n", "", "scene.cloth[0].warp", "add warp to [[scene.cloth]]"),
    ("poisson = 0.2", "poisson = 1.0", "scene.cloth[0].poisson", "less than 1"),
    ("bending = 1e-3", "bending_weft = 1e-3", "scene.cloth[0].bending_weft", "give bending"),
    ("bending = 1e-3", "bending = 1e-3\nyield_share = 0.3", "scene.cloth[0].yield_share", "give yield_curvature and"),
    ("bending = 1e-3", "yield_share = 0.3\nyield_curvature = 9.0", "scene.cloth[0].yield_curvature", "give bending"),
    ("bending = 1e-3", "bending = 1e-3\nyield_share = 1.0", "scene.cloth[0].yield_share", "less than 1"),
    ("bending = 1e-3", "bending = 1e-3\nwarp_size = 1.3", "scene.cloth[0].warp_size", "at most 1.25"),
    (
        "bending = 1e-3",
        'bending = 1e-3\nbending_model = "dihedral"\nwarp_size = 1.0',
        "scene.cloth[0].warp_size",
        "keep bending_model = 'curvature'",
    ),
    ("y_axis = [0, 0, 2]", "y_axis = [1, 0, 2]", "scene.cloth[0].y_axis", "turn one of them"),
    ("y_axis = [0, 0, 2]", "y_axis = [0, 0, 0]", "scene.cloth[0].y_axis", "give a direction"),
    ('pinned = ["left"]', 'pinned = ["lift"]', "scene.cloth[0].pinned", "left"),
    ("ny = 2", "ny = 2\nwarp = [0, 0, 1]", "scene.cloth[0].mesh.warp", "[1, 1, 0]"),
    (MARKERS, "markers = { z = [0, 0] }", "scene.cloth[0].markers.z", "a, b, c"),
    (MARKERS, "markers = { a = [0.3, 0.0] }", "scene.cloth[0].markers.a.points", "give points of the fabric"),
    (MARKERS, "nearest_at = 9.0", "scene.cloth[0].nearest_at", "0 to 0.2"),
    (TABLE, f'[[scene.cloth.set]]\nname = "s"\n{TABLE}', "scene.cloth[0].set[0]", "give one of"),
    (
        TABLE,
        f'[[scene.cloth.set]]\nname = "s"\nlower = [0, 0, 0]\nradius = 0.1\n{TABLE}',
        "scene.cloth[0].set[0]",
        "leave out one of them",
    ),
    (
        TABLE,
        f'[[scene.cloth.set]]\nname = "s"\nlower = [9, 9, 9]\n{TABLE}',
        "scene.cloth[0].set[0]",
        "choose within the cloth's own box",
    ),
    (
        TABLE,
        f'[[scene.cloth.set]]\nname = "left"\nlower = [0, 0, 0]\n{TABLE}',
        "scene.cloth[0].set[0].name",
        "a name beside",
    ),
    (
        TABLE,
        f'[[scene.cloth.set]]\nname = "s"\npoints = [[0, 0, 1], [0, 0, 1.01]]\n{TABLE}',
        "scene.cloth[0].set[0]",
        "finer mesh",
    ),
    (
        TABLE,
        f'[[scene.cloth.set]]\nname = "s"\nmarkers = ["x"]\n{TABLE}',
        "scene.cloth[0].set[0].markers.select",
        "choose from a",
    ),
    (
        TABLE,
        f'[[scene.cloth.grip]]\nset = "rigt"\nmarkers = ["a"]\n{TABLE}',
        "scene.cloth[0].grip[0].set",
        "right",
    ),
    (
        TABLE,
        f'[[scene.cloth.grip]]\nset = "left"\nmarkers = ["a"]\n{TABLE}',
        "scene.drive.particles",
        "either pin or drive",
    ),
    (
        TABLE,
        f'[[scene.cloth.grip]]\nset = "right"\nmarkers = ["a", "b"]\n{TABLE}\nstatic = true',
        "scene.cloth[0].grip[0]",
        "[[scene.drive]]",
    ),
    ("drag_linear = 0.2", "air_normal = -0.2", "scene.cloth[0].air_normal", "greater than 0"),
    (TABLE, f'[scene.cloth.law]\nkind = "exponential"\nwarp = 1.0\n{TABLE}', "scene.cloth[0].law", "one number each"),
    (TABLE, f'[scene.cloth.law]\nkind = "spline"\nwarp = [1.0]\n{TABLE}', "scene.cloth[0].law", "four ratios"),
    (
        TABLE,
        f'[scene.cloth.law]\nkind = "spline"\nspacing = [1, 1, 1]\nwarp = [1.0, 1.0, -1.0, 1.0]\n{TABLE}',
        "scene.cloth[0].law.warp",
        "positive",
    ),
    (
        TABLE,
        f'[[scene.point_mass]]\nname = "p"\nparticle = "cloth:corners:9"\nmass = 1.0\n{TABLE}',
        "scene.point_mass[0].particle",
        "cloth:corners:0",
    ),
    (
        TABLE,
        f'[[marker]]\nmarker = "a"\ncloth = "other"\nmaterial = [0, 0]\n{TABLE}',
        "marker[0].cloth",
        "name one of: cloth",
    ),
    (TABLE, f'[[marker]]\nmarker = "a"\ncloth = "cloth"\n{TABLE}', "marker[0]", "material"),
]


@pytest.mark.parametrize(("old", "new", "field", "fix"), BAD)
def test_what_is_refused(folder: Path, old: str, new: str, field: str, fix: str) -> None:
    with refusal(field, fix, sb.ConfigError):
        load(changed(folder, (old, new)))


def test_a_cloth_that_moves_at_the_start(folder: Path) -> None:
    """Markers of a sheet that turns about its pinned side: every vertex has the speed of that turn."""
    speed = 0.4 * np.arange(13)[:, None] / 60
    x = sb.Recording.load(folder / "sheet.npz").positions[0]
    moving = np.repeat(x[None], 13, axis=0)
    moving[..., 1] += speed * x[:, 0] / 0.2
    sb.Recording(moving, np.arange(13) / 60, ("a", "b", "c"), name="sheet").save(folder / "sheet.npz")
    late = ("[[recording]]", "[[recording]]\nfit = [0.1, 0.2]")
    (e,) = load(changed(folder, late, (AXIS, f"{AXIS}\n{SPEED}"))).experiments
    found = e.scene.base_arrays()["velocity"].reshape(-1, 3)
    true = np.outer(e.scene.positions[:, 0] / 0.2, [0.0, 0.4, 0.0])
    assert found[: len(true)] == pytest.approx(true, abs=1e-9)
    with pytest.raises(sb.ConfigError, match=r"scene\.cloth\[0\]\.velocity: belongs to a motion"):
        load(changed(folder, ("sigma = 1e-4", "sigma = 1e-4\nstatic = true"), (AXIS, f"{AXIS}\n{SPEED}")))
