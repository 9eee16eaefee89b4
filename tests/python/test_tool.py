"""Tools whose poses drive cloths, ropes and rods, and the correction of the frame that the poses are in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.cli.app import app
from sheetbend.config import build, parse, scene_alone
from sheetbend.objects.tool import accelerations
from support import refusal
from typer.testing import CliRunner

Array = np.ndarray
VALUES = {"robot_x": 0.01, "robot_y": -0.02, "robot_turn_x": 0.05, "robot_turn_y": -0.03, "robot_turn_z": 0.08}
SOLVER = sb.Solver(h=1 / 100)


def matrix(axis: int, angle: float) -> Array:
    """The rotation about a coordinate axis, written out."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [k for k in range(3) if k != axis]
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = c
    turn[i, j], turn[j, i] = (-s, s) if axis != 1 else (s, -s)
    return turn


def moved(x: Array, about: Array) -> Array:
    """Points as the correction `VALUES` takes them."""
    turn = matrix(2, 0.08) @ matrix(1, -0.03) @ matrix(0, 0.05)
    return np.asarray(about + [0.01, -0.02, 0.0] + (x - about) @ turn.T)


def tool(flex: float | None = None, rod: Array | None = None, poses: int = 30) -> sb.Tool:
    """Uneven poses that move and turn, in a frame that is not the recording's."""
    t = np.linspace(-0.06, 0.34, poses) + 0.004 * np.sin(np.arange(poses))
    half = 0.5 * np.stack([0.4 * np.sin(3 * t), 0.3 * t, 0.2 * np.cos(2 * t)], axis=1)
    size = np.linalg.norm(half, axis=1, keepdims=True)
    q = np.concatenate([np.sin(size) * half / size, np.cos(size)], axis=1)
    q[poses // 2 :] *= -1.0  # the same turns
    x = np.stack([0.1 * np.sin(4 * t), 0.05 * t, 0.2 * t**2], axis=1)
    frame = sb.HandEye("robot", (1.0, 2.0, 0.5), (0.1, 0.2, 0.3, 0.9), (1.0, 2.2, 0.4))
    return sb.Tool(t, x, q, frame, flex, rod)


def cloth(driver: sb.Tool) -> tuple[sb.Scene, sb.Cloth, Array]:
    mesh = sb.mesh.grid(0.3, 0.2, 3, 2, pattern="one_way")
    top = mesh.sets["top"]
    scene = sb.Scene("cloth")
    made = sb.add_cloth(
        scene, mesh, density=0.2, warp=100, shear=10, bending=1e-4, held=top, positions=driver.placed(mesh.vertices)
    )
    driver.drive(scene, made.particles[top])
    driver.frame.place(scene, made.particles)
    return scene, made, mesh.vertices


def inputs(scene: sb.Scene, values: dict[str, float]) -> dict[str, Array]:
    compiled = scene.compiled
    return compiled.unpack(compiled.inputs(compiled.values(values)))


def test_the_correction_moves_a_cloth_and_its_grip_as_one_rigid_body() -> None:
    driver = tool()
    scene, made, flat = cloth(driver)
    top = made.mesh.sets["top"]
    found, path = inputs(scene, VALUES), driver.path(flat[top])
    assert found["boundary"].reshape(path.shape) == approx(moved(path, driver.frame.about), abs=1e-14)
    assert found["position"] == approx(moved(scene.positions, driver.frame.about), abs=1e-14)
    assert driver.frame.corrected(path, VALUES) == approx(moved(path, driver.frame.about), abs=1e-14)
    plain = inputs(scene, {})
    assert plain["boundary"].reshape(path.shape) == approx(path, abs=1e-15)


def test_poses_are_read_as_rotations() -> None:
    """Against rotation vectors: an independent path from the quaternions to the places."""
    driver = tool()
    k, point = 7, np.array([0.3, -0.1, 0.2])
    x, y, z, w = driver.quaternions[k]
    angle = 2 * np.arctan2(np.linalg.norm([x, y, z]), w)
    axis = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    skew = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    in_frame = turn @ point + driver.positions[k]
    fx, fy, fz, fw = driver.frame.quaternion
    # the frame's own matrix, from the textbook formula
    own = np.array(
        [
            [1 - 2 * (fy * fy + fz * fz), 2 * (fx * fy - fz * fw), 2 * (fx * fz + fy * fw)],
            [2 * (fx * fy + fz * fw), 1 - 2 * (fx * fx + fz * fz), 2 * (fy * fz - fx * fw)],
            [2 * (fx * fz - fy * fw), 2 * (fy * fz + fx * fw), 1 - 2 * (fx * fx + fy * fy)],
        ]
    )
    assert driver.path(point[None])[k, 0] == approx(own @ in_frame + driver.frame.position, abs=1e-14)
    assert driver.held(driver.placed(point[None], 0.1), 0.1)[0] == approx(point, abs=1e-14)


def test_gradients_of_a_cloth_on_a_tool_are_exact() -> None:
    scene, _, _ = cloth(tool(flex=5e-4, rod=np.array([0.0, 1.0, 0.2])))
    report = sb.check_gradients(scene, [0.05, 0.1], SOLVER, samples=2, values={**VALUES, "robot_z": 0.005})
    assert report.passed, str(report)
    named = {row.name for row in report.rows}
    assert {*tool().frame.quantities, "robot_flex"} <= named


def test_gradients_of_a_rod_on_a_tool_are_exact() -> None:
    driver = tool()
    grip = sb.Grip.from_poses(
        driver.times, driver.positions, driver.quaternions, (0, 0, -1), (1, 0, 0), (0, 0, -0.1), driver.frame
    )
    scene = sb.Scene("rod")
    made = sb.add_rod(scene, "rod", length=0.2, segments=4, density=0.05, EI=1e-3, GJ=1e-3, start=grip, tilts=True)
    free = {**VALUES, "rod_start_tilt_1": 0.1, "rod_start_tilt_2": -0.05}
    found = inputs(scene, free)["boundary"].reshape(len(driver.times), -1, 3)
    node = scene.boundary.driven.index(int(made.particles[0]))
    assert found[:, node] == approx(moved(grip.position, driver.frame.about), abs=1e-14)
    director = next(k for k, p in enumerate(scene.boundary.driven) if p in scene.directors)
    turned = moved(grip.director, np.zeros(3)) - [0.01, -0.02, 0.0]
    assert found[:, director] == approx(turned, abs=1e-14)
    report = sb.check_gradients(scene, [0.05, 0.1], SOLVER, samples=2, values=free)
    assert report.passed, str(report)


def test_a_rod_that_bends_gives_across_itself_by_weight_and_inertia() -> None:
    """Of a path with the acceleration (0, 0, 2) m/s^2, by hand: across the rod along y, -(9.81 + 2) flex."""
    t = np.arange(0.0, 0.5, 0.01)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(t), 1))
    path = np.stack([0.1 * t, 0.5 * t**2, t**2], axis=1)
    driver = sb.Tool(t, path, still, flex=1e-3, rod=(0.0, 3.0, 0.0))
    scene = sb.Scene("rope")
    made = sb.add_rope(scene, "rope", length=0.2, segments=2, density=0.05)
    driver.drive(scene, made.particles[:1])
    found = inputs(scene, {})["boundary"]
    assert found - path == approx(np.tile([0.0, 0.0, -11.81e-3], (len(t), 1)), abs=1e-9)
    assert inputs(scene, {"tool_flex": 2e-3})["boundary"] - path == approx(2 * (found - path), abs=1e-9)


