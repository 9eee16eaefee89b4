"""Ropes and rods held in every way, from TOML as from Python: what drives their ends, and what each choice assumes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from pytest import approx
from sheetbend.arrays.rigid import rigid_motion
from sheetbend.config import build, parse
from sheetbend.scene.moving_clamp import clamped_ends

Array = np.ndarray
TIMES = np.arange(31) / 60
LENGTH = 0.6


def turn(axis: int, angle: Array) -> Array:
    """(frames, 3, 3) rotations about a coordinate axis, written out."""
    c, s, one, zero = np.cos(angle), np.sin(angle), np.ones_like(angle), np.zeros_like(angle)
    rows = {
        0: [[one, zero, zero], [zero, c, -s], [zero, s, c]],
        1: [[c, zero, s], [zero, one, zero], [-s, zero, c]],
        2: [[c, -s, zero], [s, c, zero], [zero, zero, one]],
    }
    return np.moveaxis(np.array(rows[axis]), 2, 0)


def hand() -> tuple[Array, Array]:
    """Rotations (frames, 3, 3) and places (frames, 3) m of a hand that starts unturned."""
    turns = turn(1, 0.6 * np.sin(6 * TIMES)) @ turn(0, 0.4 * TIMES)
    return turns, np.stack([0.1 * np.sin(5 * TIMES), 0.05 * TIMES, 1.0 + 0.2 * TIMES**2], axis=1)


def take(folder: Path, noise: float = 0.0) -> None:
    """A hand with four markers, `grip` where the rope leaves it along x, and five markers on a rope that follows."""
    turns, places = hand()
    own = np.array([[-0.05, 0.02, 0.0], [-0.05, -0.02, 0.01], [0.02, 0.0, 0.04], [-0.02, 0.0, 0.0]])
    markers = places[:, None] + np.einsum("fab,kb->fka", turns, own)
    rope = places[:, None] + np.linspace(0.0, LENGTH, 5)[:, None] * np.array([1.0, 0.0, 0.0])
    x = np.concatenate([markers, rope], axis=1)
    x += noise * np.random.default_rng(0).standard_normal(x.shape)
    names = ("h0", "h1", "h2", "behind", "grip", "r1", "r2", "r3", "tip")
    sb.Recording(x, TIMES, names, name="take", gravity=(0, 0, -9.81)).save(folder / "take.csv")


def config(folder: Path, held: str, kind: str = "rope", extra: str = "", recording: str = "") -> Path:
    stiff = "GJ = 1e-3\n" if kind == "rod" else ""
    text = f"""
