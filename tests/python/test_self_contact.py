"""Ropes and cloths that touch themselves and each other."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import parse, scene_alone
from sheetbend.mesh import grid

KNOT = runpy.run_path(str(Path(__file__).resolve().parents[2] / "experiments" / "bench" / "knot.py"))
G = 9.81
SOLVER = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")


def nearest(x: np.ndarray, edges: np.ndarray) -> float:
    """The least distance between edges that share no particle."""
    a, b = np.triu_indices(len(edges), 1)
    apart = (edges[a][:, :, None] != edges[b][:, None, :]).all(axis=(1, 2))
    a, b = edges[a[apart]], edges[b[apart]]
    u, v, r = x[a[:, 1]] - x[a[:, 0]], x[b[:, 1]] - x[b[:, 0]], x[a[:, 0]] - x[b[:, 0]]
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    ur, vr = (u * r).sum(1), (v * r).sum(1)
    s = np.clip((uv * vr - vv * ur) / np.maximum(uu * vv - uv * uv, 1e-12 * uu * vv), 0, 1)
    for _ in range(100):  # alternating projections, for pairs at the ends of segments
        t = np.clip((vr + s * uv) / vv, 0, 1)
        s = np.clip((t * uv - ur) / uu, 0, 1)
    return float(np.linalg.norm(r + s[:, None] * u - t[:, None] * v, axis=1).min())


def crossed(height: float = 0.012, **options: object) -> sb.Scene:
    """A rope between two posts, and a softer one that hangs across it."""
    scene = sb.Scene("crossed")
    for name, EA, start, along in (
        ("lower", 5000.0, (-0.15, 0, 0), (1, 0, 0)),
        ("upper", 200.0, (0.002, -0.15, height), (0, 1, 0)),
    ):
        numbers = {"length": 0.3, "segments": 15, "density": 0.05, "EA": EA, "EI": 1e-4, **options}
        rope = sb.add_rope(scene, name, start=start, direction=along, **numbers)  # type: ignore[arg-type]
        scene.pin(rope.particles[[0, -1]])
    return scene


def test_two_ropes_rest_across_each_other():
    scene = crossed(stretch_damping=0.02)
    scene.add_self_contact(radius=0.005)
    motion = sb.simulate(scene, [0.0, 0.5, 1.0, 1.5], SOLVER)
    edges = np.concatenate([np.stack([p[:-1], p[1:]], 1) for p in (r.particles for r in scene.ropes.values())])
    gaps = [nearest(x, edges) - 0.01 for x in motion.positions]
    assert gaps[-1] == pytest.approx(0.0, abs=1e-6)  # it lies on the other one
    middle = motion.positions[-1][scene.ropes["lower"].particles[7], 2]
    free = sb.simulate(crossed(stretch_damping=0.02), [0.0, 1.5], SOLVER).positions[-1]
    assert middle < free[scene.ropes["lower"].particles[7], 2] - 1e-4  # and presses it down


def test_where_forces_do_not_balance_friction_of_pairs_is_named():
    scene = crossed(0.0101)
    scene.add_self_contact(radius=0.005, friction=0.3)
    few = sb.Solver(h=1e-3, method="implicit", iterations=2)
    with pytest.raises(sb.UnbalancedError, match="or leave out the friction between pieces"):
        sb.simulate(scene, [0.0, 0.1], few)


def test_what_is_driven_may_follow_what_flies_ahead():
    """By more than the gap in a substep: where nothing but the hand moved, they would pass through each other."""
    scene = sb.Scene("chase", gravity=(0, 0, 0))
    rope = {"segments": 4, "density": 0.05, "EA": 500.0, "EI": 1e-4}
    hand, free = (
        sb.add_rope(scene, name, points=[[x, y, 0], [0.1 - x, y, 0]], velocity=[[0, 1, 0], [0, 1, 0]], **rope)  # type: ignore[arg-type]
        for name, x, y in (("hand", 0.0, 0.0), ("free", 0.02, 0.003))
    )
    held = [[x, 0, 0] for x in (0.0, 0.05, 0.1)]
    scene.drive(hand.particles[::2], [0.0, 0.1], np.add(held, [[[0, 0, 0]], [[0, 0.1, 0]]]), "linear")
    scene.add_self_contact(radius=0.001)
    motion = sb.simulate(scene, [0.0, 0.05, 0.1], sb.Solver(h=0.01, method="implicit", integrator="bdf1"))
    assert motion.positions[:, free.particles, 1] == pytest.approx(0.003 + np.tile(motion.times[:, None], 5), abs=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_momentum_is_kept(friction: float):
    scene = sb.Scene("thrown", gravity=(0, 0, 0))
    for name, y, v in (("a", 0.0, 0.0), ("b", 0.03, -1.5)):
        points = np.stack([np.linspace(0, 0.2, 3), np.full(3, y), 0.02 * np.sin(np.arange(3) + y)], 1)
        sb.add_rope(
            scene, name, points=points, segments=6, density=0.05, EA=200.0, EI=1e-4,
            velocity=np.tile([0.1, v, 0.2], (3, 1)),
        )  # fmt: skip
    scene.add_self_contact(radius=[0.004, 0.006], friction=friction)
    h = SOLVER.h
    motion = sb.simulate(scene, np.arange(81) * h, SOLVER)
    inputs = scene.compiled.unpack(scene.compiled.inputs())
    momentum = inputs["mass"] @ (np.diff(motion.positions, axis=0) / h)
    started = inputs["mass"] @ inputs["velocity"]
    assert np.abs(momentum - started).max() <= 1e-12 * np.abs(started).max()
    one = scene.ropes["a"].particles  # which the other one has pushed
    moved = inputs["mass"][one] @ (np.diff(motion.positions, axis=0)[-1, one] / h)
    assert moved[1] < -1e-3
    assert set(motion.contacts) == ({"self"} if friction else set())
    for pairs in motion.contacts.values():
        assert 0 < pairs.most < 2 * len(scene.contacts.pieces) * 6
        assert pairs.began >= pairs.most and pairs.ended > 0
        assert pairs.sliding_share + pairs.sticking_share == pytest.approx(1.0, abs=1e-12)
        assert pairs.deepest is None


def on_a_slope(friction: float) -> sb.Scene:
    """A rope lies across a stiff one that is held at its ends, on a slope of 30 degrees."""
    scene = sb.Scene("slope", gravity=(0.5 * G, 0, -np.sqrt(0.75) * G))
    held = sb.add_rope(scene, "held", start=(-0.2, 0, 0), length=0.6, segments=2, density=0.05, EA=5000.0, EI=100.0)
    scene.pin(held.particles[[0, -1]])
    numbers = {"length": 0.1, "segments": 2, "density": 0.05, "EA": 200.0, "EI": 0.1}
    sb.add_rope(scene, "sliding", start=(0, -0.05, 0.01), direction=(0, 1, 0), **numbers)  # type: ignore[arg-type]
    scene.add_self_contact(radius=0.005, friction=friction, pairs=4)
    return scene


def test_a_rope_that_slides_on_another_tells_their_friction():
    true, model = on_a_slope(0.3), on_a_slope(0.2)
    one = true.ropes["sliding"].particles
    times = np.linspace(0.0, 0.2, 21)
    world = sb.Solver(h=2e-4, method="implicit", integrator="bdf1", extrapolate=2)
    x = sb.simulate(true, times, world).positions[:, one]
    path = 0.5 * G * times**2
    assert x[:, 1, 0] == pytest.approx((0.5 - 0.3 * np.sqrt(0.75)) * path, abs=2e-3 * path[-1])
    seen = x + 1e-4 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=seen, times=times, name="slope")
    places = [sb.on_particle(int(p)) for p in one]
    fit = sb.fit(model, recording, ["self_friction"], markers=places, solver=SOLVER, sigma=1e-4)
    (friction,) = fit.result.estimates
    assert friction.verdict == "identified"
    assert friction.lower < 0.3 < friction.upper < friction.lower + 0.01
    (pairs,) = fit.result.contacts
    assert (pairs.contact, pairs.particles) == ("self", 4) and 0 < pairs.most <= 2
    assert pairs.sliding > 0.9


KNOT_SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_knot_is_drawn_tight_and_held_and_nothing_passes_through(friction: float):
    scene, ends, away = KNOT["open_knot"](60, friction)
    x = scene.nodes[ends]
    drawn = x + 0.15 * away
    scene.drive(ends, [0.0, 1.5, 2.0], np.stack([x, drawn, drawn]), "linear")
    edges = scene.contacts.pieces[0].edges
    motion = sb.simulate(scene, np.linspace(0.0, 1.9, 476), KNOT_SOLVER)
    least = [nearest(x, edges) for x in motion.positions]
    assert min(least) > 0.95 * 0.006
    steps = np.linalg.norm(np.diff(motion.positions, axis=0), axis=2).max()
    assert 2 * steps < min(least)  # so that nothing passes unseen between frames
    assert least[-1] < 0.006 + 1e-4


def test_a_tight_knot_holds_without_load_where_it_rubs_and_opens_where_it_is_smooth():
    """Its ends are pulled with 4 mN, and then with less and less. What is in the loop shows whether it slips."""
    opened = {}
    for friction in (0.0, 0.2):
        scene, ends, away = KNOT["open_knot"](60, friction)
        scene.add_force(ends, np.array([1.2e-3, 4e-3, 4e-3, 0.0, 0.0])[:, None, None] * away, [0.0, 2.0, 4.0, 6.0, 6.4])
        motion = sb.simulate(scene, np.linspace(0.0, 6.4, 129), KNOT_SOLVER)
        edges = scene.contacts.pieces[0].edges
        assert min(nearest(x, edges) for x in motion.positions) > 0.95 * 0.006
        apart = np.linalg.norm(motion.positions[:, ends[1]] - motion.positions[:, ends[0]], axis=1)
        in_loop = scene.ropes["rope"].length - apart
        opened[friction] = in_loop[-1] / in_loop[80] - 1.0
    assert opened[0.0] > 0.5
    assert opened[0.2] < 0.05


def folded() -> sb.Scene:
    """A cloth that hangs over itself: one half falls on the other."""
    mesh = grid(0.2, 0.1, 8, 4, "one_way")
    scene = sb.Scene("folded")
    angle = 0.35
    x = mesh.vertices.copy()
    flap = x[:, 0] > 0.1
    x[flap] = np.stack(
        [0.1 - (x[flap, 0] - 0.1) * np.cos(angle), x[flap, 1], (x[flap, 0] - 0.1) * np.sin(angle)], axis=1
    )
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=200.0, shear=50.0, bending=1e-5, positions=x)
    scene.add_contact(cloth, sb.Plane(point=(0, 0, -0.002), name="table"), friction=0.3, radius=0.001)
    scene.add_self_contact(cloth, radius=0.001)
    return scene


def test_a_cloth_folded_once_lies_on_itself():
    scene = folded()
    motion = sb.simulate(scene, [0.0, 0.1, 0.2, 0.3], SOLVER)
    edges = scene.contacts.pieces[0].edges
    assert nearest(motion.positions[-1], edges) > 0.95 * 0.002
    assert motion.positions[-1][:, 2].max() < 0.05


def test_the_gradient_is_that_of_differences():
    scene = crossed(height=0.0105)
    scene.add_self_contact(radius=[0.005, 0.004])
    report = sb.check_gradients(scene, np.linspace(0, 0.05, 3), SOLVER, samples=2)
    assert report.passed, report
    assert {"self_contact_radius_0", "self_contact_radius_1"} <= set(scene.quantities)


def test_the_gradient_with_friction_is_that_of_differences():
    report = sb.check_gradients(on_a_slope(0.3), [0.0, 0.01, 0.02], SOLVER, samples=2)
    assert report.passed, report
    rows = {row.name: row for row in report.rows}
    assert not rows["self_friction"].unfelt and rows["self_friction"].gradient > 0.0


def test_what_cannot_be_is_refused(tmp_path: Path):
    rope = {"length": 0.3, "segments": 15, "density": 0.05, "EA": 500.0, "EI": 1e-4}
    for radius, friction, words in (
        (0.011, 0, "half a link"),
        (-1.0, 0, "must be positive"),
        (0.005, -0.3, "negative"),
    ):
        scene = sb.rope(**rope)
        with pytest.raises(sb.SceneError, match=words):
            scene.add_self_contact(radius=radius, friction=friction)
    scene = crossed(height=0.007)
    scene.add_self_contact(radius=0.005)
    with pytest.raises(sb.SceneError, match=r"0\.00\d+ m too near"):
        sb.simulate(scene, 0.01, SOLVER)
    scene = crossed()
    scene.add_self_contact(radius=0.005)
    with pytest.raises(sb.SceneError, match="in one call"):
        scene.add_self_contact(radius=0.004)
    with pytest.raises(ValueError, match="implicit"):
        sb.simulate(scene, 0.01, sb.Solver(h=1e-3, method="newton"))
    with pytest.raises(sb.SceneError, match="scene files"):
        sb.save_scene(scene, tmp_path / "scene.npz")
    with pytest.raises(ValueError, match="rest"):
        sb.equilibrium(scene)


def test_a_cloth_that_begins_nearer_to_itself_than_its_thickness_is_refused():
    """With a flap that hangs too low, and with half a thickness of more than half an edge."""

    def compiled(above: float, radius: float) -> object:
        mesh = grid(0.2, 0.1, 8, 4, "one_way")
        x = mesh.vertices.copy()
        flap = x[:, 0] > 0.13
        x[flap] = np.stack([0.26 - x[flap, 0], x[flap, 1], np.full(flap.sum(), above)], axis=1)
        scene = sb.Scene("folded")
        cloth = sb.add_cloth(scene, mesh, density=0.2, warp=200.0, shear=50.0, positions=x)
        scene.add_self_contact(cloth, radius=radius)
        return scene.compiled

    assert compiled(above=0.02, radius=0.001)
    for above, radius in ((0.0015, 0.001), (0.1, 0.013)):
        with pytest.raises(sb.SceneError, match=r"0\.00\d+ m too near to itself.*half the thickness of cloth"):
            compiled(above, radius)


TWO = """\
[experiment]
name = "crossed"

