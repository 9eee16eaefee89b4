"""Ropes and cloth that touch shapes, from Python: what acts, what is refused, and gradients."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import sheetbend as sb

SOLVER = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")
TIMES = [0.0, 0.05, 0.1]


def rope_above(height=0.006, pinned=(), **contact) -> sb.Scene:
    scene = sb.rope(0.2, 8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, height), pinned=pinned)
    options = {"friction": 0.3, "radius": 0.005} | contact
    scene.add_contact(scene.ropes["rope"], sb.Plane(name="table"), **options)
    return scene


def moved(scene: sb.Scene, speed=(0.5, 0.0, 0.0)) -> sb.Scene:
    count = len(scene.ropes["rope"].particles)
    scene._particles.velocities.values[:count] = speed
    return scene


def test_a_rope_lands_and_slides_to_rest():
    scene = moved(rope_above())
    x = sb.simulate(scene, [0.0, 0.3], SOLVER).positions
    rope = x[-1, scene.ropes["rope"].particles]
    assert np.abs(rope[:, 2] - 0.005).max() < 1e-6
    # The fall of 1 mm takes 14.3 ms without friction; then it slides v^2/(2 mu g).
    fall = np.sqrt(2 * 0.001 / 9.81)
    after = 0.5 - 0.3 * 9.81 * fall  # the impact's normal impulse slows it as well
    assert np.mean(rope[:, 0] - x[0, scene.ropes["rope"].particles, 0]) == pytest.approx(
        0.5 * fall + after**2 / (2 * 0.3 * 9.81), rel=0.05
    )


def test_quantities_have_gradients_as_differences_have():
    scene = moved(rope_above())
    rollout = sb.rollout(scene, TIMES, SOLVER)
    bar = np.zeros_like(rollout.positions)
    particles = scene.ropes["rope"].particles
    bar[-1, particles, 0] = 1.0
    bar[-1, particles, 2] = 0.5
    found = rollout.gradient(bar).quantities

    def loss(**values):
        x = sb.rollout(scene, TIMES, SOLVER, values=values).positions
        return (bar * x).sum()

    for name, value, step in (
        ("table_friction", 0.3, 1e-6),
        ("table_contact_radius", 0.005, 1e-9),
        ("table_z", 0.0, 1e-9),
        ("rope_density", 0.05, 1e-6),
    ):
        expected = (loss(**{name: value + step}) - loss(**{name: value - step})) / (2 * step)
        assert found[name] == pytest.approx(expected, rel=1e-4, abs=1e-5), name
    assert found["table_friction"] < -0.1


def test_bdf2_says_how_many_substeps_went_with_bdf1():
    solver = sb.Solver(h=1e-3, method="implicit")
    high = sb.simulate(rope_above(height=1.0), TIMES, solver).contacts["table"]
    assert high.bdf1_share == pytest.approx(0.01)
    landed = sb.simulate(rope_above(height=0.015), TIMES, solver).contacts["table"]
    assert 0.04 <= landed.bdf1_share < 0.5
    assert sb.simulate(rope_above(), TIMES, SOLVER).contacts["table"].bdf1_share == 1.0


def test_a_simulation_counts_what_contacts_do():
    high = sb.simulate(rope_above(height=1.0), TIMES, SOLVER).contacts["table"]
    nothing = {"most": 0, "began": 0, "ended": 0, "sliding_share": 0.0, "sticking_share": 0.0, "deepest": 0.0}
    assert high == sb.ContactCounts(**nothing, bdf1_share=1.0)
    scene = moved(rope_above())
    count = len(scene.ropes["rope"].particles)
    short, long = (sb.simulate(scene, [0.0, end], SOLVER).contacts["table"] for end in (0.1, 0.4))
    assert (short.most, short.began - short.ended) == (count, count)
    assert short.sliding_share > 0.9
    assert 0.3 < long.sliding_share < 0.6  # it stands still after 0.17 s
    assert long.sliding_share + long.sticking_share == pytest.approx(1.0)


def test_a_moving_bar_lifts_a_cloth():
    scene = sb.Scene("lifted")
    cloth = sb.add_cloth(scene, sb.mesh.grid(0.2, 0.1, 6, 3), density=0.2, warp=200, shear=20, bending=1e-4)
    x = scene.positions[cloth.particles]
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    side = np.array([0.0, 0.2, 0.0])
    bar = sb.Capsule(start=middle - side - [0, 0, 0.03], end=middle + side - [0, 0, 0.03], radius=0.025, name="bar")
    up = bar.moving([0.0, 0.1, 0.3], [[0, 0, 0], [0, 0, 0], [0, 0, 0.05]])
    scene.add_contact(cloth, up, friction=0.5, radius=1e-3)
    end = sb.simulate(scene, [0.0, 0.3], SOLVER).positions[-1, cloth.particles]
    assert end[:, 2].max() == pytest.approx(middle[2] - 0.03 + 0.05 + 0.026, abs=2e-3)
    assert end[:, 2].min() < middle[2]


def test_a_turned_plane_keeps_its_normal():
    plane = sb.Plane(normal=(0.0, 1.0, 1.0))
    turned = plane.moving([0.0, 1.0], np.zeros((2, 3)), [[0, 0, 0], [0, 0, np.pi / 2]])
    angles = np.linalg.norm(turned.poses.rotations, axis=1)
    assert angles[0] == pytest.approx(np.pi / 4)
    scene = sb.Scene("turning", gravity=(0, 0, 0))
    scene.add_particles([[0.0, 0.0, 1.0]], 0.1)
    scene.add_contact([0], turned, friction=0.0)
    gaps = scene.compiled.core.contact_gaps(scene.compiled.inputs(), 1.0, 0)
    assert gaps[0, 1:] == pytest.approx([-np.sqrt(0.5), 0.0, np.sqrt(0.5)])


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"friction": -0.1}, "table.contact.friction"),
        ({"radius": -1e-3}, "table.contact.radius"),
        ({"stiffness": 0.0}, "table.contact.stiffness"),
        ({"friction": np.nan}, "table.contact.friction"),
    ],
)
def test_bad_numbers_are_refused(options, field):
    with pytest.raises(sb.SceneError) as error:
        rope_above(**options)
    assert error.value.field == field


def test_a_start_inside_is_refused_with_its_depth():
    scene = rope_above(height=0.002)
    with pytest.raises(sb.SceneError, match=r"inside 'table', which is 0.003 m deep"):
        _ = scene.compiled


def test_shapes_refuse_what_they_cannot_be():
    for build in (
        lambda: sb.Plane(normal=(0, 0, 0)),
        lambda: sb.Sphere(center=(0, 0, 0), radius=0.0),
        lambda: sb.Capsule(start=(0, 0, 1), end=(0, 0, 1), radius=0.1),
        lambda: sb.Cylinder(start=(0, 0, 0), end=(0, 0, 0.1), radius=1.0, edge_radius=0.06),
        lambda: sb.Cylinder(start=(0, 0, 0), end=(0, 0, 0), radius=1.0, edge_radius=0.01),
        lambda: sb.Box(center=(0, 0, 0), size=(1, 1, 0.1), edge_radius=0.06),
        lambda: sb.Plane().moving([0.0, 0.0], np.zeros((2, 3))),
        lambda: sb.Plane().moving([0.0, 1.0], np.zeros((3, 3))),
    ):
        with pytest.raises(sb.SceneError):
            build()
    scene = rope_above()
    with pytest.raises(sb.SceneError, match="is not a shape"):
        scene.add_contact([0], "table", friction=0.1)
    with pytest.raises(sb.SceneError, match="taken"):
        scene.add_contact([0], sb.Plane(name="table"), friction=0.1)


@pytest.mark.parametrize("method", ["direct", "newton", "newton_cg"])
def test_other_methods_name_those_that_can(method):
    with pytest.raises(sb.InputError, match="use implicit, or gauss_seidel"):
        sb.simulate(rope_above(), TIMES, sb.Solver(h=1e-3, method=method, integrator="bdf1"))


def test_a_compiled_scene_is_the_same_after_pickling():
    core = rope_above(stiffness=500.0).compiled.core
    again = pickle.loads(pickle.dumps(core))
    assert again.layout == core.layout
    assert again.layout["contact_stiffness"][1] == 1
