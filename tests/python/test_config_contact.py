"""Colliders and contacts in configurations: what they build, a motion with them, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load, parse, scene_alone
from sheetbend.config.schema import Config
from support import refusal

DRAGGED = """\
[experiment]
name = "dragged"

[solver]
h = 2e-3
method = "implicit"
integrator = "bdf1"

[[scene.rope]]
length = 0.2
segments = 8
density = 0.05
EA = 200.0
EI = 1e-4
start = [0.0, 0.0, 0.005]

[[scene.collider]]
name = "table"
shape = "plane"
normal = [0.0, 0.0, 1.0]

[[scene.collider]]
name = "post"
shape = "capsule"
start = [0.1, 0.1, 0.0]
end = [0.1, 0.1, 0.3]
radius = 0.02

[[scene.contact]]
of = "rope"
collider = "table"
friction = 0.3
radius = 0.005

[[scene.contact]]
of = ["rope"]
collider = "post"
friction = 0.2
stiffness = 500.0
"""
SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")


@pytest.fixture(autouse=True)
def in_its_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def parsed(text: str) -> Config:
    Path("dragged.toml").write_text(text)
    return parse("dragged.toml")


def built(text: str) -> sb.Scene:
    return scene_alone(parsed(text))[0]


def test_a_file_builds_the_scene_that_python_builds():
    scene = sb.Scene("dragged", (0, 0, -9.81))
    rope = sb.add_rope(scene, length=0.2, segments=8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.005))
    scene.add_contact(rope, sb.Plane(name="table"), friction=0.3, radius=0.005)
    post = sb.Capsule(start=(0.1, 0.1, 0), end=(0.1, 0.1, 0.3), radius=0.02, name="post")
    scene.add_contact(rope, post, friction=0.2, stiffness=500.0)
    read, solver = scene_alone(parsed(DRAGGED))
    assert {n: q.value for n, q in read.quantities.items()} == {n: q.value for n, q in scene.quantities.items()}
    assert {"table_friction", "table_contact_radius", "post_contact_stiffness", "post_radius"} <= set(read.quantities)
    ours, theirs = (sb.simulate(s, [0.0, 0.05], solver).positions for s in (read, scene))
    assert np.array_equal(ours, theirs)


def test_a_cylinder_has_ends_a_radius_and_rounded_rims():
    read = built(DRAGGED.replace('shape = "capsule"', 'shape = "cylinder"\nedge_radius = 0.005'))
    post = sb.Cylinder(start=[0.1, 0.1, 0], end=[0.1, 0.1, 0.3], radius=0.02, edge_radius=0.005, name="post")
    assert read.contacts.colliders["post"] == post
    assert read.quantities["post_edge_radius"].value == 0.005


def test_a_rod_touches_as_a_rope_does():
    read, solver = scene_alone(parsed(DRAGGED.replace("[[scene.rope]]", '[[scene.rod]]\nname = "rope"\nGJ = 1e-4')))
    motion = sb.simulate(read, [0.0, 0.05], solver)
    assert motion.contacts["table"].most == 9
    assert np.abs(motion.positions[-1, :9, 2] - 0.005).max() < 1e-6


def test_a_collider_moves_at_knots_and_with_a_tool(tmp_path: Path):
    times = np.linspace(0.0, 1.0, 21)
    angle = 1.5 * np.pi * times  # beyond half a turn
    turns = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    np.savez(tmp_path / "hand.npz", times=times, positions=np.outer(times, [0.0, 0.0, 0.1]), quaternions=turns)
    knots = DRAGGED.replace("radius = 0.02", "radius = 0.02\ntimes = [0.0, 1.0]\ndisplacements = [[0,0,0], [0,0,1]]")
    at_end = built(knots).contacts.colliders["post"].poses
    assert at_end.positions[-1] == pytest.approx([0.1, 0.1, 1.15])
    ridden = DRAGGED.replace("radius = 0.02", 'radius = 0.02\ntool = "hand"')
    ridden += '[[scene.tool]]\nname = "hand"\nfile = "hand.npz"\nposition = [1.0, 0.0, 0.0]\n'
    scene, _ = scene_alone(parsed(ridden), tmp_path)
    poses = scene.contacts.colliders["post"].poses
    arm = np.array([0.1 - 1.0, 0.1, 0.15])  # from the tool's origin, at 1.0 on x
    away = np.stack([np.cos(angle) * arm[0] - np.sin(angle) * arm[1], np.sin(angle) * arm[0] + np.cos(angle) * arm[1]])
    assert poses.positions[:, :2] == pytest.approx(away.T + np.array([1.0, 0.0]))
    assert poses.positions[:, 2] == pytest.approx(0.15 + 0.1 * times)
    assert poses.rotations == pytest.approx(np.outer(angle, [0, 0, 1]))


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ('method = "implicit"', 'method = "direct"', "solver.method", 'method = "implicit"'),
        ("friction = 0.3", "friction = 0.3\nrestitution = 1.2", "scene.contact[0].restitution", "at most 1"),
        (
            "friction = 0.3",
            "friction = 0.3\nrestitution = 0.5\nstiffness = 1000.0",
            "scene.table.restitution",
            "leave out one of the two",
        ),
        ("friction = 0.3", "friction = 0.3\ndissipation = 0.5", "scene.contact[0].dissipation", "give a stiffness"),
        ("friction = 0.3", "friction = 0.3\ndissipation = -0.5", "scene.contact[0].dissipation", "at least 0"),
        ("radius = 0.02", "", "scene.collider[1]", "add radius"),
        ("radius = 0.02", "radius = 0.0", "scene.collider[1].radius", "greater than 0"),
        ("radius = 0.02", "radius = 0.02\nsize = [1.0, 1.0, 1.0]", "scene.collider[1]", "has start, end, radius"),
        ("radius = 0.02", "radius = 0.02\ntimes = [0.0]", "scene.collider[1]", "give both"),
        ("radius = 0.02", 'radius = 0.02\ntool = "hand"', "scene.collider[1].tool", "add a [[scene.tool]]"),
        ("normal = [0.0, 0.0, 1.0]", "normal = [0.0, 0.0, 0.0]", "scene.collider[0].normal", "not zero"),
        ('name = "post"', 'name = "table"', "scene.collider[1].name", "of its own"),
        ('shape = "plane"', 'shape = "cone"', "scene.collider[0].shape", "choices"),
        ('collider = "table"', 'collider = "desk"', "scene.contact[0].collider", "table, post"),
        ('of = "rope"', 'of = "cord"', "scene.contact[0].of", "use some of: rope"),
        ('of = "rope"', 'of = ["rope", "rope"]', "scene.contact[0].particles", "once"),
        ("friction = 0.3", "friction = -0.3", "scene.contact[0].friction", "at least 0"),
        ("radius = 0.005", "raduis = 0.005", "scene.contact[0].raduis", "did you mean 'radius'"),
        ("start = [0.0, 0.0, 0.005]", "start = [0.0, 0.0, 0.002]", "scene.table.contact", "0.003 m deep"),
    ],
)
def test_what_cannot_be_is_refused(old: str, new: str, field: str, words: str):
    with refusal(field, words, sb.ConfigError):
        built(DRAGGED.replace(old, new, 1))


MARBLES = """\
[experiment]
name = "marbles"

