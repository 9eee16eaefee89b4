"""Equilibria of what touches shapes: forces, friction that holds or slides, and derivatives."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

G = 9.81


def particle_on_a_slope(
    degrees: float, friction: float, stiffness: float | None = None, spring: float = 50.0
) -> sb.Scene:
    """0.2 kg on a slope that falls along x, held by a spring (N/m) that is 0.1 m long at rest."""
    angle = np.radians(degrees)
    along, normal = np.array([np.cos(angle), 0.0, -np.sin(angle)]), np.array([np.sin(angle), 0.0, np.cos(angle)])
    scene = sb.Scene("slope")
    scene.add_particles([[0.0, 0.0, 0.0], 0.1 * along], [1.0, 0.2])
    scene.pin([0])
    scene.add_constraints("distance", [[0, 1]], name="spring", compliance=1 / spring, rest=[0.1])
    scene.add_contact([1], sb.Plane(normal=normal, name="slope"), friction=friction, stiffness=stiffness)
    return scene


def test_what_is_soft_gives_way_by_its_weight_over_its_stiffness():
    scene = particle_on_a_slope(0.0, 0.3, stiffness=400.0, spring=1e-4)
    rest = sb.equilibrium(scene)
    assert rest.positions[1] == pytest.approx([0.1, 0.0, -0.2 * G / 400.0], abs=1e-9)
    assert rest.unstable_modes == 0
    up = np.zeros_like(rest.positions)
    up[1, 2] = 1.0
    gradient = rest.gradient(up)
    assert gradient["slope_contact_stiffness"] == pytest.approx(0.2 * G / 400.0**2, rel=1e-6)
    assert gradient["slope_z"] == pytest.approx(1.0, rel=1e-6)
    assert gradient["slope_friction"] == 0.0


def test_a_rigid_contact_is_as_deep_as_in_a_simulation_at_1_ms():
    rest = sb.equilibrium(particle_on_a_slope(0.0, 0.3, spring=1e-4))
    assert rest.positions[1, 2] == pytest.approx(-G * 1e-9, rel=1e-6)


def test_friction_slides_to_its_limit_or_holds():
    angle, mu = np.radians(40.0), 0.2
    scene = particle_on_a_slope(40.0, mu)
    rest = sb.equilibrium(scene)
    along = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    stretch = 0.2 * G * (np.sin(angle) - mu * np.cos(angle)) / 50.0
    assert rest.positions[1] @ along == pytest.approx(0.1 + stretch, abs=1e-8)
    seed = np.zeros_like(rest.positions)
    seed[1] = along
    assert rest.gradient(seed)["slope_friction"] == pytest.approx(-0.2 * G * np.cos(angle) / 50.0, rel=1e-6)
    held = sb.equilibrium(scene, values={"slope_friction": 0.9})
    assert held.positions[1] @ along == pytest.approx(0.1, abs=1e-7)
    assert held.gradient(seed)["slope_friction"] == 0.0


def test_what_does_not_touch_at_the_start_has_no_friction():
    scene = particle_on_a_slope(40.0, 0.9)
    start = scene.positions + np.array([0.0, 0.0, 0.01])
    rest = sb.equilibrium(scene, start)
    assert np.linalg.norm(rest.positions[1]) == pytest.approx(0.1 + 0.2 * G * np.sin(np.radians(40.0)) / 50.0, abs=1e-7)


def rope_over_a_bar(friction: float = 0.2) -> sb.Scene:
    """Lies on a cylinder, and is pulled down more at one end than at the other."""
    angles = np.linspace(np.pi, 0.0, 25)
    arc = 0.0505 * np.column_stack([np.cos(angles), np.zeros(25), np.sin(angles)])
    scene = sb.Scene("over a bar")
    ends = [[-0.0505, 0.0, -0.08], [0.0505, 0.0, -0.08]]
    scene.add_particles(np.vstack([ends[0], arc, ends[1]]), [1.0, *np.full(25, 1e-5), 0.1])
    scene.pin([0])
    pairs = np.array([[i, i + 1] for i in range(26)])
    lengths = np.linalg.norm(np.diff(scene.positions, axis=0), axis=1)
    scene.add_constraints("distance", pairs, name="rope", compliance=lengths / 200.0, rest=lengths)
    bar = sb.Capsule(start=(0, -0.3, 0), end=(0, 0.3, 0), radius=0.05, name="bar")
    scene.add_contact(np.arange(1, 26), bar, friction=friction, radius=0.0005)
    return scene


def test_a_rope_over_a_bar_has_the_tensions_of_the_capstan():
    scene = rope_over_a_bar()
    rest = sb.equilibrium(scene)
    tension = -rest.forces["rope"][:, 0]
    assert tension[-1] / tension[0] == pytest.approx(np.exp(0.2 * np.pi), rel=2e-3)
    smooth = sb.equilibrium(scene, values={"bar_friction": 0.0})
    tension = -smooth.forces["rope"][:, 0]
    assert tension[-1] == pytest.approx(tension[0], rel=2e-3)


@pytest.mark.parametrize("name", ["bar_friction", "bar_radius", "bar_contact_radius", "bar_x"])
def test_its_derivatives_are_those_of_differences(name: str):
    scene = rope_over_a_bar()
    seed = np.random.default_rng(0).normal(size=scene.positions.shape)
    at = dict(zip(scene.compiled.names, scene.compiled.values({}), strict=True))
    step = {"bar_friction": 1e-4}.get(name, 1e-7)

    def loss(value: float) -> float:
        return float((seed * sb.equilibrium(scene, values={name: value}).positions).sum())

    slope = (loss(at[name] + step) - loss(at[name] - step)) / (2 * step)
    assert sb.equilibrium(scene).gradient(seed)[name] == pytest.approx(slope, rel=1e-4)


def test_tangents_are_the_transpose_of_gradients():
    from sheetbend import _core

    scene = rope_over_a_bar()
    rest = sb.equilibrium(scene)
    rng = np.random.default_rng(1)
    along = rng.normal(size=len(scene.compiled.inputs(scene.compiled.values({})))) * 1e-3
    states = _core.equilibria_jvp([rest.solution], along[None])[0]
    seed = rng.normal(size=rest.nodes.size)
    assert seed @ states[: seed.size] == pytest.approx(rest.solution.vjp(seed, None) @ along, rel=1e-7)


def cloth_on_a_ball() -> sb.Scene:
    scene = sb.Scene("draped")
    mesh = sb.mesh.equilateral(0.16, 0.16, 8)
    sb.add_cloth(scene, mesh, density=0.2, warp=100, shear=30, bending=1e-4)
    middle = scene.positions.mean(axis=0)
    ball = sb.Sphere(center=middle - [0.006, 0.004, 0.0521], radius=0.05, name="ball")
    scene.set_drag(linear=np.full(scene.particle_count, 5e-4))
    scene.add_contact(scene.cloths["cloth"], ball, friction=0.3, radius=0.002, stiffness=2e3)
    return scene


def test_a_draped_cloth_stays_as_it_lies_and_has_derivatives():
    scene = cloth_on_a_ball()
    motion = sb.simulate(scene, [0.0, 8.0], sb.Solver(h=2e-2, method="implicit", integrator="bdf1"))
    assert motion.contacts["ball"].most > 3
    end = motion.nodes[-1]  # with the friction forces
    rest = sb.equilibrium(scene, end)
    cloth = scene.cloths["cloth"].particles
    assert np.abs(rest.nodes - end)[cloth].max() < 1e-6
    assert rest.unstable_modes == 0
    # Less friction lets it slide on. At that of the simulation itself some particles are at their limit, a kink.
    less = {"ball_friction": 0.27}
    rest = sb.equilibrium(scene, end, less)
    assert 1e-6 < np.abs(rest.nodes - end)[cloth].max() < 1e-2
    seed = np.zeros_like(end)
    seed[cloth, 2] = 1.0 / len(cloth)
    gradient = rest.gradient(seed)
    at = dict(zip(scene.compiled.names, scene.compiled.values(less), strict=True))
    for name in ("cloth_bending", "ball_friction", "ball_contact_stiffness"):
        heights = [
            sb.equilibrium(scene, end, less | {name: at[name] * (1 + s * 1e-3)}).positions[cloth, 2].mean()
            for s in (-1, 1)
        ]
        assert gradient[name] == pytest.approx((heights[1] - heights[0]) / (2e-3 * at[name]), rel=1e-3)
