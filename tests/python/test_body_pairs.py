"""Capsules of bodies that touch ropes, cloths and each other."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import parse, scene_alone
from sheetbend.mesh import grid

SOLVER = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")
LINE = [[0.0, -0.1, 0.0], [0.0, 0.1, 0.0]]
BAR = sb.Inertia.box(0.05, (0.02, 0.2, 0.02))


def bar_on_ropes(height: float = 0.0151, friction: float = 0.0, speed: float = 0.0, **options: object) -> sb.Scene:
    """A bar lies across two ropes that are held at their ends."""
    scene = sb.Scene("bar on two ropes")
    numbers = {"length": 0.4, "segments": 10, "density": 0.05, "EA": 500.0, "EI": 1e-4, **options}
    for name, y in (("left", -0.05), ("right", 0.05)):
        rope = sb.add_rope(scene, name, start=(-0.2, y, 0.0), **numbers)  # type: ignore[arg-type]
        scene.pin(rope.particles[[0, -1]])
    bar = scene.add_body("bar", of=BAR, at=(0.01, 0.0, height), velocity=(0.0, 0.0, -speed))
    pieces = [*scene.ropes.values(), bar.capsules(LINE)]
    scene.add_self_contact(*pieces, radius=[0.005, 0.005, 0.01], friction=friction, pairs=8)
    return scene


def least_gap(scene: sb.Scene, nodes: np.ndarray) -> float:
    """Between points of the bar's line and of the ropes' links, 1 mm apart."""
    place, axes = scene.bodies["bar"].pose(nodes)
    line = place + np.linspace(*LINE, 201) @ axes.T
    share = np.linspace(0.0, 1.0, 41)[:, None, None]
    chains = [nodes[rope.particles] for rope in scene.ropes.values()]
    points = np.concatenate([((1.0 - share) * x[:-1] + share * x[1:]).reshape(-1, 3) for x in chains])
    return float(np.linalg.norm(line[:, None] - points, axis=2).min()) - 0.015


def test_a_bar_rests_on_two_ropes_and_draws_them_down():
    scene = bar_on_ropes(stretch_damping=0.05, friction=0.5)
    motion = sb.simulate(scene, [0.0, 0.4, 0.8], SOLVER)
    assert least_gap(scene, motion.nodes[-1]) == pytest.approx(0.0, abs=5e-5)  # of lines 1 mm apart
    place, _ = scene.bodies["bar"].pose(motion)
    assert -0.03 < place[-1, 2] < 0.01
    assert motion.positions[-1][scene.ropes["left"].particles[5], 2] < -0.005
    assert motion.contacts["self"].most >= 2


def test_a_net_with_knots_catches_a_ball():
    """A ball is a short capsule. Between strings that only lie across each other it would fall through."""
    scene = sb.Scene("net")
    for k, at in enumerate((-0.02, 0.0, 0.02)):
        for name, start, along in ((f"a{k}", (-0.06, at, 0), (1, 0, 0)), (f"b{k}", (at, -0.06, -0.004), (0, 1, 0))):
            rope = sb.add_rope(
                scene, name, length=0.12, segments=6, density=0.01, EA=200.0, EI=1e-6, start=start, direction=along,
                stretch_damping=0.02,
            )  # fmt: skip
            scene.pin(rope.particles[[0, -1]])
    a, b = ([scene.ropes[f"{name}{k}"].particles for k in range(3)] for name in "ab")
    knots = [[a[i][2 + j], b[j][2 + i]] for i in range(3) for j in range(3)]
    scene.add_constraints("distance", knots, name="knots", compliance=1e-6)
    ball = scene.add_body("ball", of=sb.Inertia.ball(0.05, 0.015), at=(0.004, 0.003, 0.02))
    sphere = ball.capsules([[(0, 0, -1e-4), (0, 0, 1e-4)]])
    scene.add_self_contact(*scene.ropes.values(), sphere, radius=[*6 * [0.001], 0.015])
    motion = sb.simulate(scene, [0.0, 0.15, 0.3, 0.45], SOLVER)
    heights = ball.pose(motion)[0][1:, 2]
    assert (heights > -0.01).all(), heights
    assert (heights < 0.015).all(), heights


def test_a_bar_lies_on_a_cloth_and_on_another_bar():
    scene = sb.Scene("heap", gravity=(0, 0, -9.81))
    mesh = grid(0.2, 0.2, 4, 4, "one_way")
    border = np.flatnonzero((np.abs(mesh.vertices[:, :2] - 0.1) > 0.099).any(axis=1))
    cloth = sb.add_cloth(scene, mesh, density=0.3, warp=500.0, shear=100.0, bending=1e-4, held=border)
    scene.pin(cloth.particles[border])
    pieces = []
    for k, turn in enumerate([(0, 0, 0.1, 1), (0, 0, 1, 1)]):
        bar = scene.add_body(f"bar{k}", of=BAR, at=(0.1, 0.1, 0.0115 + 0.0205 * k), rotation=turn)
        pieces.append(bar.capsules([[0.0, -0.05, 0.0], [0.0, 0.05, 0.0]]))
    scene.add_self_contact(cloth, *pieces, radius=[0.001, 0.01, 0.01])
    motion = sb.simulate(scene, np.linspace(0.0, 0.1, 6), SOLVER)
    low, high = (scene.bodies[f"bar{k}"].pose(motion)[0][:, 2] for k in range(2))
    assert (high - low).min() > 0.02 - 1e-5
    assert low.min() > -0.015  # the cloth holds both, which would be at -0.038 by now
    assert motion.positions[-1][cloth.particles, 2].min() < -0.005


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_gradient_is_that_of_differences(friction: float):
    scene = bar_on_ropes(height=0.0155, friction=friction, speed=0.1)
    report = sb.check_gradients(scene, np.linspace(0, 0.03, 4), SOLVER, samples=2)
    assert report.passed, report
    rows = {row.name: row for row in report.rows}
    for name in ("self_contact_radius_2", "bar_mass", "bar_inertia_1", "bar_center_y", "bar_z", "left_EA"):
        assert not rows[name].unfelt, name


def test_the_core_is_the_same_after_a_copy():
    scene = bar_on_ropes(height=0.01499)
    core = scene.compiled.core
    copy = pickle.loads(pickle.dumps(core))
    inputs = scene.compiled.inputs()
    (gaps, nodes), (same, own) = core.pair_gaps(inputs), copy.pair_gaps(inputs)
    assert gaps == pytest.approx([-6.2e-7, -6.2e-7], abs=2e-8)  # softened: 9.4e-6 less near
    assert np.array_equal(gaps, same) and np.array_equal(nodes, own)


def test_what_cannot_be_is_refused():
    scene = sb.Scene("bar")
    bar = scene.add_body("bar", of=BAR)
    for ends, words in (
        ([[0, 0, 0]], "shape"),
        ([[0, 0, 0], [0, 0, 0]], "one place"),
        ([[0, 0, 0], [0, np.nan, 0]], "finite"),
    ):
        with pytest.raises(sb.SceneError, match=words) as error:
            bar.capsules(ends)
        assert error.value.field == "bar.capsules"
    with pytest.raises(sb.SceneError, match="must be positive"):
        scene.add_self_contact(bar.capsules(LINE), radius=-0.01)
    with pytest.raises(sb.SceneError, match=r"capsules"):
        scene.add_self_contact(bar, radius=0.01)
    with pytest.raises(sb.SceneError, match="capsules of the scene"):
        sb.Scene("other").add_self_contact(bar.capsules(LINE), radius=0.01)
    deep = bar_on_ropes(height=0.013)
    with pytest.raises(sb.SceneError, match=r"0\.00199 m too near to itself, at .*the body 'bar'"):
        sb.simulate(deep, 0.01, SOLVER)
    with pytest.raises(ValueError, match=r"bodies may touch each other.*use implicit"):
        sb.simulate(bar_on_ropes(), 0.01, sb.Solver(h=1e-3))
    with pytest.raises(ValueError, match="rest"):
        sb.equilibrium(bar_on_ropes())


FILE = """\
[experiment]
name = "bar"