def test_accelerations_of_a_noisy_log_are_smoothed() -> None:
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0.0, 2.0, 200))
    x = np.stack([np.sin(3 * t), t**2, 0 * t], axis=1) + 1e-4 * rng.standard_normal((200, 3))
    inner = (t > 0.1) & (t < 1.9)
    off = accelerations(t, x) - np.stack([-9 * np.sin(3 * t), 2 + 0 * t, 0 * t], axis=1)
    assert np.sqrt(np.mean(off[inner] ** 2)) < 0.3
    few = accelerations(np.array([0.0, 0.1]), np.zeros((2, 3)))
    assert not few.any()


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"quaternions": np.zeros((30, 4))}, "tool.quaternions"),
        ({"times": np.zeros(30)}, "tool.times"),
        ({"positions": np.zeros((29, 3))}, "tool.positions"),
        ({"flex": -1.0}, "tool.flex"),
        ({"rod": (0.0, 0.0, 0.0)}, "tool.rod"),
    ],
)
def test_bad_poses_are_refused(change: dict[str, object], field: str) -> None:
    good = tool()
    fields = {k: getattr(good, k) for k in ("times", "positions", "quaternions", "frame", "flex", "rod")}
    with refusal(field):
        sb.Tool(**{**fields, **change})


CONFIG = """
[experiment]
name = "held"

[solver]
h = 0.01
method = "newton"

[[scene.tool]]
name = "robot"
file = "poses.csv"
position = [1.0, 2.0, 0.5]
quaternion = [0.1, 0.2, 0.3, 0.9]
about = [1.0, 2.2, 0.4]
shift_sd = 0.02
turn_sd = 0.05

[[scene.cloth]]
density = 0.2
warp = 100.0
shear = 10.0
bending = 1e-4
on_tool = "robot"

[scene.cloth.mesh]
kind = "grid"
width = 0.3
height = 0.2
nx = 3
ny = 2

[[scene.cloth.grip]]
set = "top"
tool = "robot"

[scene.cloth.grid]
first = [0.1, 0.0]
last = [0.2, 0.1]
counts = [2, 2]

[[recording]]
file = "seen.npz"

[parameters.cloth_bending]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    driver = tool()
    scene, made, _ = cloth(driver)
    times = np.arange(0.0, 0.3, 0.05)
    shown = sb.simulate(scene, times, SOLVER).positions
    places = sb.on_cloth(made, [[0.1, 0.0], [0.2, 0.0], [0.1, 0.1], [0.2, 0.1]])
    x = np.stack([np.tensordot(shown[:, list(p.particles)], p.weights, axes=(1, 0)) for p in places], axis=1)
    sb.Recording(x, times).save(tmp_path / "seen.npz")
    table = np.column_stack([driver.times, driver.positions, driver.quaternions])
    header = "time,x,y,z,qx,qy,qz,qw"
    np.savetxt(tmp_path / "poses.csv", table, fmt="%.17g", delimiter=",", header=header, comments="")
    np.savez(tmp_path / "poses.npz", times=driver.times, positions=driver.positions, quaternions=driver.quaternions)
    return tmp_path


def configured(folder: Path, text: str = CONFIG) -> sb.Experiment:
    (folder / "held.toml").write_text(text)
    study = build(parse(folder / "held.toml"), folder)
    return study.experiments[0]


def test_a_configuration_makes_the_same_scene(folder: Path) -> None:
    e = configured(folder)
    scene, _, _ = cloth(tool().between(0.0, 0.25))
    given, found = inputs(scene, VALUES), inputs(e.scene, VALUES)
    assert found["position"] == approx(given["position"], abs=1e-14)
    knots = len(given["boundary"])
    assert found["boundary"][:knots] == approx(given["boundary"], abs=1e-14)
    npz = configured(folder, CONFIG.replace("poses.csv", "poses.npz"))
    assert inputs(npz.scene, VALUES)["boundary"] == approx(found["boundary"], abs=1e-14)


def test_the_standard_deviations_of_a_tool_become_six_priors(folder: Path) -> None:
    (folder / "held.toml").write_text(CONFIG + "[parameters.robot_turn_z]\nprior = [0.1, 0.01]\n")
    wanted = build(parse(folder / "held.toml"), folder).parameters
    names = tool().frame.quantities
    assert set(wanted) == {"cloth_bending", *names}
    assert [wanted[n]["prior"] for n in names[:4]] == [(0.0, 0.02)] * 3 + [(0.0, 0.05)]
    assert wanted["robot_turn_z"]["prior"] == (0.1, 0.01)
    from_python = {p.name: p.prior for p in tool().frame.parameters(0.02, 0.05)}
    assert from_python["robot_x"] == (0.0, 0.02) and from_python["robot_turn_y"] == (0.0, 0.05)


def test_markers_on_a_grid_sit_where_single_ones_do(folder: Path) -> None:
    single = "markers = { m0 = [0.1, 0.0], m1 = [0.2, 0.0], m2 = [0.1, 0.1], m3 = [0.2, 0.1] }"
    by_hand = CONFIG[: CONFIG.index("[scene.cloth.grid]")] + CONFIG[CONFIG.index("[[recording]]") :]
    by_hand = by_hand.replace('on_tool = "robot"', f'on_tool = "robot"\n{single}')
    assert configured(folder).places == configured(folder, by_hand).places
    own = '[recording.grids.cloth]\nfirst = [0.2, 0.0]\nlast = [0.1, 0.1]\ncounts = [2, 2]\nmarkers = [1, "m0", 3, 2]\n'
    mirrored = CONFIG.replace("[parameters", own + "[parameters")
    assert configured(folder, mirrored).places == configured(folder, by_hand).places


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('tool = "robot"\n\n[scene.cloth.grid]', 'tool = "hand"\n\n[scene.cloth.grid]', "scene.cloth[0].grip[0].tool"),
        ('on_tool = "robot"', 'on_tool = "hand"', "scene.cloth[0].on_tool"),
        ('file = "poses.csv"\n', "", "scene.tool[0].file"),
        ("counts = [2, 2]", "counts = [2, 3]", "scene.cloth[0].grid.counts"),
        ("counts = [2, 2]", 'counts = [2, 2]\nmarkers = ["m0"]', "scene.cloth[0].grid"),
        ('set = "top"\n', 'set = "top"\nmarkers = ["m0"]\n', "scene.cloth[0].grip[0]"),
        ('file = "seen.npz"', 'file = "seen.npz"\ntools = { hand = "poses.csv" }', "recording[0].tools.hand"),
        ('file = "seen.npz"', 'file = "seen.npz"\nstart_time = -1.0', "scene.tool[0].file.tool.times"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_path(folder: Path, old: str, new: str, field: str) -> None:
    assert CONFIG.count(old) == 1
    with refusal(field, error=sb.ConfigError):
        configured(folder, CONFIG.replace(old, new))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("time,x,y,z,qx,qy,qz\n0,0,0,0,0,0,0\n", "lacks the columns qw"),
        ("time,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,one,0,0,0,1\n", "has no numbers in line 3"),
        ("", "lacks the columns"),
    ],
)
def test_damaged_files_of_poses_are_refused(tmp_path: Path, text: str, problem: str) -> None:
    (tmp_path / "poses.csv").write_text(text)
    with pytest.raises(sb.RecordingError, match=problem):
        sb.Tool.load(tmp_path / "poses.csv")
    with pytest.raises(sb.RecordingError, match="does not exist"):
        sb.Tool.load(tmp_path / "none.csv")


def test_simulate_and_fit_write_predicted_markers(folder: Path) -> None:
    """The recording was simulated from the same scene, so at the start values the markers come out as recorded."""
    (folder / "held.toml").write_text(CONFIG + "initial = 1e-4\n\n[fit]\nhalve_step = false\ndouble_segments = false\n")
    out = folder / "out"
    for command in (["simulate"], ["fit"]):
        result = CliRunner().invoke(app, [*command, str(folder / "held.toml"), "--output", str(out / command[0])])
        assert result.exit_code in (0, 4), result.output
        found = sb.Recording.load(out / command[0] / "predicted_seen.npz")
        recorded = sb.Recording.load(folder / "seen.npz")
        assert found.markers == recorded.markers and found.times == approx(recorded.times)
        assert found.positions == approx(recorded.positions, abs=1e-6 if command == ["fit"] else 1e-12)


ROPE = """
[experiment]
name = "hung"

