"""Chains of hinged bodies: each start is made of the one above it, in files too; and what is attached to a body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch
from scipy.spatial.transform import Rotation
from sheetbend.config import build, parse
from test_scene_file import altered

SIDE = 0.1  # m, of a body along the chain


def chain(count: int, backwards: bool = False) -> tuple[sb.Scene, list[sb.Body], np.ndarray]:
    """Bodies along x from the origin, hinged about axes of all directions; perhaps joined the last one first."""
    scene, rng = sb.Scene("chain"), np.random.default_rng(2)
    axes = rng.standard_normal((count, 3))
    of = sb.Inertia.box(0.2, (SIDE, 0.04, 0.03))
    bodies = [scene.add_body(f"b{k}", of=of, at=(SIDE * (k + 0.5), 0.0, 0.0)) for k in range(count)]
    for k in range(count)[:: -1 if backwards else 1]:
        upper = None if k == 0 else bodies[k - 1]
        sb.hinge(upper, bodies[k], at=(SIDE * k, 0.0, 0.0), axis=axes[k], name=f"h{k}", rate=0.1 * k)
    return scene, bodies, axes / np.linalg.norm(axes, axis=1)[:, None]


@pytest.mark.parametrize("backwards", [False, True])
def test_a_chain_starts_where_its_angles_say(backwards: bool) -> None:
    """Places, attitudes and velocities of six bodies by a product of rotations; their gradient is exact."""
    scene, bodies, axes = chain(6, backwards)
    angles, rates = np.linspace(0.5, -0.7, 6), np.linspace(-2.0, 1.0, 6)
    values = {f"h{k}_angle": a for k, a in enumerate(angles)} | {f"h{k}_rate": w for k, w in enumerate(rates)}
    start = sb.simulate(scene, [0.0], sb.Solver(h=1e-3), values)
    hinge, turned, v, spin = np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3)
    for k, body in enumerate(bodies):
        spin = spin + turned @ axes[k] * rates[k]
        turned = turned @ Rotation.from_rotvec(axes[k] * angles[k]).as_matrix()
        origin, frame = body.pose(start)
        half = turned @ [0.5 * SIDE, 0.0, 0.0]
        assert origin[0] == pytest.approx(hinge + half, abs=1e-14)
        assert frame[0] == pytest.approx(turned, abs=1e-14)
        assert body.angular_velocity(start)[0] == pytest.approx(spin, abs=1e-12)
        assert start.node_velocities[0, body.particles[0]] == pytest.approx(v + np.cross(spin, half), abs=1e-13)
        hinge, v = hinge + 2.0 * half, v + np.cross(spin, 2.0 * half)
    report = sb.check_gradients(scene, [0.005, 0.01], sb.Solver(h=5e-3), samples=1, values=values)
    assert report.passed, str(report)


def test_the_terms_of_a_long_chain_grow_with_its_length() -> None:
    sizes = [len(chain(n)[0].every_term) for n in (20, 40, 60)]
    assert sizes[2] - sizes[1] == pytest.approx(sizes[1] - sizes[0], rel=0.05)
    assert sizes[2] < 60 * 800


def test_a_chain_is_kept_in_a_file(tmp_path: Path) -> None:
    scene, _, _ = chain(4)
    sb.save_scene(scene, tmp_path / "a.scene")
    loaded = sb.load_scene(tmp_path / "a.scene")
    values, times, solver = {"h0_angle": 0.3, "h2_rate": 1.0}, [0.0, 0.01], sb.Solver(h=5e-3)
    one, two = (sb.rollout(s, times, solver, values) for s in (scene, loaded))
    assert np.array_equal(one.nodes, two.nodes)
    bar = np.ones_like(one.positions)
    assert one.gradient(bar).quantities == two.gradient(bar).quantities
    assert one.gradient(bar).quantities["h0_angle"] != 0.0
    sb.save_scene(loaded, tmp_path / "b.scene")
    whole = (tmp_path / "a.scene").read_bytes()
    assert (tmp_path / "b.scene").read_bytes() == whole
    late = np.array(scene.compiled.map()["target"])
    late[np.flatnonzero(late < 0)[-1]] = -1  # a part of the first intermediate value, when others are made of it
    (tmp_path / "c.scene").write_bytes(altered(whole, "target", late))
    skipped = np.where(late < 0, late - 1, late)  # no term makes the first one
    for name, target in (("c", late), ("d", skipped)):
        (tmp_path / f"{name}.scene").write_bytes(altered(whole, "target", target))
        with pytest.raises(sb.SceneError, match="after it is used, or leaves one out"):
            sb.load_scene(tmp_path / f"{name}.scene")


def test_torch_starts_a_chain_where_the_core_does() -> None:
    """With the derivatives with respect to the angles and rates of all hinges."""
    scene, _, _ = chain(5)
    solver, times = sb.Solver(h=5e-3), [0.0, 0.01]
    values = {f"h{k}_angle": 0.2 * k - 0.3 for k in range(5)} | {f"h{k}_rate": 1.0 - k for k in range(5)}
    given = {name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in values.items()}
    found, wanted = st.simulate(scene, times, solver, values=given), sb.rollout(scene, times, solver, values)
    assert np.allclose(found.detach().numpy(), wanted.positions, rtol=0.0, atol=1e-13)
    bar = np.random.default_rng(0).standard_normal(found.shape)
    (found * torch.tensor(bar)).sum().backward()
    gradient = wanted.gradient(bar).quantities
    for name, tensor in given.items():
        assert tensor.grad is not None and float(tensor.grad) == pytest.approx(gradient[name], rel=1e-9, abs=1e-12)


def flag(angle: float = 0.0) -> tuple[sb.Scene, sb.Body, sb.Cloth]:
    """A cloth that hangs from a pole, which swings on a hinge above it."""
    scene = sb.Scene("flag")
    pole = scene.add_body("pole", of=sb.Inertia.box(0.05, (0.22, 0.01, 0.01)), at=(0.1, 0.15, 0.0))
    sb.hinge(None, pole, at=(0.1, 0.15, 0.1), axis=(1.0, 0.3, 0.0), name="hinge", viscosity=1e-4)
    cloth = sb.add_cloth(
        scene, sb.mesh.grid(0.2, 0.15, 4, 3), "sheet", density=0.2, warp=50.0, shear=20.0, bending=1e-4
    )
    sb.attach(pole, cloth.particles[cloth.mesh.sets["top"]])
    return scene, pole, cloth


@pytest.mark.filterwarnings("ignore:sheet")
@pytest.mark.parametrize("method", ["newton", "direct", "implicit"])
def test_the_edge_of_a_cloth_stays_on_its_pole(method: str) -> None:
    """It starts there for any angle and rate of the pole's hinge; the gradient is exact."""
    scene, pole, cloth = flag()
    edge, solver = cloth.particles[cloth.mesh.sets["top"]], sb.Solver(h=2e-3, method=method, iterations=4)
    values = {"hinge_angle": 0.4, "hinge_rate": 2.0}
    motion = sb.simulate(scene, [0.0, 0.02], solver, values)
    origin, frame = pole.pose(scene.nodes)
    kept = (scene.positions[edge] - origin) @ frame
    for moved, origin, frame in zip(motion.positions, *pole.pose(motion), strict=True):
        assert moved[edge] == pytest.approx(origin + kept @ frame.T, abs=1e-9)
    spin, arm = pole.angular_velocity(motion)[0], motion.positions[0, edge] - [0.1, 0.15, 0.1]
    assert motion.velocities[0, edge] == pytest.approx(np.cross(spin, arm), abs=1e-12)
    report = sb.check_gradients(scene, [0.004, 0.008], solver, samples=1, values=values)
    assert report.passed, str(report)