[solver]
h = 2e-3
method = "gauss_seidel"

[[scene.particles]]
name = "shooter"
mass = 0.02
positions = [[-0.2, 0.0, 0.0]]
velocity = [[1.0, 0.0, 0.0]]

[[scene.particles]]
name = "marble"
mass = 0.01
positions = [[0.0, 0.0, 0.0], [0.1, 0.01, 0.0]]

[scene.collisions]
of = ["shooter", "marble"]
radius = 0.02
restitution = 0.9
"""


def test_balls_of_a_configuration_hit_each_other():
    scene = built(MARBLES)
    alike = sb.Scene("marbles")
    alike.add_particles(
        [[-0.2, 0, 0], [0, 0, 0], [0.1, 0.01, 0]], [0.02, 0.01, 0.01], [[1.0, 0, 0], [0, 0, 0], [0, 0, 0]]
    )
    alike.add_collisions([0, 1, 2], radius=0.02, restitution=0.9)
    solver = sb.Solver(h=2e-3, method="gauss_seidel")
    found, expected = (sb.simulate(s, [0.0, 0.3], solver) for s in (scene, alike))
    assert np.array_equal(found.positions, expected.positions)
    assert found.contacts["balls"].began == 2
    several = built(MARBLES.replace("radius = 0.02", "radius = [0.02, 0.01]")).quantities
    assert [several[f"balls_contact_radius_{k}"].value for k in range(3)] == [0.02, 0.01, 0.01]


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ("radius = 0.02", "radius = 0.0", "scene.collisions", "give positive radii"),
        ("radius = 0.02", "radius = [0.02]", "scene.collisions", "one for each name"),
        ("restitution = 0.9", "restitution = 1.1", "scene.collisions.restitution", "at most 1"),
        ('["shooter", "marble"]', '["shooter", "ball"]', "scene.collisions.of", "use some of: shooter, marble"),
        ('["shooter", "marble"]', '"shooter"', "scene.collisions.particles", "give two or more"),
    ],
)
def test_collisions_that_cannot_be_are_refused(old: str, new: str, field: str, words: str):
    with refusal(field, words, sb.ConfigError):
        built(MARBLES.replace(old, new, 1))


def test_a_tool_that_is_corrected_moves_no_collider(tmp_path: Path):
    text = DRAGGED.replace("radius = 0.02", 'radius = 0.02\ntool = "hand"')
    with pytest.raises(sb.ConfigError, match="post_x"):
        parsed(text + '[[scene.tool]]\nname = "hand"\nfile = "hand.npz"\nshift_sd = 1e-3\n')
    tool = sb.Tool([0.0, 1.0], np.zeros((2, 3)), [[0, 0, 0, 1]] * 2, flex=1e-4)
    with pytest.raises(sb.SceneError, match="bends"):
        tool.carry(sb.Plane())


def recorded(folder: Path, more: str) -> Path:
    scene = built(DRAGGED)
    motion = sb.simulate(scene, np.linspace(0.0, 0.2, 11), SOLVER)
    on_rope = motion.positions[:, scene.ropes["rope"].particles]
    sb.Recording(positions=on_rope, times=motion.times, markers=[f"m{k}" for k in range(9)]).save(folder / "take.npz")
    markers = ", ".join(f"m{k} = {0.025 * k}" for k in range(9))
    text = DRAGGED.replace("EA = 200.0", f"EA = 200.0\nmarkers = {{ {markers} }}")
    (folder / "dragged.toml").write_text(f'{text}\n[[recording]]\nfile = "take.npz"\nfit = [0.0, 0.2]\n{more}')
    return folder / "dragged.toml"


def test_a_recording_knows_contacts_and_can_do_without(tmp_path: Path):
    both = load(recorded(tmp_path, "[parameters.table_friction]\n"))
    assert both.experiments[0].scene.compiled.contacts == ("table", "post")
    assert both.options["refine"].finer is not None
    finer = both.options["refine"].finer()[0].scene
    assert len(finer.contacts.contacts[0].particles) == 17
    path = recorded(tmp_path, 'leave_out = ["over"]\n')
    path.write_text(path.read_text().replace('of = "rope"', 'name = "over"\nof = "rope"'))
    assert load(path).experiments[0].scene.compiled.contacts == ("post",)


def test_a_state_of_rest_with_contacts_is_refused(tmp_path: Path):
    with pytest.raises(sb.ConfigError, match=r"recording\[0\].static.*contacts"):
        load(recorded(tmp_path, "static = true\n"))
