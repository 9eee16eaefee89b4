"""Starts inside a collider, and colliders that move too fast to be seen."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")


def on_table(settle: bool, deep: float = 1e-3) -> sb.Scene:
    """A rope whose third and fourth node are below the table, by noise."""
    points = np.column_stack([np.linspace(0, 0.2, 9), np.zeros(9), np.full(9, 0.005)])
    points[2:4, 2] -= [deep, 0.5 * deep]
    scene = sb.rope(0.2, 8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.005), pinned=())
    rope = scene.ropes["rope"]
    for particle, place in zip(rope.particles, points, strict=True):
        scene.shift_base(int(particle), place - scene.positions[particle])
    scene.add_contact(rope, sb.Plane(name="table"), friction=0.3, radius=0.005, settle=settle)
    return scene


def test_a_start_inside_is_told_by_how_much_and_how_to_settle_it() -> None:
    with pytest.raises(sb.SceneError, match=r"particle 2 inside 'table', which is 0.001 m deep.*settle=True"):
        _ = on_table(False).compiled


def test_a_start_inside_is_moved_to_the_surface() -> None:
    scene = on_table(True)
    motion = sb.simulate(scene, np.linspace(0, 0.1, 6), SOLVER)
    rope = motion.positions[:, scene.ropes["rope"].particles]
    assert rope[0, :, 2] == pytest.approx(0.005, abs=1e-12)
    assert np.abs(rope - rope[0]).max() < 1e-5  # nothing jumps
    (start,) = scene.compiled.settled.values()
    assert start.particles == 2 and start.farthest == pytest.approx(1e-3)


def test_a_corner_of_two_planes_is_left_on_both() -> None:
    scene = sb.Scene("corner")
    (particle,) = scene.add_particles([[-0.01, 0.0, -0.02]], 0.1)
    for name, normal in (("floor", (0, 0, 1)), ("wall", (1, 0, 0.5))):
        scene.add_contact([particle], sb.Plane(normal=normal, name=name), friction=0.1, settle=True)
    start = sb.simulate(scene, [0.0], SOLVER).positions[0, particle]
    assert start[2] >= -1e-9 and start @ np.array([1, 0, 0.5]) >= -1e-9


def test_a_measured_start_below_the_table_is_fitted_and_the_report_tells() -> None:
    times = np.linspace(0.0, 0.2, 11)
    true = on_table(True, deep=0.0)
    x = sb.simulate(true, times, SOLVER).positions[:, true.ropes["rope"].particles]
    seen = x + 1e-4 * np.random.default_rng(0).standard_normal(x.shape)
    model = on_table(True)
    places = [sb.on_particle(int(p)) for p in model.ropes["rope"].particles]
    recording = sb.Recording(positions=seen, times=times, name="rest")
    result = sb.fit(model, recording, ["table_z"], markers=places, solver=SOLVER, sigma=1e-4, beginnings=False).result
    (touch,) = result.contacts
    assert (touch.settled, touch.settled_by) == (2, pytest.approx(1e-3))
    assert "settle moved 2 particles out of table, by up to 1 mm" in " ".join(result.report().split())


def swept(h: float, radius: float = 0.01, interpolation: str = "linear") -> sb.Trajectory:
    """A post that moves at 4 m/s toward a particle 0.2 m away, and is past its place at the end."""
    scene = sb.Scene("swept", gravity=(0.0, 0.0, 0.0))
    (particle,) = scene.add_particles([[0.0, 0.0, 0.2]], 0.1)
    post = sb.Capsule(start=(-0.2, -1, 0.2), end=(-0.2, 1, 0.2), radius=radius, name="post")
    moving = post.moving([0.0, 0.1], [[0, 0, 0], [0.4, 0, 0]], interpolation=interpolation)
    scene.add_contact([particle], moving, friction=0.1, radius=0.002)
    return sb.simulate(scene, [0.0, 0.06], sb.Solver(h=h, method="implicit", integrator="bdf1"))


@pytest.mark.parametrize(("h", "interpolation"), [(4e-3, "linear"), (2.5e-3, "cubic")])
def test_a_collider_that_would_jump_over_particles_is_refused(h: float, interpolation: str) -> None:
    with pytest.raises(sb.InputError, match=r"'post' move 1[56] mm.*12 mm thick.*use at most"):
        swept(h, interpolation=interpolation)


@pytest.mark.parametrize(("h", "radius"), [(2.5e-3, 0.01), (4e-3, 0.02)])
def test_a_collider_that_is_thicker_than_its_way_in_a_substep_pushes(h: float, radius: float) -> None:
    found = swept(h, radius).positions[-1, 0]
    assert np.abs(found - [0.04 + radius + 0.002, 0.0, 0.2]).max() < 1e-4


def test_a_gradient_is_empty_while_nothing_touches_and_says_so() -> None:
    """A rope that falls on a table: where its end lies does not depend on friction before it has landed and slides."""
    scene = sb.rope(0.2, 8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.06), pinned=(0,))
    scene.add_contact(scene.ropes["rope"], sb.Plane(name="table"), friction=0.3, radius=0.005)
    scales = {"table_friction": 0.1, "table_z": 0.01}

    def felt(until: float) -> sb.Gradient:
        rolled = sb.rollout(scene, [until], SOLVER)
        bar = np.zeros_like(rolled.positions)
        bar[0, scene.ropes["rope"].particles[-1]] = 1.0
        return rolled.gradient(bar)

    with pytest.raises(sb.EmptyGradientError, match="nothing touches yet"):
        felt(0.04).require(scales)
    felt(0.3).require(scales)
