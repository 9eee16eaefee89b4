"""Bodies that rest on shapes: where, held by what, and derivatives."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core

G, MASS, SIDES = 9.81, 0.4, (0.1, 0.1, 0.12)


def box_on_a_slope(degrees: float, friction: float, stiffness: float | None = None, above: float = 0.0):
    """0.4 kg on a plane that falls along x."""
    angle = np.radians(degrees)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    scene = sb.Scene("box")
    start = {"at": (0.5 * SIDES[2] + above) * normal, "rotation": (0.0, angle, 0.0)}
    box = scene.add_body("box", of=sb.Inertia.box(MASS, SIDES), **start)
    table = sb.Plane(normal=normal, name="table")
    scene.add_contact(box, table, friction=friction, stiffness=stiffness, points=sb.box_corners(SIDES))
    return scene, box


def moved(scene: sb.Scene, box: sb.Body, **values: float) -> np.ndarray:
    rest = sb.equilibrium(scene, values=values)
    return box.pose(rest.nodes, values)[0] - box.pose(scene.nodes)[0]


def seed_of(scene: sb.Scene, node: int, direction: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    seed = np.zeros((scene.node_count, 3))
    seed[node] = direction
    return seed


def test_four_soft_corners_give_way_by_a_quarter_of_the_weight():
    scene, box = box_on_a_slope(0.0, 0.5, stiffness=400.0)
    rest = sb.equilibrium(scene)
    assert moved(scene, box) == pytest.approx([0, 0, -MASS * G / 1600.0], abs=1e-12)
    assert rest.unstable_modes == 0
    gradient = rest.gradient(seed_of(scene, box.particles[0]))
    assert gradient["box_mass"] == pytest.approx(-G / 1600.0, rel=1e-9)
    assert gradient["table_contact_stiffness"] == pytest.approx(MASS * G / 1600.0 / 400.0, rel=1e-9)
    assert gradient["box_center_z"] == pytest.approx(1.0, rel=1e-9)
    # With its center 1 mm off the middle in x it leans, until 4 k (L/2)^2 per angle hold the weight at its height z.
    leans = sb.equilibrium(scene, values={"box_center_x": 1e-3})
    lean = MASS * G * 1e-3 / (1600.0 * 0.05**2 - MASS * G * 0.06)
    assert box.pose(leans.nodes)[1][2, 0] == pytest.approx(-lean, rel=1e-5)


def test_friction_holds_a_box_on_a_slope_or_does_not():
    scene, box = box_on_a_slope(20.0, 0.5)
    assert np.abs(moved(scene, box)).max() < 1e-7
    with pytest.raises(sb.NoEquilibriumError, match=r"no rest found.*friction"):
        sb.equilibrium(scene, values={"table_friction": 0.3})


@pytest.mark.parametrize(
    ("name", "step"),
    [
        ("box_mass", 1e-5),
        ("box_center_x", 1e-6),
        ("box_center_z", 1e-6),
        ("box_axes_turn_y", 1e-6),
        ("table_friction", 1e-6),
        ("table_z", 1e-7),
        ("table_contact_stiffness", 1e-2),
    ],
)
def test_derivatives_are_those_of_differences(name: str, step: float):
    # The upper corners carry little and slide, the lower ones stick.
    scene, _ = box_on_a_slope(20.0, 0.5, stiffness=1000.0)
    seed = np.random.default_rng(0).normal(size=scene.nodes.shape)
    seed[scene.bodies["box"].particles[-1] + 1 :] = 0.0
    value = scene.quantities[name].value

    def loss(at: float) -> float:
        return float((seed * sb.equilibrium(scene, values={name: at}).nodes).sum())

    gradient = sb.equilibrium(scene).gradient(seed)
    slope = (loss(value + step) - loss(value - step)) / (2 * step)
    assert gradient[name] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_tangents_are_the_transpose_of_gradients():
    scene, _ = box_on_a_slope(20.0, 0.5, stiffness=1000.0)
    rest = sb.equilibrium(scene)
    rng = np.random.default_rng(1)
    along = rng.normal(size=len(scene.compiled.inputs(scene.compiled.values({})))) * 1e-3
    states = _core.equilibria_jvp([rest.solution], along[None])[0]
    seed = rng.normal(size=rest.nodes.size)
    assert seed @ states[: seed.size] == pytest.approx(rest.solution.vjp(seed, None) @ along, rel=1e-9)


def test_what_nothing_holds_has_a_place_and_no_derivative():
    scene, box = box_on_a_slope(0.0, 0.0, stiffness=400.0)
    rest = sb.equilibrium(scene)
    with pytest.raises(RuntimeError, match="moves freely"):
        rest.gradient(seed_of(scene, box.particles[0]))
    # What falls on a plane has no friction there, for nothing tells where it would have stuck.
    with pytest.raises(sb.NoEquilibriumError, match="touches at the start"):
        sb.equilibrium(box_on_a_slope(0.0, 0.5, above=0.01)[0])


def test_a_box_that_was_tossed_stays_where_it_came_to_rest():
    scene = sb.Scene("toss")
    start = {"at": (0, 0, 0.2), "velocity": (0.8, 0.1, -0.5), "spin": (1, -3, 2)}
    box = scene.add_body("box", of=sb.Inertia.box(MASS, SIDES), **start)
    scene.add_contact(box, sb.Plane(name="table"), friction=0.2, points=sb.box_corners(SIDES))
    motion = sb.simulate(scene, [0.0, 1.2], sb.Solver(h=2e-3, method="implicit", integrator="bdf1"))
    rest = sb.equilibrium(scene, motion.nodes[-1])
    assert np.abs(box.pose(rest.nodes)[0] - box.pose(motion)[0][-1]).max() < 1e-7


def test_a_plate_lies_with_one_edge_on_a_table_and_hangs_by_the_other():
    sides = (0.3, 0.2, 0.01)
    scene = sb.Scene("plate")
    plate = scene.add_body("plate", of=sb.Inertia.box(MASS, sides), at=(0, 0, 0.5 * sides[2]))
    for name, y in (("left", -0.1), ("right", 0.1)):
        place = (0.15, y, 0.0)
        top = (0.15, y, 0.5 * sides[2] + 0.4)
        rope = {"length": 0.4, "segments": 4, "density": 1e-3, "EA": 2e4, "EI": 1e-6}
        hung = sb.add_rope(scene, name, start=top, direction=(0, 0, -1), **rope)
        scene.pin(hung.particles[:1])
        stencil = [[plate.particles[0], hung.particles[-1], *plate.particles[1:]]]
        scene.add_constraints("coincide_particle", stencil, name=f"{name}_knot", compliance=0.0, rest=[place])
    feet = [[-0.15, y, -0.005] for y in (-0.1, 0.1)]
    scene.add_contact(plate, sb.Plane(name="table"), friction=0.4, points=feet)
    rest = sb.equilibrium(scene)
    weight = MASS * G / 4 + 1e-3 * G * np.array([0.35, 0.25, 0.15, 0.05])  # and that of the rope below the link
    for name in ("left", "right"):
        stretch = next(group for group in rest.forces if group.startswith(name) and "knot" not in group)
        tension = -rest.forces[stretch][:, 0]
        assert tension[[0, -1]] == pytest.approx(weight[[0, -1]], rel=2e-3)
    gradient = rest.gradient(seed_of(scene, plate.particles[0]))
    assert gradient["plate_mass"] < 0.0
    values = {"plate_mass": 1.001 * MASS}
    heights = [sb.equilibrium(scene, values=v).nodes[plate.particles[0], 2] for v in (None, values)]
    assert gradient["plate_mass"] == pytest.approx((heights[1] - heights[0]) / (1e-3 * MASS), rel=1e-2)
