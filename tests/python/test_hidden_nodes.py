"""What users index is particles alone, in order; stubs of clamps, frames of rods, axes of bodies are hidden nodes."""

from __future__ import annotations

import copy
import json
import pickle
import zlib
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.scene.scene_reader import PREFIX

SOLVER = sb.Solver(h=1 / 400)
TIMES = np.arange(5) / 100
ROPE = {"density": 0.05, "EI": 1e-3, "EA": 100.0}


def clamped(**more: object) -> sb.Scene:
    return sb.rope(0.6, 12, clamp_start=(1, 0, 0), **ROPE, **more)  # type: ignore[arg-type]


def rod() -> sb.Scene:
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, 0, 1))
    return sb.rod(0.5, 40, density=0.05, EI=1e-3, GJ=1e-3, start=start)


def body() -> sb.Scene:
    scene = sb.Scene("body")
    given = {"mass": 0.3, "inertia": (1e-3, 2e-3, 2.5e-3), "center": (0.01, 0.0, 0.02)}
    scene.add_body("box", at=(0.1, 0.2, 0.3), velocity=(1, 0, 0), spin=(1, 2, 3), **given)  # type: ignore[arg-type]
    return scene


def mixed() -> sb.Scene:
    """Objects with hidden nodes before, between and behind particles."""
    scene = sb.Scene("mixed")
    sb.add_rope(scene, "a", length=0.6, segments=12, clamp_start=(1, 0, 0), clamp_end=(1, 0, 0), **ROPE)  # type: ignore[arg-type]
    scene.add_body("box", mass=0.3, inertia=(1e-3, 2e-3, 2.5e-3), at=(0.0, 1.0, 0.0))
    sb.add_rope(scene, "b", length=0.5, segments=9, start=(0, 0, 1), clamp_start=(1, 0, 0), **ROPE)  # type: ignore[arg-type]
    grip = sb.Grip.fixed((0, 0, 2), (1, 0, 0), (0, 0, 1))
    sb.add_rod(scene, "c", length=0.4, segments=7, density=0.05, EI=1e-3, GJ=1e-3, start=grip)
    return scene


def test_the_last_position_of_a_clamped_rope_is_its_last_particle() -> None:
    scene = clamped()
    rope, motion = scene.ropes["rope"], sb.simulate(scene, TIMES, SOLVER)
    assert motion.positions.shape == motion.velocities.shape == (5, 13, 3)
    assert (motion.positions[..., -1, :] == motion.nodes[:, rope.particles[-1]]).all()
    assert motion.positions[-1, -1, 2] < -1e-4  # it falls, a clamp does not
    rolled = sb.rollout(scene, TIMES, SOLVER)
    bar = np.zeros_like(rolled.positions)
    bar[-1, -1, 2] = 1.0
    found = rolled.gradient(bar)
    for array, shape in (("position", (13, 3)), ("velocity", (13, 3)), ("mass", (13,))):
        assert found.inputs[array].shape == shape and found.inputs[array][-1].any()
    step, start = 1e-6, scene.positions
    ends = []
    for sign in (1.0, -1.0):
        x = start.copy()
        x[-1, 2] += sign * step
        ends.append(sb.simulate(scene, TIMES, SOLVER, start=x).positions[-1, -1, 2])
    assert found.inputs["position"][-1, 2] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6)


def test_a_gradient_with_respect_to_all_nodes_is_that_of_the_particles_and_more() -> None:
    rolled = sb.rollout(clamped(), TIMES, SOLVER)
    bar = np.random.default_rng(0).standard_normal(rolled.positions.shape)
    every = np.concatenate([bar, np.zeros((5, 1, 3))], axis=1)
    assert rolled.gradient(bar).quantities == rolled.gradient(every).quantities
    with pytest.raises(sb.InputError, match="positions_bar"):
        rolled.gradient(np.zeros((5, 15, 3)))


def test_what_a_clamp_turns_still_reaches_its_quantity() -> None:
    scene = clamped(clamp_angles=True, plane=(0, 1, 0))
    rolled = sb.rollout(scene, TIMES, SOLVER)
    bar = np.zeros_like(rolled.positions)
    bar[-1, -1, 2] = 1.0
    ends = [sb.simulate(scene, TIMES, SOLVER, {"rope_start_angle": a}).positions[-1, -1, 2] for a in (1e-5, -1e-5)]
    assert rolled.gradient(bar).quantities["rope_start_angle"] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-5)