[solver]
h = 1e-3
method = "implicit"
integrator = "bdf1"

[[scene.rope]]
name = "left"
length = 0.4
segments = 10
density = 0.05
EA = 500.0
EI = 1e-4
start = [-0.2, -0.05, 0.0]
pinned = [0, -1]

[[scene.rope]]
name = "right"
length = 0.4
segments = 10
density = 0.05
EA = 500.0
EI = 1e-4
start = [-0.2, 0.05, 0.0]
pinned = [0, -1]

[[scene.body]]
name = "bar"
mass = 0.05
box = [0.02, 0.2, 0.02]
at = [0.01, 0.0, 0.0151]
capsules = [[[0.0, -0.1, 0.0], [0.0, 0.1, 0.0]]]

[scene.self_contact]
of = ["left", "right", "bar"]
radius = [0.005, 0.005, 0.01]
"""


def test_a_file_builds_what_python_builds(tmp_path: Path):
    path = tmp_path / "bar.toml"
    path.write_text(FILE)
    read, solver = scene_alone(parse(path))
    scene = bar_on_ropes()
    ends = [s.bodies["bar"].pose(sb.simulate(s, [0.0, 0.05], solver)) for s in (read, scene)]
    for one, other in zip(*ends, strict=True):
        assert one == pytest.approx(other, abs=1e-12)
    for old, new, words in (
        ("capsules = ", "# capsules = ", "body with capsules"),
        ('name = "bar"\nmass', 'name = "left"\nmass', "rope or cloth"),
        ("[0.0, 0.1, 0.0]]]", "[0.0, -0.1, 0.0]]]", r"scene\.body\[0\].*one place"),
        ("[0.0, 0.1, 0.0]]]", "[0.0, 0.1]]]", "capsules"),
    ):
        path.write_text(FILE.replace(old, new))
        with pytest.raises(sb.ConfigError, match=words):
            scene_alone(parse(path))
