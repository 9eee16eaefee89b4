"""Rigid bodies and joints in configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import config
from sheetbend.config.build import scene_alone
from sheetbend.config.file import parse

TEXT = """
[experiment]
name = "plug"

[solver]
h = 2e-3

[[scene.body]]
name = "plug"
mass = 0.08
inertia = [2e-5, 3e-5, 4e-5]
center = [0.003, 0.0, 0.0]
at = [0.52, 0.0, 0.0]

[[scene.body]]
name = "flap"
mass = 0.01
box = [0.02, 0.01, 0.002]
at = [0.55, 0.0, 0.0]

[[scene.joint]]
kind = "hinge"
name = "hinge"
upper = "plug"
lower = "flap"
at = [0.54, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
stiffness = 1e-3

[[scene.rod]]
name = "cable"
length = 0.5
segments = 8
density = 0.05
EI = 4e-3
GJ = 2e-3
EA = 2e3
clamp_start = [1.0, 0.0, 0.0]

[[scene.rod.grip]]
at = "end"
body = "plug"
position = [-0.02, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]

[[recording]]
file = "plug.npz"
sigma = 1e-4

[[marker]]
marker = "m0"
body = "plug"
point = [0.0, 0.0, 0.01]

[[marker]]
marker = "m1"
body = "flap"
point = [0.01, 0.0, 0.0]

[parameters.cable_EI]
initial = 5e-3

[parameters.plug_center_x]
initial = 0.0
"""


def written(folder: Path, text: str = TEXT) -> Path:
    scene = sb.Scene("plug")
    plug = scene.add_body("plug", mass=0.08, inertia=(2e-5, 3e-5, 4e-5), center=(0.003, 0.0, 0.0), at=(0.52, 0.0, 0.0))
    flap = scene.add_body("flap", of=sb.Inertia.box(0.01, (0.02, 0.01, 0.002)), at=(0.55, 0.0, 0.0))
    sb.hinge(plug, flap, at=(0.54, 0.0, 0.0), axis=(0.0, 1.0, 0.0), stiffness=1e-3)
    start, end = sb.Grip.fixed((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), plug.point((-0.02, 0.0, 0.0), along=(1.0, 0.0, 0.0))
    size = {"length": 0.5, "segments": 8, "density": 0.05, "EI": 4e-3, "GJ": 2e-3, "EA": 2e3}
    sb.add_rod(scene, "cable", **size, start=start, end=end)  # type: ignore[arg-type]
    motion = sb.simulate(scene, np.arange(16) * 0.02, sb.Solver(h=2e-3))
    seen = []
    for body, point in ((plug, [0.0, 0.0, 0.01]), (flap, [0.01, 0.0, 0.0])):
        origin, frame = body.pose(motion)
        seen.append(origin + frame @ point)
    sb.Recording(np.stack(seen, axis=1), motion.times).save(folder / "plug.npz")
    (folder / "plug.toml").write_text(text)
    return folder / "plug.toml"


def test_configured_cable_with_plug_and_flap_is_fitted(tmp_path: Path) -> None:
    study = config.load(written(tmp_path))
    found = sb.fit(study.experiments, parameters=study.parameters, refine=False)
    assert found.values["cable_EI"] == pytest.approx(4e-3, rel=1e-5)
    assert found.values["plug_center_x"] == pytest.approx(3e-3, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('upper = "plug"', 'upper = "plgu"', "is not a body of the scene"),
        ('body = "plug"\nposition', 'body = "plgu"\nposition', "is not a body of the scene"),
        ("axis = [0.0, 1.0, 0.0]\n", "", "without axis"),
        ("stiffness = 1e-3", "compliance = 1e-3", "hinge with compliance"),
        ("stiffness = 1e-3", "limits = [0.5, -0.5]", r"scene.joint\[0\].*are not a range"),
        ("stiffness = 1e-3", "limits = [0.1, 0.5]", "0.1 rad outside"),
        ("stiffness = 1e-3", "limits = [0.5]", "limits"),
        ("stiffness = 1e-3", "limit_damping = 0.1", "acts at limits, and there are none"),
        ("box = [0.02, 0.01, 0.002]\n", "", "one of inertia and box"),
        ("[2e-5, 3e-5, 4e-5]", "[2e-5, 3e-5, 6e-5]", "that of no body"),
        ('name = "flap"', 'name = "plug"', "is taken"),
    ],
)
def test_mistakes_in_bodies_and_joints_are_told(tmp_path: Path, old: str, new: str, match: str) -> None:
    assert old in TEXT
    with pytest.raises(sb.ConfigError, match=match):
        config.load(written(tmp_path, TEXT.replace(old, new)))


MOVED = """
[experiment]
name = "arm"

[solver]
h = 2e-3

[[scene.tool]]
name = "shown"
file = "poses.npz"

[[scene.body]]
name = "box"
mass = 0.4
box = [0.1, 0.2, 0.3]
starts_on = "shown"
start_falls = true

[[scene.body]]
name = "upper"
mass = 0.3
box = [0.2, 0.02, 0.02]
at = [0.1, 0.0, 0.0]

[[scene.body]]
name = "lower"
mass = 0.2
box = [0.2, 0.02, 0.02]
at = [0.3, 0.0, 0.0]

[[scene.joint]]
kind = "hinge"
name = "shoulder"
lower = "upper"
at = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
servo = { times = [0.0, 0.1, 0.2], values = [0.0, 0.3, 0.2] }

[[scene.joint]]
kind = "hinge"
name = "elbow"
upper = "upper"
lower = "lower"
at = [0.2, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
torque = { times = [0.0, 0.1], values = [0.1, -0.2] }
rotor = 1e-5

[[scene.force]]
name = "push"
body = "lower"
point = [0.1, 0.0, 0.0]
force = [0.0, 0.0, 1.0]
times = [0.0, 0.1]
factors = [1.0, 0.5]
"""


def moved(folder: Path, text: str = MOVED) -> sb.Scene:
    times = np.arange(8) * 0.01
    spin = np.outer(times, [0.0, 0.0, 2.0])
    places = np.outer(times, [1.0, 0.0, 3.0]) + np.outer(times**2, [0.0, 0.0, -4.905]) + [0.0, 0.0, 1.0]
    half = spin[:, 2] / 2
    turns = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    np.savez(folder / "poses.npz", times=times, positions=places, quaternions=turns)
    (folder / "arm.toml").write_text(text)
    return scene_alone(parse(folder / "arm.toml"), folder)[0]


def test_configured_servo_motor_force_and_start(tmp_path: Path) -> None:
    """As the same scene in Python."""
    scene = moved(tmp_path)
    box = scene.bodies["box"]
    motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=2e-3))
    assert box.pose(motion)[0][0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert box.momentum(motion)[0] == pytest.approx([0.4, 0.0, 1.2], abs=1e-10)
    assert box.angular_velocity(motion)[0] == pytest.approx([0.0, 0.0, 2.0], abs=1e-9)
    same = sb.Scene("arm")
    upper = same.add_body("upper", of=sb.Inertia.box(0.3, (0.2, 0.02, 0.02)), at=(0.1, 0.0, 0.0))
    lower = same.add_body("lower", of=sb.Inertia.box(0.2, (0.2, 0.02, 0.02)), at=(0.3, 0.0, 0.0))
    servo = ([0.0, 0.1, 0.2], [0.0, 0.3, 0.2])
    sb.hinge(None, upper, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), name="shoulder", servo=servo)
    motor = {"torque": ([0.0, 0.1], [0.1, -0.2]), "rotor": 1e-5}
    sb.hinge(upper, lower, at=(0.2, 0.0, 0.0), axis=(0.0, 1.0, 0.0), name="elbow", **motor)  # type: ignore[arg-type]
    same.add_force(lower.point((0.1, 0.0, 0.0)), [[0.0, 0.0, 1.0], [0.0, 0.0, 0.5]], [0.0, 0.1])
    wanted = lower.pose(sb.simulate(same, [0.0, 0.1], sb.Solver(h=2e-3)))
    found = scene.bodies["lower"].pose(motion)
    assert np.allclose(found[0], wanted[0], atol=1e-13) and np.allclose(found[1], wanted[1], atol=1e-12)
    assert {"push_z", "elbow_torque_1", "elbow_rotor"} <= set(scene.quantities)


def test_a_configured_slider_has_a_spring_and_a_damper(tmp_path: Path) -> None:
    given = 'kind = "slider"\nstiffness = 80.0\nrest = -0.02\nviscosity = 0.5\nname = "shoulder"'
    text = MOVED.replace('kind = "hinge"\nname = "shoulder"', given)
    scene = moved(tmp_path, text.replace("servo = { times = [0.0, 0.1, 0.2], values = [0.0, 0.3, 0.2] }\n", ""))
    units = {name: scene.quantities[f"shoulder_{name}"] for name in ("stiffness", "rest", "viscosity")}
    assert {name: (q.value, q.unit) for name, q in units.items()} == {
        "stiffness": (80.0, "N/m"),
        "rest": (-0.02, "m"),
        "viscosity": (0.5, "N s/m"),
    }


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("values = [0.1, -0.2]", "values = [0.1]", "different numbers"),
        ("rotor = 1e-5", "", "rotor"),
        ('starts_on = "shown"', 'starts_on = "other"', "is not a tool of the scene"),
        ('starts_on = "shown"', 'starts_on = "shown"\nat = [0.0, 0.0, 0.0]', "has at"),
        ('starts_on = "shown"\n', "", "no tool for it"),
        ('body = "lower"\npoint', "point", "on nothing"),
        ('body = "lower"\npoint', 'body = "box"\nparticles = ["box"]\npoint', "particles and a body"),
        ('body = "lower"\npoint', 'body = "other"\npoint', "is not a body of the scene"),
    ],
)
def test_mistakes_in_servos_starts_and_forces_are_told(tmp_path: Path, old: str, new: str, match: str) -> None:
    assert old in MOVED
    with pytest.raises(sb.ConfigError, match=match):
        moved(tmp_path, MOVED.replace(old, new, 1))


ON_A_BODY = """
[experiment]
name = "flag"

[solver]
h = 2e-3

[[scene.body]]
name = "pole"
mass = 0.05
box = [0.2, 0.01, 0.01]
at = [0.1, 0.15, 0.0]

[[scene.joint]]
kind = "hinge"
name = "hinge"
lower = "pole"
at = [0.1, 0.15, 0.1]
axis = [1.0, 0.0, 0.0]

[[scene.cloth]]
name = "flag"
density = 0.2
warp = 50.0
shear = 10.0
bending = 1e-4

[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.15
nx = 4
ny = 3

[[scene.cloth.grip]]
set = "top"
body = "pole"

[[scene.particles]]
name = "air"
positions = [[0.1, 0.15, -0.9]]
mass = 1e-9
drag = 1e-3
body = "pole"
"""


def test_a_cloth_and_particles_with_drag_are_attached_to_a_body(tmp_path: Path) -> None:
    """On a fixed hinge, drag c at the distance r is a torque of c r^3 rate^2."""
    (tmp_path / "flag.toml").write_text(ON_A_BODY)
    scene = scene_alone(parse(tmp_path / "flag.toml"))[0]
    cloth, pole = scene.cloths["flag"], scene.bodies["pole"]
    assert list(pole.attached) == [*cloth.particles[cloth.mesh.sets["top"]], cloth.particles[-1] + 1]
    assert scene.quantities["air_drag"].value == 1e-3 and {"flag_top_on_pole", "air_on_pole"} <= {
        g.name for g in scene.groups
    }

    bare = ON_A_BODY[: ON_A_BODY.index("[[scene.cloth]]")] + ON_A_BODY[ON_A_BODY.index("[[scene.particles]]") :]
    (tmp_path / "bare.toml").write_text(bare.replace("[solver]", "[scene]\ngravity = [0.0, 0.0, 0.0]\n\n[solver]"))
    scene = scene_alone(parse(tmp_path / "bare.toml"))[0]
    moment = 0.05 * (0.01**2 / 6 + 0.1**2)
    motion = sb.simulate(scene, [0.0, 0.2], sb.Solver(h=1e-3), {"hinge_rate": 2.0})
    rate = scene.bodies["pole"].angular_velocity(motion)[1, 0]
    assert rate == pytest.approx(2.0 / (1.0 + 2.0 * 0.2 * 1e-3 / moment), rel=2e-3)
    for old, new, words in (
        ('body = "pole"', 'body = "none"', "is not a body of the scene"),
        ("drag = 1e-3", "pinned = true", r"^scene.particles\[0\].particles: cannot fix these"),
    ):
        (tmp_path / "wrong.toml").write_text(ON_A_BODY.replace(old, new))
        with pytest.raises(sb.ConfigError, match=words):
            scene_alone(parse(tmp_path / "wrong.toml"))


def test_a_wrist_that_holds_a_body_weighs_its_load(tmp_path: Path) -> None:
    times = np.arange(41) * 0.01
    places = np.stack([0.05 * np.sin(8 * times), 0 * times, 0.03 * np.sin(11 * times)], axis=1)
    quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (41, 1))
    np.savez(tmp_path / "robot.npz", times=times, positions=places, quaternions=quaternions)
    scene, solver = sb.Scene("held"), sb.Solver(h=1e-3)
    hand = scene.add_body("hand", of=sb.Inertia.box(1e-3, (0.02,) * 3), poses=sb.Tool(times, places, quaternions))
    load = scene.add_body("load", of=sb.Inertia.box(0.3, (0.05, 0.05, 0.08)), at=(0.0, 0.0, -0.05))
    sb.fixed(hand, load, at=(0.0, 0.0, -0.01), name="grasp")
    size = {"length": 0.1, "segments": 2, "density": 1e-3, "EI": 1e-4, "GJ": 1e-4}
    sb.add_rod(scene, "cable", **size, start=load.point((0.0, 0.0, -0.04), along=(0.0, 0.0, -1.0)))  # type: ignore[arg-type]
    wrist = sb.simulate_forces(scene, times[1:], hand, solver)
    same = sb.simulate_forces(scene, times[1:], hand.particles.tolist(), solver)
    assert (wrist.forces == same.forces).all()
    with pytest.raises(sb.InputError, match="is a body of another scene"):
        sb.simulate_forces(sb.rope(0.1, 8, density=0.05, EI=1e-4), [0.01], hand, solver)
    np.savez(tmp_path / "wrist.npz", times=wrist.times, forces=wrist.forces)
    sb.Recording(load.pose(sb.simulate(scene, times, solver))[0][:, None], times).save(tmp_path / "seen.npz")
    (tmp_path / "held.toml").write_text(HELD, encoding="utf-8")
    study = config.load(tmp_path / "held.toml")
    rod = study.experiments[0].scene.ropes["cable"]
    along = sb.simulate(study.experiments[0].scene, [0.0], solver).positions[0, rod.particles]
    assert along == pytest.approx(np.linspace([0.0, 0.0, -0.09], [0.0, 0.0, -0.19], 3), abs=1e-15)  # as its grip points
    found = sb.fit(study.experiments, parameters=study.parameters, refine=False)
    assert found.values["load_mass"] == pytest.approx(0.3, rel=1e-6)
    (tmp_path / "held.toml").write_text(HELD.replace('at = ["hand"]', 'at = ["load"]'), encoding="utf-8")
    with pytest.raises(sb.SheetbendError, match="nothing holds"):
        config.load(tmp_path / "held.toml")


HELD = """
[experiment]
name = "held"

[solver]
h = 1e-3

[[recording]]
file = "seen.npz"
sigma = 1e-4

[[recording.force]]
file = "wrist.npz"
at = ["hand"]
sigma = 0.05

[[scene.tool]]
name = "robot"
file = "robot.npz"

[[scene.body]]
name = "hand"
mass = 1e-3
box = [0.02, 0.02, 0.02]
tool = "robot"

[[scene.body]]
name = "load"
mass = 0.2
box = [0.05, 0.05, 0.08]
at = [0.0, 0.0, -0.05]

[[scene.joint]]
kind = "fixed"
name = "grasp"
upper = "hand"
lower = "load"
at = [0.0, 0.0, -0.01]

[[scene.rod]]
name = "cable"
length = 0.1
segments = 2
density = 1e-3
EI = 1e-4
GJ = 1e-4

[[scene.rod.grip]]
at = "start"
body = "load"
position = [0.0, 0.0, -0.04]
direction = [0.0, 0.0, -1.0]

[[marker]]
marker = 0
body = "load"
point = [0.0, 0.0, 0.0]

[parameters.load_mass]
"""