[solver]
h = 1e-3
method = "implicit"
integrator = "bdf1"

[[scene.rope]]
name = "lower"
length = 0.3
segments = 15
density = 0.05
EA = 5000.0
EI = 1e-4
start = [-0.15, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
pinned = [0, -1]

[[scene.rope]]
name = "upper"
length = 0.3
segments = 15
density = 0.05
EA = 200.0
EI = 1e-4
start = [0.002, -0.15, 0.012]
direction = [0.0, 1.0, 0.0]
pinned = [0, -1]

[scene.self_contact]
radius = 0.005
"""


def test_a_file_builds_what_python_builds(tmp_path: Path):
    path = tmp_path / "crossed.toml"
    path.write_text(TWO)
    read, solver = scene_alone(parse(path))
    scene = crossed()
    scene.add_self_contact(radius=0.005)
    assert np.array_equal(*(sb.simulate(s, [0.0, 0.1], solver).positions for s in (read, scene)))
    path.write_text(TWO.replace("radius = 0.005", 'of = ["lower", "upper"]\nradius = [0.005, 0.004]\nfriction = 0.3'))
    quantities = scene_alone(parse(path))[0].quantities
    assert (quantities["self_contact_radius_1"].value, quantities["self_friction"].value) == (0.004, 0.3)
    for old, new, words in (
        ("radius = 0.005", 'of = "cord"\nradius = 0.005', "no rope, cloth or body"),
        ("radius = 0.005", "radius = [0.005, 0.004]", "name each piece"),
        ("radius = 0.005", "radius = 0.005\nfriction = -0.3", "friction"),
        ('method = "implicit"', 'method = "direct"', "implicit"),
    ):
        path.write_text(TWO.replace(old, new))
        with pytest.raises(sb.ConfigError, match=words):
            scene_alone(parse(path))