def test_a_rod_returns_its_nodes() -> None:
    scene = rod()
    rod_, motion, rest = scene.ropes["rod"], sb.simulate(scene, TIMES, SOLVER), sb.equilibrium(scene)
    assert motion.positions.shape == (5, 41, 3) and rest.positions.shape == (41, 3)
    assert motion.nodes.shape == (5, 83, 3) and rest.nodes.shape == (83, 3)
    assert np.linalg.norm(motion.nodes[:, rod_.directors], axis=2) == pytest.approx(1.0, abs=1e-14)  # type: ignore[attr-defined]
    assert not motion.node_velocities[:, rod_.directors].any()  # type: ignore[attr-defined]
    bar = np.zeros((41, 3))
    bar[-1, 2] = 1.0
    assert rest.gradient(bar)["rod_EI"] > 0.0
    with pytest.raises(sb.InputError, match=r"start.*hidden nodes.*Fix: .*Equilibrium\.nodes"):
        sb.simulate(scene, TIMES, SOLVER, start=rest.positions)
    assert sb.simulate(scene, TIMES, SOLVER, start=rest.nodes).positions[0] == pytest.approx(rest.positions)


def test_particles_are_numbered_in_order_whatever_is_between() -> None:
    scene = mixed()
    assert scene.ropes["a"].particles.tolist() == list(range(13))
    assert scene.bodies["box"].particles[0] == 13
    assert scene.ropes["b"].particles.tolist() == list(range(14, 24))
    assert scene.ropes["c"].particles.tolist() == list(range(24, 32))
    assert scene.particle_count == 32 and scene.positions.shape == (32, 3)
    hidden = [scene.ropes["a"].start_ghost, scene.ropes["a"].end_ghost, *scene.bodies["box"].particles[1:]]
    assert hidden == [-1, -2, -3, -4, -5] and scene.ropes["b"].start_ghost == -6
    motion = sb.simulate(scene, TIMES, SOLVER)
    for name in ("a", "b"):  # alone and beside others
        own = scene.ropes[name]
        assert (motion.positions[:, own.particles] == motion.nodes[:, own.particles]).all()
        away = motion.nodes[:, own.start_ghost] - motion.positions[:, own.particles[0]]
        assert (away == away[0]).all() and 0.0 < -away[0, 0] < own.arc_length[1] and not away[0, 1:].any()
    alone = sb.simulate(clamped(clamp_end=(1, 0, 0)), TIMES, SOLVER)
    assert motion.positions[:, :13] == pytest.approx(alone.positions, abs=1e-13)


def test_the_center_of_a_body_is_a_particle() -> None:
    scene = body()
    box, motion = scene.bodies["box"], sb.simulate(scene, TIMES, SOLVER)
    assert motion.positions.shape == (5, 1, 3) and motion.nodes.shape == (5, 4, 3)
    origin, frame = box.pose(motion)
    assert motion.positions[:, 0] == pytest.approx(origin + frame @ [0.01, 0.0, 0.02], abs=1e-14)
    assert (box.pose(motion.nodes)[1] == frame).all()
    with pytest.raises(sb.SceneError, match=r"box\.motion.*axes.*Fix: give a trajectory"):
        box.pose(motion.positions)


def test_numbers_from_the_end_are_refused() -> None:
    scene = sb.Scene()
    scene.add_particles([[0, 0, 0], [1, 0, 0]], 1.0)
    for add in (
        lambda: scene.pin([-1]),
        lambda: scene.add_constraints("distance", [[0, -1]]),
        lambda: scene.add_force([-1], [0, 0, 1.0]),
        lambda: scene.drive([-1], [0.0], np.zeros((1, 1, 3))),
        lambda: scene.add_contact([-1], sb.Plane(), friction=0.1),
        lambda: scene.add_point_mass(-1, 0.1, "weight"),
    ):
        with pytest.raises(sb.SceneError, match=r"particles that do not exist.*use 0 to 1"):
            add()  # type: ignore[no-untyped-call]


def test_pickles_and_copies_keep_what_is_hidden() -> None:
    scene = mixed()
    expected = sb.simulate(scene, TIMES, SOLVER)
    for again in (pickle.loads(pickle.dumps(mixed())), copy.deepcopy(mixed())):
        found = sb.simulate(again, TIMES, SOLVER)
        assert (found.nodes == expected.nodes).all() and (found.positions == expected.positions).all()
    kept = pickle.loads(pickle.dumps(expected))
    assert kept.positions.shape == (5, 32, 3) and (kept.nodes == expected.nodes).all()