[experiment]
name = "held"
[[scene.{kind}]]
name = "rope"
length = {LENGTH}
segments = 12
density = 0.05
EI = 1e-3
{stiff}points = "recording"
markers = {{ grip = 0.0, r1 = 0.15, r2 = 0.3, r3 = 0.45, tip = {LENGTH} }}
{extra}
{held}
[[recording]]
file = "take.csv"
{recording}
[parameters.rope_EI]
"""
    file = folder / "held.toml"
    file.write_text(text)
    return file


def driven(scene: sb.Scene) -> dict[int, Array]:
    """By particle, its motion (frames, 3)."""
    compiled = scene.compiled
    values = compiled.unpack(compiled.inputs(compiled.values({})))["boundary"]
    return dict(zip(scene.boundary.driven, np.moveaxis(np.reshape(values, (len(TIMES), -1, 3)), 1, 0), strict=True))


GRIPS = {
    "one": 'markers = ["grip"]',
    "one, kept": 'markers = ["grip"]\ndirection = [1, 0, 0]',
    "two": 'markers = ["behind", "grip"]',
    "body": 'markers = ["h0", "h1", "h2", "behind"]',
}


@pytest.mark.parametrize("kind", ["rope", "rod"])
@pytest.mark.parametrize("held", GRIPS)
def test_an_end_follows_its_markers(tmp_path: Path, kind: str, held: str) -> None:
    take(tmp_path)
    table = f'[[scene.{kind}.grip]]\nat = "start"\n{GRIPS[held]}'
    study = build(parse(config(tmp_path, table, kind)), tmp_path)
    scene = study.experiments[0].scene
    rope, motion = scene.ropes["rope"], driven(scene)
    turns, places = hand()
    assert motion[int(rope.particles[0])] == approx(places, abs=1e-12)
    assert scene.positions[rope.particles[0]] == approx(places[0])
    assert np.linalg.norm(np.diff(scene.positions[rope.particles], axis=0), axis=1) == approx(LENGTH / 12)
    if held == "one":
        assert rope.start_ghost is None and len(motion) == 1
        assert "turns freely" in study.assumptions[0]
    else:
        back = places - motion[int(rope.start_ghost)]
        along = np.tile([1.0, 0, 0], (len(TIMES), 1)) if held == "one, kept" else turns[:, :, 0]
        assert back / np.linalg.norm(back, axis=1, keepdims=True) == approx(along, abs=1e-9)
    if kind == "rod" and held == "body":  # roll included: the frame turns with the hand
        first = motion[int(rope.directors[0])]
        assert first == approx(turns @ first[0], abs=1e-9)
    assert study.assumptions[1] == "rope, end: free"
    moved = sb.simulate(scene, 0.3, study.experiments[0].solver)
    assert np.isfinite(moved.positions).all()


def test_the_same_from_python_and_from_toml(tmp_path: Path) -> None:
    take(tmp_path)
    table = '[[scene.rope.grip]]\nat = "start"\nmarkers = ["behind", "grip"]'
    read = build(parse(config(tmp_path, table)), tmp_path).experiments[0]
    x = read.recording.select(["behind", "grip"]).positions
    grip = sb.Grip.from_markers(TIMES, x[:, 0], x[:, 1])
    points = read.scene.positions[read.scene.ropes["rope"].particles]
    scene = sb.Scene("take")
    sb.add_rope(scene, length=LENGTH, segments=12, density=0.05, EI=1e-3, points=points, grip_start=grip)
    found = [sb.simulate(s, 0.4, read.solver).positions for s in (read.scene, scene)]
    assert found[0] == approx(found[1], abs=1e-9)


@pytest.mark.parametrize("angles", [False, True])
def test_a_clamp_that_is_driven_keeps_its_direction(tmp_path: Path, angles: bool) -> None:
    """Until now a driven clamp was refused, as a particle that is both pinned and driven."""
    take(tmp_path)
    table = '[[scene.drive]]\nparticles = ["rope:start"]\nmarkers = ["grip"]'
    extra = "clamp_start = [1, 0, 0.5]\n" + ("clamp_angles = true\nplane = [0, 1, 0]" if angles else "")
    scene = build(parse(config(tmp_path, table, extra=extra)), tmp_path).experiments[0].scene
    rope, compiled = scene.ropes["rope"], scene.compiled
    node, ghost = int(rope.particles[0]), rope.start_ghost
    for angle in (0.0, 0.3) if angles else (0.0,):
        values = compiled.values({"rope_start_angle": angle} if angles else {})
        boundary = np.reshape(compiled.unpack(compiled.inputs(values))["boundary"], (len(TIMES), -1, 3))
        slot = {p: k for k, p in enumerate(scene.boundary.driven)}
        back = boundary[:, slot[node]] - boundary[:, slot[ghost]]
        along = turn(1, np.array([angle]))[0] @ np.array([1.0, 0.0, 0.5]) / np.hypot(1.0, 0.5)
        assert back / np.linalg.norm(back, axis=1, keepdims=True) == approx(np.tile(along, (len(TIMES), 1)), abs=1e-9)
    report = sb.check_gradients(scene, TIMES[:9], sb.Solver(h=1 / 240), seconds=20) if angles else None
    assert report is None or report.passed, report


def test_a_clamp_lets_go_only_of_its_own_end() -> None:
    scene = sb.Scene("two")
    rope = sb.add_rope(scene, length=1.0, segments=8, density=0.1, EI=1e-3, clamp_start=(1, 0, 0), clamp_end=(1, 0, 0))
    ends = clamped_ends(scene, [int(rope.particles[0])])
    assert ends == [(0, rope.start_ghost)]
    scene.drive([rope.particles[0]], [0.0, 1.0], [[[0.0, 0, 0]], [[0.1, 0, 0]]])
    assert scene.pinned == {int(rope.particles[-1]), rope.end_ghost}


def test_a_rigid_piece_keeps_its_pose_through_lost_markers() -> None:
    turns, places = hand()
    own = np.random.default_rng(1).normal(size=(5, 3))
    x = places[:, None] + np.einsum("fab,kb->fka", turns, own)
    x[3:9, 1] = np.nan
    x[5:20, 4] = np.nan
    found, centers, rms = rigid_motion(x)
    assert found == approx(turns, abs=1e-12) and rms < 1e-12
    assert centers == approx(places + turns @ own.mean(axis=0), abs=1e-12)
    x[:, 2, 0] += 2.0 * np.sin(6 * TIMES)
    with pytest.raises(sb.SceneError, match="move against each other"):
        rigid_motion(x)


def test_a_rope_that_moves_starts_with_its_speed(tmp_path: Path) -> None:
    """Rigid translation: every node starts with the hand's speed."""
    take(tmp_path)
    table = '[[scene.rope.grip]]\nat = "start"\nmarkers = ["grip"]'
    made = config(tmp_path, table, extra='velocity = "recording"', recording="start_time = 0.25\nfit = [0.25, 0.5]")
    scene = build(parse(made), tmp_path).experiments[0].scene
    nodes = scene.ropes["rope"].particles
    _, places = hand()
    speed = np.gradient(places, TIMES, axis=0, edge_order=2)[15]
    assert scene.base_arrays()["velocity"].reshape(-1, 3)[nodes] == approx(np.tile(speed, (13, 1)), abs=0.02)
    assert scene.positions[nodes[0]] == approx(places[15])


