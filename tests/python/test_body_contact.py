"""Bodies in implicit substeps, and their points that touch shapes."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

SIDES = (0.1, 0.1, 0.12)
TIMES = [0.0, 0.1, 0.3]
SOLVER = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")


def tossed(touches: bool = True, **contact) -> tuple[sb.Scene, sb.Body]:
    scene = sb.Scene("toss")
    start = {"at": (0, 0, 0.2), "velocity": (0.8, 0.1, -0.5), "spin": (1, -3, 2)}
    body = scene.add_body("cube", of=sb.Inertia.box(0.37, SIDES), **start)
    if touches:
        options = {"friction": 0.2, "points": sb.box_corners(SIDES)} | contact
        scene.add_contact(body, sb.Plane(name="table"), **options)
    return scene, body


@pytest.mark.parametrize(("h", "most"), [(1e-2, 1e-7), (2e-3, 3e-10)])
def test_a_free_body_moves_as_in_direct_blocks(h, most):
    ends = [
        sb.simulate(tossed(touches=False)[0], [0.0, 0.5], sb.Solver(h=h, method=method)).nodes[-1]
        for method in ("direct", "implicit")
    ]
    assert np.abs(ends[0] - ends[1]).max() < most


def test_a_tossed_box_comes_to_rest_on_a_face():
    scene, body = tossed()
    motion = sb.simulate(scene, [0.0, 1.0, 1.2], SOLVER)
    place, axes = body.pose(motion)
    assert np.abs(place[2] - place[1]).max() < 1e-9
    assert min(abs(place[-1, 2] - 0.5 * side) for side in SIDES) < 1e-6
    assert motion.contacts["table"].most == 4
    assert np.abs(axes[-1] @ axes[-1].T - np.eye(3)).max() < 1e-12


def test_quantities_have_gradients_as_differences_have():
    scene, _ = tossed()
    rollout = sb.rollout(scene, TIMES, SOLVER)
    bar = np.zeros_like(rollout.positions)
    bar[-1, 0, 0] = 1.0
    found = rollout.gradient(bar).quantities

    def loss(**values):
        return sb.rollout(scene, TIMES, SOLVER, values=values).positions[-1, 0, 0]

    names = ("table_friction", "table_z", "cube_mass", "cube_inertia_1", "cube_center_x", "cube_axes_turn_x")
    for name, step in zip(names, (1e-6, 1e-8, 1e-6, 1e-9, 1e-7, 1e-6), strict=True):
        value = scene.quantities[name].value
        expected = (loss(**{name: value + step}) - loss(**{name: value - step})) / (2 * step)
        assert found[name] == pytest.approx(expected, rel=1e-4, abs=1e-6), name


def test_a_plug_on_a_cable_rests_on_a_table():
    scene = sb.Scene("plug")
    plug = scene.add_body("plug", of=sb.Inertia.box(0.02, (0.03, 0.01, 0.01)), at=(0.115, 0, 0.0051))
    rope = sb.add_rope(scene, length=0.1, segments=10, density=0.02, EA=200.0, EI=1e-5, start=(0, 0, 0.0051))
    stencil = [[plug.particles[0], rope.particles[-1], *plug.particles[1:]]]
    scene.add_constraints("coincide_particle", stencil, name="hold", compliance=0.0, rest=[[-0.015, 0, 0]])
    table = sb.Plane(name="table")
    scene.add_contact(rope, table, friction=0.3, radius=0.004, name="cable")
    scene.add_contact(plug, table, friction=0.3, points=sb.box_corners((0.03, 0.01, 0.01)), name="plug_on_table")
    motion = sb.simulate(scene, [0.0, 0.5], SOLVER)
    place, axes = plug.pose(motion)
    assert place[-1, 2] == pytest.approx(0.005, abs=1e-6)
    assert abs(axes[-1][2, 2]) == pytest.approx(1.0, abs=1e-6)


def test_scene_files_hold_points_of_bodies(tmp_path):
    scene, _ = tossed()
    sb.save_scene(scene, tmp_path / "toss.sheetbend")
    again = sb.load_scene(tmp_path / "toss.sheetbend")
    ends = [sb.simulate(s, [0.0, 0.2], SOLVER).positions[-1] for s in (scene, again)]
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(
    ("contact", "field"),
    [
        ({"points": None}, "contact.points"),
        ({"points": [[0, 0]]}, "contact.points"),
        ({"points": [[0, 0, 0], [0, 0, 0]]}, "contact.points"),
    ],
)
def test_what_is_no_contact_of_a_body_is_refused(contact, field):
    with pytest.raises(sb.SceneError, match=field):
        tossed(**contact)


@pytest.mark.parametrize(("integrator", "off"), [("bdf1", 6e-3), ("bdf2", 2e-3)])
def test_a_free_body_bounces_with_its_restitution(integrator, off):
    # Nothing else holds the body: its rows alone hold its points.
    scene = sb.Scene("box")
    sides = (0.1, 0.1, 0.1)
    box = scene.add_body("box", of=sb.Inertia.box(0.1, sides), at=(0, 0, 0.3))
    scene.add_contact(box, sb.Plane(name="table"), friction=0.1, restitution=0.5, points=sb.box_corners(sides))
    fall = np.sqrt(2 * 0.25 / 9.81)
    solver = sb.Solver(h=1 / 960, method="implicit", integrator=integrator)
    for e in (0.5, 0.8):
        motion = sb.simulate(scene, [0.0, 0.4], solver, {"table_restitution": e})
        after = 0.4 - fall
        expected = 0.05 + e * 9.81 * fall * after - 0.5 * 9.81 * after**2
        assert motion.positions[-1, 0, 2] == pytest.approx(expected, abs=off)


def test_settle_moves_a_body_as_a_whole_out_of_all_shapes():
    scene = sb.Scene("corner")
    body = scene.add_body("cube", of=sb.Inertia.box(0.37, SIDES), at=(0.046, 0, 0.057), rotation=(0, 0, 0.1))
    turned = body.pose(scene.nodes)[1]
    points = sb.box_corners(SIDES)
    for name, normal in (("floor", (0, 0, 1)), ("wall", (1, 0, 0))):
        scene.add_contact(body, sb.Plane(normal=normal, name=name), friction=0.1, points=points, settle=True)
    motion = sb.simulate(scene, [0.0, 2e-3], SOLVER)
    place, axes = body.pose(motion)
    assert place[0] == pytest.approx([(turned @ points.T)[0].max(), 0, 0.06], abs=1e-12)
    np.testing.assert_allclose(axes[0], turned, atol=1e-15)
    assert np.abs(place[1] - place[0]).max() < 1e-4  # weight alone
    assert {name: (s.particles, round(s.farthest, 6)) for name, s in scene.compiled.settled.items()} == {
        name: (1, round(float(np.linalg.norm(place[0] - (0.046, 0, 0.057))), 6)) for name in ("floor", "wall")
    }


def test_settle_moves_no_body_that_something_holds():
    scene = sb.Scene("door")
    door = scene.add_body("door", of=sb.Inertia.box(0.37, SIDES), at=(0, 0, 0.05))
    sb.hinge(None, door, at=(0.05, 0, 0), axis=(0, 1, 0))
    scene.add_contact(door, sb.Plane(name="table"), friction=0.2, points=sb.box_corners(SIDES), settle=True)
    with pytest.raises(sb.SceneError, match="joined to nothing: 'door' is held by 'hinge_"):
        scene.compiled  # noqa: B018


def test_particles_have_no_points():
    scene = sb.rope(0.2, 8, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.1))
    with pytest.raises(sb.SceneError, match="not a body"):
        scene.add_contact(scene.ropes["rope"], sb.Plane(name="table"), friction=0.1, points=[[0, 0, 0]])
