"""Balls that hit each other: a control task, a cradle, their gradients, a fit, and what is refused."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb

Array = np.ndarray
SOLVER = sb.Solver(h=1 / 480)
WAY = 1 - 0.4 / np.sqrt(2)  # m, of the first ball to the impact, along each axis
EFFORT = 0.1
KNOTS = np.linspace(0.0, 1.0, 161)  # of the control, which is linear between them
MASS = np.zeros((161, 161))  # u . MASS u is the integral of u^2
for knot in range(160):
    MASS[knot : knot + 2, knot : knot + 2] += np.array([[2, 1], [1, 2]]) / (6 * 160)


def controlled(u: Array, from_1: float = 0.0, from_2: float = 1.0) -> tuple[sb.Rollout, float]:
    """Task 3 of Zhong et al. (2023): a ball that u (161, 2) N pushes hits another one, which is to end at (2, 2).

    Returns:
        The rollout of 1 s, and the loss: the squared distance from there and 0.1 times the integral of |u|^2.
    """
    scene = sb.Scene("two balls", gravity=(0, 0, 0))
    scene.add_particles([[from_1, from_1, 0.0], [from_2, from_2, 0.0]], 1.0)
    scene.add_collisions([0, 1], radius=0.2, restitution=1.0)
    scene.add_force([0], np.concatenate([u, np.zeros((161, 1))], axis=1)[:, None], KNOTS)
    rollout = sb.rollout(scene, [0.0, 1.0], SOLVER)
    away = rollout.positions[-1, 1, :2] - 2.0
    return rollout, float(away @ away + EFFORT * np.sum(u * (MASS @ u)))


def slope(rollout: sb.Rollout, u: Array) -> dict[str, Array]:
    """By input array, the gradient of that loss; that of the force with its effort."""
    bar = np.zeros_like(rollout.positions)
    bar[-1, 1, :2] = 2 * (rollout.positions[-1, 1, :2] - 2.0)
    found = dict(rollout.gradient(bar).inputs)
    found["force"] = np.reshape(found["force"], (161, 3))[:, :2] + 2 * EFFORT * MASS @ u
    return found


def test_plain_gradient_descent_finds_the_best_control_of_two_balls():
    """1.396542 at best, by calculus. Position-based dynamics ends at 1.430, and without the time of impact a descent
    stays at 2.001."""
    u = np.full((161, 2), 3.0)
    losses = []
    for _ in range(150):
        rollout, loss = controlled(u)
        losses.append(loss)
        u = u - 0.5 * 160 * slope(rollout, u)["force"]
    assert losses[0] > 2.0
    assert 1.3963 < losses[-1] <= 1.3970
    s = 0.6832202  # s, when they meet, at the best
    a, b = 8 * EFFORT / s + 2 * (1 - s) ** 2, 4 * (1 - s) + 24 * EFFORT * WAY / s**2
    v = b / (2 * a)
    best = np.where(s > KNOTS, (6 * WAY - 2 * v * s) / s**2 + (6 * v * s - 12 * WAY) / s**3 * KNOTS, 0.0)
    clear = (np.abs(s - KNOTS) > 0.02) & (KNOTS > 0.02)
    assert u[clear] == pytest.approx(np.tile(best[clear][:, None], 2), abs=0.1)


def test_the_gradient_with_respect_to_where_both_start():
    """With u = (3, 3): exactly -0.3987 and -0.3213, along each axis."""
    u = np.full((161, 2), 3.0)
    found = slope(controlled(u)[0], u)["position"]
    assert found[:, :2] == pytest.approx(np.array([[-0.3987] * 2, [-0.3213] * 2]), abs=1e-4)
    d = 1e-5
    by_1 = (controlled(u, from_1=d)[1] - controlled(u, from_1=-d)[1]) / (2 * d)
    by_2 = (controlled(u, from_2=1 + d)[1] - controlled(u, from_2=1 - d)[1]) / (2 * d)
    assert found[:, :2].sum(axis=1) == pytest.approx([by_1, by_2], rel=1e-6)


def cradle(gap: float = 0.0, restitution: float = 1.0, **more: Any) -> sb.Scene:
    scene = sb.Scene("cradle", gravity=(0, 0, 0))
    places = [[-0.153, 0, 0], *([(0.1 + gap) * k, 0, 0] for k in range(4))]
    scene.add_particles(places, 0.2, [[1.0, 0, 0], *4 * [[0, 0, 0]]])
    scene.add_collisions(np.arange(5), radius=0.05, restitution=restitution, **more)
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["gauss_seidel", "implicit", "direct"])
def test_the_last_ball_of_a_cradle_leaves(method: str, integrator: str):
    """An impact goes through balls that touch within one substep."""
    motion = sb.simulate(cradle(), [0.0, 0.1, 0.2], sb.Solver(h=0.1, method=method, integrator=integrator))
    assert motion.velocities[1:, :4] == pytest.approx(0.0, abs=1e-12)
    assert motion.velocities[1:, 4, 0] == pytest.approx(1.0, abs=1e-12)
    assert motion.positions[-1, 4, 0] == pytest.approx(0.3 + 0.2 - 0.053, abs=1e-12)
    counts = motion.contacts["balls"]
    assert (counts.began, counts.ended, counts.most, counts.deepest) == (4, 4, 0, None)


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients_are_those_of_differences(integrator: str):
    scene = sb.Scene("table")
    scene.add_particles(
        [[0, 0, 0.3], [0.2, 0.02, 0.28], [0.4, -0.01, 0.31]], 0.1, [[1, 0, 0], [0, 0, 0], [-1, 0, -0.5]]
    )
    scene.add_point_mass(1, 0.05, "weight")
    scene.add_contact([0, 1, 2], sb.Plane(name="table"), friction=0.2, radius=0.03, restitution=0.7)
    scene.add_collisions([0, 2, 1], radius=[0.03, 0.02, 0.04], restitution=0.8)
    solver, times = sb.Solver(h=1 / 240, method="implicit", integrator=integrator), [0.0, 0.5]
    rollout = sb.rollout(scene, times, solver)
    bar = np.zeros_like(rollout.positions)
    bar[-1] = np.random.default_rng(1).normal(size=bar[-1].shape)
    found = rollout.gradient(bar).quantities

    def loss(**values: float) -> float:
        return float((bar * sb.rollout(scene, times, solver, values=values).positions).sum())

    counts = sb.simulate(scene, times, solver).contacts
    assert counts["balls"].began >= 2 and counts["table"].began >= 2
    radii = [f"balls_contact_radius_{k}" for k in range(3)]
    for name in ("balls_restitution", *radii, "weight_mass", "table_restitution"):
        value = scene.quantities[name].value
        expected = (loss(**{name: value + 1e-7}) - loss(**{name: value - 1e-7})) / 2e-7
        assert found[name] == pytest.approx(expected, rel=1e-5, abs=1e-6), name
        assert abs(found[name]) > 1e-3, name


def hung(balls: int, angle: float = 0.3) -> sb.Scene:
    """Balls on strings of 0.2 m that touch, the first one drawn aside."""
    scene = sb.Scene("cradle")
    tops = np.array([[0.02 * k, 0.0, 0.2] for k in range(balls)])
    x = tops - [0, 0, 0.2]
    x[0] = tops[0] - 0.2 * np.array([np.sin(angle), 0.0, np.cos(angle)])
    held, hang = scene.add_particles(tops, 1.0), scene.add_particles(x, 0.05)
    scene.pin(held)
    scene.add_constraints("distance", np.column_stack([held, hang]), name="strings", compliance=0.0, rest=0.2)
    if balls > 1:
        scene.add_collisions(hang, radius=0.01, restitution=1.0)
    return scene


@pytest.mark.parametrize("method", ["gauss_seidel", "implicit", "direct"])
@pytest.mark.parametrize(("integrator", "order"), [("bdf1", 1), ("bdf2", 2)])
def test_the_last_ball_of_a_cradle_swings_as_one_alone_would(method: str, integrator: str, order: int):
    """Position and derivative with respect to the angle at 0.4 s, to the order of the integrator."""
    ahead = -0.2 * np.array([np.cos(0.3), 0.0, -np.sin(0.3)])  # of the first ball, over the angle

    def swing(balls: int, h: float, method: str, integrator: str) -> Array:
        rollout = sb.rollout(hung(balls), [0.0, 0.4], sb.Solver(h=h, method=method, integrator=integrator))
        bar = np.zeros_like(rollout.positions)
        bar[-1, -1, 0] = 1.0
        start = np.reshape(rollout.gradient(bar).inputs["position"], (-1, 3))[balls]
        return np.array([rollout.positions[-1, -1, 0] - 0.02 * (balls - 1), start @ ahead])

    exact = swing(1, 1e-4, "direct", "bdf2")
    errors = [np.abs(swing(3, h, method, integrator) - exact) for h in (4e-3, 2e-3)]
    assert errors[1] == pytest.approx(errors[0] / 2**order, rel=0.15)
    assert errors[1].max() < (5e-3 if order == 1 else 2e-4)


def rods(joints: int, apart: float, compliance: float, restitution: float, pinned: bool = False) -> sb.Scene:
    """A ball flies at 1 m/s against balls in a row that rods join, at rest; the last of them may be pinned."""
    scene = sb.Scene("rods", gravity=(0, 0, 0))
    ahead = np.array([np.cos(apart), 0.0, np.sin(apart)])
    row = 0.1 * np.arange(joints + 1)[:, None] * ahead
    balls = scene.add_particles([[-0.03, 0, 0], *row], 0.05, [[1.0, 0, 0], *[[0, 0, 0]] * (joints + 1)])
    pairs = np.column_stack([balls[1:-1], balls[2:]])
    scene.add_constraints("distance", pairs, name="rods", compliance=compliance)
    if pinned:
        scene.pin(balls[-1:])
    scene.add_collisions(balls[:-1] if pinned else balls, radius=0.01, restitution=restitution)
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["gauss_seidel", "implicit", "direct"])
@pytest.mark.parametrize("apart", [0.0, 0.6, 1.2])
def test_an_impact_moves_all_that_rigid_rods_join(apart: float, method: str, integrator: str):
    """The end of a dumbbell has the inverse mass of its center, and more the farther it turns."""
    more = {"iterations": 30} if method == "gauss_seidel" else {}
    at_end = 0.5 / 0.05 + 0.5 / 0.05 * np.sin(apart) ** 2  # 1/kg: of the center, and with a lever of half the rod
    for restitution in (0.5, 1.0):
        impulse = (1 + restitution) / (1 / 0.05 + at_end)
        errors = []
        for h in (1e-3, 1e-4):
            solver = sb.Solver(h=h, method=method, integrator=integrator, **more)
            motion = sb.simulate(rods(1, apart, 0.0, restitution), [0.0, 0.02 - h, 0.02], solver)
            ball, near, far = np.diff(motion.positions[1:], axis=0)[0] / h
            assert motion.contacts["balls"].began == 1
            found = [ball[0], (near[0] + far[0]) / 2, np.linalg.norm(far - near) / 0.1]
            turning = impulse * 0.05 * np.sin(apart) / (0.05 * 0.1**2 / 2)
            exact = [1 - impulse / 0.05, impulse / 0.1, turning]
            errors.append(np.abs(np.array(found) - exact))
        assert np.all(errors[1] < (1e-3, 1e-3, 2e-2)), (errors, exact)
        assert np.all(errors[1] < 0.2 * errors[0] + 1e-4), (errors, exact)


@pytest.mark.parametrize("method", ["implicit", "direct"])
def test_an_impact_moves_a_row_of_stiff_rods_and_what_nothing_moves_throws_back(method: str):
    solver = sb.Solver(h=1e-3, method=method)
    for joints, compliance in ((4, 0.0), (4, 1e-9)):
        motion = sb.simulate(rods(joints, 0.0, compliance, 1.0), [0.0, 0.03], solver)
        v = motion.velocities[-1, :, 0]
        assert v[0] == pytest.approx((1 - 5) / (1 + 5), abs=1e-3)
        assert v[1:].mean() == pytest.approx(2 / (1 + 5), abs=1e-3)
    motion = sb.simulate(rods(1, 0.0, 0.0, 0.8, pinned=True), [0.0, 0.03], solver)
    assert motion.velocities[-1, :2, 0] == pytest.approx([-0.8, 0.0], abs=1e-6)


def tongs(restitution: float) -> sb.Scene:
    """Two balls on rigid arms that one particle joins, which close at 1 m/s each."""
    scene, half = sb.Scene("tongs", gravity=(0, 0, 0)), 1.2
    ends = np.array([[np.cos(half), np.sin(half), 0.0], [np.cos(half), -np.sin(half), 0.0]])
    ways = np.array([[np.sin(half), -np.cos(half), 0.0], [np.sin(half), np.cos(half), 0.0]])
    ids = scene.add_particles([[0, 0, 0], *(0.1 * ends)], [0.03, 0.05, 0.08], [[0, 0, 0], *ways])
    scene.add_constraints("distance", [[ids[0], ids[1]], [ids[0], ids[2]]], name="arms", compliance=0.0)
    scene.add_collisions(ids[1:], radius=0.07, restitution=restitution)
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("method", ["gauss_seidel", "implicit", "direct"])
def test_balls_that_the_same_rods_join_part_as_restitution_says(method: str, integrator: str):
    """Their masses alone left 0.67 of the speed with a restitution of 1, and took a sixth of the energy."""
    more = {"iterations": 30} if method == "gauss_seidel" else {}
    masses, h = np.array([0.03, 0.05, 0.08]), 2e-4
    solver = sb.Solver(h=h, method=method, integrator=integrator, **more)
    for restitution in (0.5, 1.0):
        scene = tongs(restitution)
        motion = sb.simulate(scene, h * np.arange(320), solver)
        assert motion.contacts["balls"].began == 1
        rate = np.diff(np.linalg.norm(motion.positions[:, 1] - motion.positions[:, 2], axis=1)) / h
        parting = int(np.argmax(rate > 0.0))
        assert rate[parting + 3] == pytest.approx(-restitution * rate[parting - 3], abs=5e-3)
        v = np.diff(motion.positions[[0, 1, -2, -1]], axis=0)[[0, 2]] / h
        energy = 0.5 * (masses[:, None] * v**2).sum((1, 2))
        assert restitution < 1.0 or energy[1] == pytest.approx(energy[0], rel=5e-3)


@pytest.mark.parametrize("method", ["gauss_seidel", "implicit", "direct"])
def test_gradients_go_through_an_impact_of_balls_that_the_same_rods_join(method: str):
    compiled, frames = tongs(0.7).compiled, [80]
    core, inputs = sb.Solver(h=1e-3, method=method).core(compiled), compiled.inputs()
    states, tape = core.record(inputs, frames, 0.0)
    rng = np.random.default_rng(0)
    bar = rng.normal(size=np.shape(states))
    found = core.vjp(inputs, tape, frames, bar, 0.0)
    units = {"position": 1e-2, "velocity": 0.1, "mass": 0.01, "rest": 1e-2, "restitution": 0.1, "contact_radius": 1e-3}
    for name, unit in units.items():
        first, size = compiled.layout[name]
        along = np.zeros_like(inputs)
        along[first : first + size] = unit * rng.normal(size=size)
        ends = [np.sum(bar * core.states(inputs + d * along, frames, 0.0)) for d in (1e-5, -1e-5)]
        assert found @ along == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6, abs=1e-9), name


def swung(hinges: int, ball: Array | None = None) -> Array:
    """Where the center of a leaf on hinges swings to; or the velocities (2, 3) of a ball that it hits, and its own."""
    scene = sb.Scene("door", gravity=(0, 0, 0))
    leaf = scene.add_body("leaf", mass=1.0, inertia=[2e-3, 3e-3, 3.5e-3])
    axis = np.array([-0.6, 0.75, 0.28])
    for n in range(hinges):
        sb.hinge(None, leaf, at=[-0.1, 0.01, -0.03] + 0.05 * n * axis, axis=axis, name=f"hinge{n}", rate=8.0)
    solver, center = sb.Solver(h=4e-3, method="gauss_seidel", iterations=10, integrator="bdf1"), leaf.particles[0]
    if ball is None:
        return sb.simulate(scene, [0.0, 0.08], solver).positions[-1, center]
    both = [*scene.add_particles([ball], 0.3), center]
    scene.add_collisions(both, radius=0.01, restitution=1.0)
    motion = sb.simulate(scene, [0.0, 0.116, 0.12], solver)
    assert motion.contacts["balls"].began == 1
    return np.diff(motion.positions[1:, both], axis=0)[0] / 4e-3


def test_a_second_hinge_that_says_nothing_new_does_not_hold_a_door_in_an_impact():
    """Sweeps leave the bodies turned by more than rounding, where the rows that follow from others seem to hold it."""
    ball = swung(1)
    assert swung(2, ball) == pytest.approx(swung(1, ball), abs=5e-3)


def test_a_restitution_is_fitted_inside_its_interval():
    times = np.arange(0, 1.0001, 1 / 60)
    clean = sb.simulate(cradle(0.05, 0.75), times, SOLVER).positions
    noise = np.random.default_rng(3).normal(0.0, 1e-3, clean.shape)
    recording = sb.Recording(positions=clean + noise, times=times, name="cradle")
    places = [sb.on_particle(k) for k in range(5)]
    fit = sb.fit(cradle(0.05, 0.6), recording, ["balls_restitution"], markers=places, solver=SOLVER, sigma=1e-3)
    (found,) = fit.result.estimates
    assert found.verdict == "identified"
    assert found.lower < 0.75 < found.upper
    assert found.upper - found.lower < 0.02


def test_a_batch_collides_as_each_scene_alone():
    compiled = cradle(0.01).compiled
    core = pickle.loads(pickle.dumps(SOLVER.core(compiled)))
    inputs = np.stack([compiled.inputs(compiled.values({"balls_restitution": e})) for e in (0.3, 0.8, 1.0)])
    together = core.simulate_batch(inputs, [96, 192], 0.0)
    assert np.array_equal(together, np.stack([core.states(own, [96, 192], 0.0) for own in inputs]))
    bar = np.ones_like(together)
    gradients = core.vjp_batch(inputs, [96, 192], bar, 0.0)
    for own, states_bar, found in zip(inputs, bar, gradients, strict=True):
        _, tape = core.record(own, [96, 192], 0.0)
        assert np.array_equal(core.vjp(own, tape, [96, 192], states_bar, 0.0), found)


def test_a_tape_that_forgets_gives_the_same_bits():
    scene, times = cradle(0.01, 0.7), [0.0, 0.5]
    found = [
        sb.rollout(scene, times, sb.Solver(h=1 / 480, memory=memory)).gradient(np.ones((2, 5, 3))).quantities
        for memory in (2**20, None)
    ]
    assert found[0] == found[1]


def test_balls_are_kept_in_files_with_the_same_bits(tmp_path: Path):
    bouncing = cradle(0.01, 0.7, name="marbles")
    bouncing.add_contact(
        [4], sb.Plane(point=(0.6, 0, 0), normal=(-1, 0, 0)), friction=0.1, restitution=0.5, name="wall"
    )
    solver = sb.Solver(h=1 / 480, method="gauss_seidel")
    for scene in (cradle(0.01, 0.7), bouncing):
        sb.save_scene(scene, tmp_path / "a.scene")
        loaded = sb.load_scene(tmp_path / "a.scene")
        assert loaded.compiled.layout == scene.compiled.layout
        rollouts = [sb.rollout(s, [0.0, 1.0], solver) for s in (scene, loaded)]
        assert np.array_equal(rollouts[0].positions, rollouts[1].positions)
        gradients = [r.gradient(r.positions).quantities for r in rollouts]
        assert gradients[0] == gradients[1]
        name = "balls" if scene is not bouncing else "marbles"
        assert gradients[0][f"{name}_restitution"] != 0.0
        assert sb.simulate(loaded, [0.0, 1.0], solver).contacts[name].began >= 4
        sb.save_scene(loaded, tmp_path / "b.scene")
        assert (tmp_path / "b.scene").read_bytes() == (tmp_path / "a.scene").read_bytes()


@pytest.mark.parametrize("axis", range(3))
def test_balls_that_start_inside_each_other_are_refused(axis: int):
    scene = sb.Scene("balls")
    scene.add_particles(np.outer([0.0, 0.4, 0.09], np.eye(3)[axis]), 0.1)
    scene.add_collisions([0, 1, 2], radius=0.05, restitution=1.0)
    with pytest.raises(sb.SceneError, match=r"particle 0 and particle 2 are 0\.01 m too near") as error:
        _ = scene.compiled
    assert error.value.field == "balls"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: s.pin([1]), "particle 1 is held"),
        (lambda s: s.drive([1], [0.0, 1.0], np.zeros((2, 1, 3))), "particle 1 is held"),
        (
            lambda s: s.add_constraints("tether", [[0, 1]], name="reach", compliance=0.0, rest=1.0),
            "particle 0 is on a tether of reach",
        ),
    ],
)
def test_what_is_held_or_on_a_tether_does_not_collide(change: Any, words: str):
    scene = cradle()
    change(scene)
    with pytest.raises(sb.SceneError, match=words):
        _ = scene.compiled


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"what": [0]}, "collisions.particles"),
        ({"what": [0, 0]}, "collisions.particles"),
        ({"what": [0, 9]}, "collisions.particles"),
        ({"radius": 0.0}, "collisions.radius"),
        ({"radius": -0.1}, "collisions.radius"),
        ({"radius": [0.1, np.nan]}, "collisions.radius"),
        ({"radius": [0.1, 0.1, 0.1]}, "collisions.radius"),
        ({"restitution": 1.1}, "collisions.restitution"),
        ({"restitution": -0.1}, "collisions.restitution"),
        ({"restitution": np.nan}, "collisions.restitution"),
        ({"name": ""}, "collisions.name"),
    ],
)
def test_collisions_that_cannot_be_are_refused(arguments: dict[str, Any], field: str):
    scene = sb.Scene("balls")
    scene.add_particles([[0, 0, 0], [1, 0, 0]], 0.1)
    with pytest.raises(sb.SceneError) as error:
        scene.add_collisions(**{"what": [0, 1], "radius": 0.1, "restitution": 0.5, **arguments})
    assert error.value.field == field


def test_all_balls_of_a_scene_are_given_at_once():
    scene = cradle()
    with pytest.raises(sb.SceneError, match="given before"):
        scene.add_collisions([0, 1], radius=0.1, restitution=0.5, name="more")
    with pytest.raises(sb.SceneError, match="taken"):
        scene.add_contact([0], sb.Plane(), friction=0.1, name="balls")


def test_values_outside_their_range_are_refused():
    for values in ({"balls_restitution": 1.2}, {"balls_contact_radius": -0.1}):
        with pytest.raises(sb.SceneError, match=next(iter(values))):
            sb.simulate(cradle(), [0.0, 0.1], SOLVER, values=values)