def test_grips_from_a_tool(tmp_path: Path) -> None:
    take(tmp_path)
    turns, places = hand()
    w = 0.5 * np.sqrt(1 + np.trace(turns, axis1=1, axis2=2))
    skew = turns - np.swapaxes(turns, 1, 2)
    q = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) / (4 * w[:, None])
    rows = np.column_stack([TIMES, places, q, w])
    np.savetxt(tmp_path / "poses.csv", rows, delimiter=",", header="time,x,y,z,qx,qy,qz,qw", comments="")
    table = '[[scene.rod.grip]]\nat = "start"\ntool = "robot"\n[[scene.tool]]\nname = "robot"\nfile = "poses.csv"'
    study = build(parse(config(tmp_path, table, "rod")), tmp_path)
    scene = study.experiments[0].scene
    rod, motion = scene.ropes["rope"], driven(scene)
    assert motion[int(rod.particles[0])] == approx(places, abs=1e-9)
    back = motion[int(rod.particles[0])] - motion[int(rod.start_ghost)]
    assert back / np.linalg.norm(back, axis=1, keepdims=True) == approx(turns[:, :, 0], abs=1e-8)
    assert "robot" in study.assumptions[0] and {"robot_x", "robot_turn_z"} <= set(scene.quantities)


def test_noise_of_one_marker_is_allowed_for(tmp_path: Path) -> None:
    take(tmp_path, noise=1e-3)
    table = '[[scene.rope.grip]]\nat = "start"\nmarkers = ["grip"]'
    told = 'driven_sigma = "estimate"'
    study = build(parse(config(tmp_path, table, recording=told)), tmp_path)
    assert study.experiments[0].driven_noise == approx(1e-3, rel=0.5)


BAD = {
    "nothing that moves": ('at = "start"', "must have one of markers, tool and body"),
    "no such marker": ('at = "start"\nmarkers = ["thumb"]', "unknown marker"),
    "a line": ('at = "start"\nmarkers = ["r1", "r2", "r3"]', "on one line"),
    "position": ('at = "start"\nmarkers = ["grip"]\nposition = [0, 0, 0]', "give the offset"),
    "no tool": ('at = "start"\ntool = "robot"', "is not a tool of the scene"),
}


@pytest.mark.parametrize("bad", BAD)
def test_what_cannot_hold_a_rope_is_refused(tmp_path: Path, bad: str) -> None:
    take(tmp_path)
    held, words = BAD[bad]
    with pytest.raises(sb.ConfigError, match=words) as refused:
        build(parse(config(tmp_path, f"[[scene.rope.grip]]\n{held}")), tmp_path)
    assert refused.value.field.startswith("scene.rope[0]")


def test_a_fit_prints_what_it_assumes(tmp_path: Path) -> None:
    take(tmp_path, noise=1e-3)
    table = '[[scene.rope.grip]]\nat = "start"\nmarkers = ["behind", "grip"]'
    file = config(tmp_path, table, recording="fit = [0.0, 0.2]")
    shown = run("info", file, "--json")
    assert last_line(shown)["config"]["assumptions"][0] in shown.stderr
    fitted = run("fit", file, "--output", tmp_path / "out")
    assert fitted.exit_code in (0, 3, 4), fitted.output
    held = "in the place and direction of markers behind, grip"
    assert held in fitted.stdout.replace("\n", " ")
    assert "How ropes are held" in (tmp_path / "out" / "report.txt").read_text()
    assert held in " ".join((tmp_path / "out" / "fit.json").read_text().split())


@pytest.mark.parametrize("clamp", ["clamp_start", "clamp_end"])
@pytest.mark.parametrize("kind", ["rope", "rod"])
def test_a_straight_one_points_where_its_clamp_does(tmp_path: Path, clamp: str, kind: str) -> None:
    """It had pointed along x, and so began with a bend at its clamp."""
    take(tmp_path)
    file = config(tmp_path, "", kind, f"{clamp} = [0, 0, -1]")
    file.write_text(file.read_text().replace('points = "recording"\n', ""))
    scene = build(parse(file), tmp_path).experiments[0].scene
    x = scene.positions[scene.ropes["rope"].particles]
    assert x - x[0] == approx(np.outer(np.linspace(0.0, LENGTH, 13), [0.0, 0.0, -1.0]), abs=1e-12)


def test_a_straight_rope_can_leave_its_clamp_at_an_angle() -> None:
    scene = sb.Scene("angle")
    rope = sb.add_rope(scene, length=1.0, density=0.1, EI=1e-3, clamp_start=(0, 0, -1), direction=(0, 1, 0))
    assert scene.positions[rope.particles][-1] == approx([0.0, 1.0, 0.0])