@pytest.mark.parametrize("first", [0.0, -0.13])
def test_what_is_attached_to_a_tool_starts_where_its_correction_says(first: float) -> None:
    """With the tool's velocity, also where the poses begin before the scene; a pan that hangs on a hinge, too. Without
    this, the first substep moves them there, in 2 ms."""
    times = first + np.linspace(0.0, 1.0, 81)
    way = np.stack([0.3 * times, 0.0 * times, 0.1 * np.sin(5.0 * times)], axis=1)
    turned = Rotation.from_rotvec(np.outer(times, [0.5, 0.2, -1.0])).as_quat()
    scene = sb.Scene("held")
    hand = scene.add_body("hand", of=sb.Inertia.box(0.05, (0.2, 0.1, 0.1)), poses=sb.Tool(times, way, turned))
    pan = scene.add_body("pan", of=sb.Inertia.box(0.1, (0.1, 0.05, 0.02)), at=(-0.15, 0.0, 0.0))
    sb.hinge(hand, pan, at=(-0.1, 0.0, 0.0), axis=(0.0, 1.0, 0.0), name="hinge")
    rope = sb.add_rope(
        scene, length=0.4, segments=6, density=0.05, EA=100.0, points=np.linspace([0.1, 0.02, 0.0], [0.5, 0.02, 0.0], 7)
    )
    sb.attach(hand, rope.particles[:1])
    values = {"tool_x": 0.01, "tool_z": -0.02, "tool_turn_y": 0.1, "tool_turn_z": -0.2, "hinge_rate": 0.5}
    h, solver = 1e-4, sb.Solver(h=1e-4)
    motion = sb.simulate(scene, [0.0, h, 0.1], solver, values)
    x, v = motion.positions[:, rope.particles[0]], motion.velocities[0, rope.particles[0]]
    origin, frame = hand.pose(motion)
    held, pin = origin + frame @ [0.1, 0.02, 0.0], origin + frame @ [-0.1, 0.0, 0.0]
    assert x == pytest.approx(held, abs=1e-6)
    assert v == pytest.approx((held[1] - held[0]) / h, abs=1e-3)
    origin, frame = pan.pose(motion)
    assert origin + frame @ [0.05, 0.0, 0.0] == pytest.approx(pin, abs=1e-6)
    spin = pan.angular_velocity(motion)
    assert spin[0] == pytest.approx(spin[1], abs=0.02)
    report = sb.check_gradients(scene, [0.002, 0.004], sb.Solver(h=2e-3), samples=1, values=values)
    assert report.passed, str(report)


