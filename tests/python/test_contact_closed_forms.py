"""Sliding against closed forms: a block on an incline, a chain off a table, a particle around a post."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

G = 9.81


def test_a_chain_slides_off_a_table_and_leaves_its_edge_once_half_of_it_hangs():
    """Of a chain of 1 m whose end hangs D below the top, D = D0 cosh(t sqrt(g)), whatever the radius of the edge, until
    D = 0.5 m. From there on the edge would have to pull."""
    drop, radius, edge, segments = 0.1, 1e-3, 0.05, 40
    bend = edge + radius
    along = np.linspace(-1.0, 0.0, segments + 1) + drop - bend + bend * np.pi / 2  # 0 where the edge begins
    turned, hangs = np.clip(along / bend, 0.0, np.pi / 2), np.maximum(along - bend * np.pi / 2, 0.0)
    x, z = np.minimum(along, 0.0) + bend * np.sin(turned), bend * (np.cos(turned) - 1.0) - hangs
    scene = sb.rope(
        points=np.column_stack([x, 0.0 * x, z]), segments=segments, density=0.05, EA=1e4, EI=1e-9, pinned=()
    )
    table = sb.Box(center=(edge - 2.0, 0, -2.0 - radius), size=(4, 2, 4), edge_radius=edge, name="table")
    scene.add_contact(scene.ropes["rope"], table, friction=0.0, radius=radius, settle=True)
    times, solver = np.array([0.0, 0.5, 0.732, 0.85]), sb.Solver(h=1e-3, method="implicit")
    motion = sb.simulate(scene, times, solver)
    told = drop * np.cosh(times * np.sqrt(G))
    assert -motion.positions[1:3, segments, 2] == pytest.approx(told[1:3], rel=0.003)
    assert -motion.positions[3, segments, 2] < 0.99 * told[3]
    apart = motion.contact_modes["table"] == int(sb.ContactMode.APART)
    on_edge = (motion.positions[..., 0] > 0.0) & (motion.positions[..., 2] > -0.5 * bend)
    assert not apart[1, on_edge[1]].any()
    assert on_edge[3].sum() > 1 and apart[3, on_edge[3]].all()


def test_a_particle_that_is_drawn_around_a_post_leaves_it_at_its_side():
    """It has so much drag that a force of 1 N moves it at 1 m/s: tan(a/2) = tan(a0/2) exp(-t) on a post of 1 m, which
    it leaves at 90 degrees."""
    start, mass = np.radians(150.0), 1e-3
    scene = sb.Scene("drawn", gravity=(1.0 / mass, 0, 0))
    scene.add_particles([[np.cos(start), np.sin(start), 0.0]], mass)
    scene.set_drag(linear=[1.0])
    scene.add_contact([0], sb.Capsule(start=(0, 0, -1), end=(0, 0, 1), radius=1.0, name="post"), friction=0.0)
    rollout = sb.rollout(scene, [0.0, 2.0], sb.Solver(h=2e-3, method="implicit", integrator="bdf1"))
    assert rollout.positions[1, 0] == pytest.approx([2.0 - np.log(np.tan(start / 2)), 1.0, 0.0], abs=2e-3)
    seed = np.zeros_like(rollout.positions)
    seed[1, 0, 0] = 1.0
    by_start = rollout.gradient(seed).inputs["position"].reshape(-1, 3)[0]
    assert by_start @ [-np.sin(start), np.cos(start), 0.0] == pytest.approx(-1.0 / np.sin(start), rel=2e-3)


@pytest.mark.parametrize("method", ["implicit", "gauss_seidel"])
def test_a_block_slides_down_an_incline_as_coulomb_says(method: str):
    """x = g (sin a - mu cos a) t^2/2, which N substeps of backward Euler make larger by a share of 1/N."""
    slope, friction, h, steps = np.radians(30.0), 0.3, 1e-3, 1000
    scene = sb.Scene("incline", gravity=(G * np.sin(slope), 0, -G * np.cos(slope)))
    scene.add_contact(scene.add_particles([[0, 0, 0]], 0.2), sb.Plane(name="table"), friction=friction)
    solver = sb.Solver(h=h, method=method, integrator="bdf1", iterations=100 if method == "implicit" else 1)
    rollout = sb.rollout(scene, [0.0, steps * h], solver)
    half = 0.5 * h**2 * steps * (steps + 1)
    assert rollout.positions[1, 0, 0] == pytest.approx(G * (np.sin(slope) - friction * np.cos(slope)) * half, rel=2e-5)
    seed = np.zeros_like(rollout.positions)
    seed[1, 0, 0] = 1.0
    by_friction = rollout.gradient(seed).quantities["table_friction"]
    assert by_friction == pytest.approx(-G * np.cos(slope) * half, rel=2e-5)