def test_files_keep_the_number_of_particles(tmp_path: Path) -> None:
    scene, path = mixed(), tmp_path / "mixed.scene"
    sb.save_scene(scene, path)
    loaded = sb.load_scene(path)
    assert (loaded.particle_count, loaded.hidden_count) == (scene.particle_count, scene.hidden_count)
    assert loaded.directors == scene.directors and loaded.pinned == scene.pinned
    one, two = (sb.simulate(s, TIMES, SOLVER) for s in (scene, loaded))
    assert (one.positions == two.positions).all() and (one.nodes == two.nodes).all()

    content = path.read_bytes()
    magic, version, _, length = PREFIX.unpack(content[: PREFIX.size])
    header = json.loads(content[PREFIX.size : PREFIX.size + length])
    for particles, words in ((None, ""), (scene.node_count + 1, "particles"), (-1, "particles"), (True, "particles")):
        header.pop("particles", None) if particles is None else header.update(particles=particles)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 8)
        rest = text + content[PREFIX.size + length :]
        path.write_bytes(PREFIX.pack(magic, version, zlib.crc32(rest), len(text)) + rest)
        if words:
            with pytest.raises(sb.SceneError, match=words):
                sb.load_scene(path)
        else:  # of an earlier version: all nodes are particles
            older = sb.load_scene(path)
            assert older.particle_count == scene.node_count
            assert (sb.simulate(older, TIMES, SOLVER).positions == one.nodes).all()


def test_torch_sees_particles() -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    scene = clamped()
    rolled = sb.rollout(scene, TIMES, SOLVER)
    bar = np.random.default_rng(0).standard_normal(rolled.positions.shape)
    expected = rolled.gradient(bar)
    x = torch.from_numpy(scene.positions).requires_grad_()
    EI = torch.tensor(1e-3, dtype=torch.float64, requires_grad=True)
    seen = st.simulate(scene, TIMES, SOLVER, {"rope_EI": EI}, {"position": x})
    assert seen.shape == (5, 13, 3) and (seen.detach().numpy() == rolled.positions).all()
    (seen * torch.from_numpy(bar)).sum().backward()
    assert (x.grad.numpy() == expected.inputs["position"]).all() and x.grad[-1].any()
    assert float(EI.grad) == pytest.approx(expected.quantities["rope_EI"], rel=1e-12)
    whole = st.simulate(scene, TIMES, SOLVER, nodes=True)
    assert (whole.numpy() == rolled.nodes).all()
    rows = x.detach().expand(9, 13, 3) * torch.linspace(1.0, 1.0, 9, dtype=torch.float64)[:, None, None]
    lanes = st.simulate(scene, TIMES, SOLVER, inputs={"position": rows})
    assert lanes.shape == (9, 5, 13, 3) and (lanes == seen.detach()).all()
    rest = st.equilibrium(rod())
    assert rest.positions.shape == (41, 3) and rest.nodes.shape == (83, 3)


def test_a_stepper_sees_particles() -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    scene = clamped()
    motion = sb.simulate(scene, np.arange(4) * SOLVER.h, SOLVER)
    stepper = st.Stepper(scene, SOLVER)
    v = torch.zeros(13, 3, dtype=torch.float64, requires_grad=True)
    state = stepper.start(stepper.inputs(inputs={"velocity": v}))
    for frame in range(1, 4):
        state = stepper(state)
        assert (state.positions.detach().numpy() == motion.positions[frame]).all()
        assert (state.nodes.detach().numpy() == motion.nodes[frame]).all()
    assert state.velocities.shape == state.positions_before.shape == (13, 3)
    state.positions[..., -1, 2].backward()
    assert v.grad is not None and v.grad[-1, 2] > 0.0
    for kept in (state.detach(), copy.deepcopy(state.detach()), st.State.stack([state.detach()])[0]):
        assert kept.positions.shape == (13, 3)
    mass = torch.full((13,), 0.01, dtype=torch.float64)
    assert stepper(state.detach(), mass=mass).positions.shape == (13, 3)


def test_jax_sees_particles() -> None:
    jax = pytest.importorskip("jax")
    import sheetbend.jax as sj

    scene = clamped()
    expected = sb.rollout(scene, TIMES, SOLVER)

    def last(x: object, nodes: bool = False) -> object:
        return sj.simulate(scene, TIMES, SOLVER, inputs={"position": x}, nodes=nodes)[-1, -1, 2]  # type: ignore[dict-item]

    bar = np.zeros_like(expected.positions)
    bar[-1, -1, 2] = 1.0
    by_x = jax.grad(last)(jax.numpy.asarray(scene.positions))
    assert np.asarray(by_x) == pytest.approx(expected.gradient(bar).inputs["position"], rel=1e-5, abs=1e-6)
    assert not np.asarray(jax.grad(lambda x: last(x, True))(jax.numpy.asarray(scene.positions))).any()