[solver]
h = 0.01

[[scene.tool]]
name = "robot"
file = "poses.csv"
flex = 1e-3

[[scene.rope]]
length = 0.2
segments = 2
density = 0.05
direction = [0, 0, -1]

[[scene.drive]]
particles = ["rope:start"]
tool = "robot"
points = [[0.0, 0.1, 0.0]]
"""


def test_a_rope_rides_on_a_tool_in_a_configuration(folder: Path) -> None:
    (folder / "hung.toml").write_text(ROPE)
    scene, _ = scene_alone(parse(folder / "hung.toml"), folder)
    driver = tool()
    bare = sb.Tool(driver.times, driver.positions, driver.quaternions, sb.HandEye("robot"))
    assert inputs(scene, {"robot_flex": 1e-12})["boundary"] == approx(bare.path([[0.0, 0.1, 0.0]])[:, 0], abs=1e-9)
    assert {*driver.frame.quantities, "robot_flex"} <= set(scene.quantities)


@pytest.mark.parametrize(
    "change",
    [
        ('tool = "robot"', 'tool = "robot"\nmarkers = ["m0"]'),
        ('tool = "robot"\npoints', "points"),
        ("[[0.0, 0.1, 0.0]]", "[[0.0, 0.1, 0.0]]\noffset = [0.0, 0.0, 0.1]"),
    ],
)
def test_a_drive_has_one_mover(folder: Path, change: tuple[str, str]) -> None:
    (folder / "hung.toml").write_text(ROPE.replace(*change))
    with pytest.raises(sb.ConfigError) as caught:
        parse(folder / "hung.toml")
    assert caught.value.field == "scene.drive[0]"