@pytest.mark.filterwarnings("ignore:sheet")
def test_what_cannot_be_attached_is_refused() -> None:
    scene, pole, cloth = flag()
    top = cloth.particles[cloth.mesh.sets["top"]]
    scene.pin([cloth.particles[0]])
    for particles in ([int(top[0])], [int(cloth.particles[0])], [int(pole.particles[0])], [1, 1]):
        with pytest.raises(sb.SceneError, match="cannot fix these particles"):
            sb.attach(pole, particles)
    with pytest.raises(sb.SceneError, match="particle indices"):
        sb.attach(pole, [])
    before, free = dict(pole.attached), int(cloth.particles[2])
    with pytest.raises(sb.SceneError, match="is taken"):
        sb.attach(pole, [free], name="pole_attached")
    assert pole.attached.keys() == before.keys()
    sb.attach(pole, [free], name="again")  # which the call that was refused has not attached
    for hold in (lambda: scene.pin(top), lambda: scene.drive(top, [0.0, 1.0], np.zeros((2, len(top), 3)))):
        with pytest.raises(sb.SceneError, match="attached to the body 'pole'"):
            hold()
    with pytest.raises(sb.SceneError, match="is not a body"):
        sb.attach(scene, [1])  # type: ignore[arg-type]


def test_two_hinged_bodies_explain_a_recorded_double_pendulum() -> None:
    """The last fitted piece of experiments/double_pendulum_bodies, at what its fit found of both bodies."""
    folder = Path(__file__).resolve().parents[2] / "experiments" / "double_pendulum_bodies"
    every = build(parse(folder / f"{folder.name}.toml"), folder).experiments
    (e,) = (e for e in every if e.name == "fitted_56s")
    found = {"upper_center_x": 0.12663, "lower_center_x": 0.12286, "lower_inertia_2": 1.2386e-3, "air_drag": 1.023e-3}
    found |= {"lower_inertia_3": 1.23855e-3, "top_friction": 4.89e-4, "elbow_friction": 1.81e-4}
    found |= {"upper_zero": 6.9e-5, "lower_zero": -8.5e-5}
    start = {"top_angle": 0.09391, "elbow_angle": -0.0114, "top_rate": -1.6372, "elbow_rate": -0.215}
    wanted = {name: {"initial": value, "fixed": name in found} for name, value in (found | start).items()}
    fit = sb.fit(e, parameters=wanted, refine=False, profiles=False, beginnings=False)
    assert fit.result.recordings[0].rms == pytest.approx(6.83e-5, rel=0.01)  # m
