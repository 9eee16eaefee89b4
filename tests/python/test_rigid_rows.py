"""Rigid constraints in `implicit`, with contact, and beside what gives way in `newton` and `newton_cg`."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

IMPLICIT = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")


def stick(friction: float = 0.3) -> sb.Scene:
    """A triangle of rigid distances that drops on a table, sliding."""
    scene = sb.Scene("stick")
    particles = scene.add_particles(
        [[0, 0, 0.002], [0.1, 0, 0.004], [0.05, 0.08, 0.003]], [0.1, 0.2, 0.15], [[0.5, 0.1, 0.0]] * 3
    )
    scene.add_constraints("distance", [[0, 1], [1, 2], [2, 0]], name="sides", compliance=0.0)
    scene.add_contact(particles, sb.Plane(name="table"), friction=friction)
    return scene


def test_a_rigid_triangle_slides_to_rest_and_lies_on_its_supports():
    scene = stick()
    motion = sb.simulate(scene, 1e-3 * np.arange(301), IMPLICIT)
    x = motion.positions[:, :3]
    sides = np.linalg.norm(x[:, [0, 1, 2]] - x[:, [1, 2, 0]], axis=2)
    assert np.ptp(sides, axis=0).max() < 1e-14
    assert np.abs(x[-1] - x[-50]).max() < 1e-9
    assert np.abs(x[-1, :, 2]).max() < 1e-6
    assert 0.02 < x[-1, 0, 0] - x[0, 0, 0] < 0.05  # v^2/(2 mu g) is 44 mm


def test_its_gradients_are_those_of_differences():
    scene = stick()
    rollout = sb.rollout(scene, [0.0, 0.05], IMPLICIT)
    bar = np.zeros_like(rollout.positions)
    bar[-1, :3] = [[1.0, 0.2, 0.0], [0.5, -0.3, 0.1], [-0.2, 0.4, 0.0]]
    gradient = rollout.gradient(bar)

    def loss(friction: float) -> float:
        moved = sb.rollout(scene, [0.0, 0.05], IMPLICIT, values={"table_friction": friction})
        return float((bar * moved.positions).sum())

    expected = (loss(0.3 + 1e-6) - loss(0.3 - 1e-6)) / 2e-6
    assert gradient.quantities["table_friction"] == pytest.approx(expected, rel=1e-6)


def test_an_inextensible_rope_is_dragged_over_a_table():
    """A rope without EA has rigid links: its pull is that of friction."""
    scene = sb.rope(0.3, 10, density=0.05, start=(0, 0, 0), pinned=())
    scene.drive([0], [0.0, 0.3], [[[0.0, 0.0, 0.0]], [[-0.06, 0.0, 0.0]]], interpolation="linear")
    scene.add_contact(scene.ropes["rope"], sb.Plane(name="table"), friction=0.4)
    motion = sb.simulate(scene, [0.0, 0.29, 0.3], IMPLICIT)
    tension = motion.forces["rope_stretch"][-1, :, 0]
    weight = 0.05 * 0.3 * 9.81
    assert np.abs(tension).max() == pytest.approx(0.4 * weight * (1.0 - 0.05), rel=1e-3)  # half a link is the hand's


def flag(compliance: float) -> sb.Scene:
    """A cloth whose edge is a pole on a hook."""
    scene = sb.Scene("flag")
    cloth = sb.add_cloth(scene, sb.mesh.grid(0.2, 0.15, 4, 3), density=0.2, warp=200.0, shear=40.0, bending=1e-4)
    x = scene.positions
    edge = cloth.particles[np.isclose(x[cloth.particles, 0], x[cloth.particles, 0].min())]
    hook = scene.add_particles([x[edge[0]] + [0.0, 0.0, 0.1]], 0.01)
    scene.pin(hook)
    ends = [[edge[0], hook[0]], [edge[0], edge[-1]]] + [[edge[0], n] for n in edge[1:-1]]
    scene.add_constraints("distance", ends, name="pole", compliance=compliance)
    return scene


@pytest.mark.filterwarnings("ignore:cloth")
def test_a_cloth_hangs_on_a_rigid_pole():
    """As with a pole that is very stiff, by factors and by conjugate gradients; the gradient is exact."""
    solver, times = sb.Solver(h=2e-3, method="newton", iterations=4), [0.0, 0.02]
    motion = sb.simulate(flag(0.0), times, solver)
    others = [(1e-11, solver, 1e-7), (0.0, sb.Solver(h=2e-3, method="newton_cg", iterations=4), 1e-10)]
    for compliance, other, near in others:
        assert np.abs(sb.simulate(flag(compliance), times, other).positions - motion.positions).max() < near
    assert np.abs(motion.positions[1] - motion.positions[0]).max() > 1e-3
    assert np.abs(motion.forces["pole"][-1, :, 0]).max() > 1e-3
    for row in sb.check_gradients(flag(0.0), [0.0, 0.008], solver, samples=2).rows:
        assert row.complex_step < 1e-9, row


def test_redundant_rows_are_named():
    scene = sb.Scene("square")
    scene.add_particles(0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [1, -1, 0], [0, -1, 0]]), 0.1)
    pairs = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 3]]
    scene.add_constraints("distance", pairs, name="links", compliance=0.0)
    for method in ("implicit", "newton"):
        with pytest.warns(sb.RedundantConstraintsWarning, match=r"square: .* links \d .* follows from"):
            motion = sb.simulate(scene, [0.0, 0.05], sb.Solver(method=method))
        ends = scene.groups[0].particles
        lengths = np.linalg.norm(motion.positions[:, ends[:, 0]] - motion.positions[:, ends[:, 1]], axis=2)
        assert np.ptp(lengths, axis=0).max() < 1e-14, method
