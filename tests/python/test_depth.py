"""How deep particles were in the shapes that they touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb

RADIUS, GRAVITY = 0.005, 9.81
SOLVER = sb.Solver(h=5e-3, method="implicit", integrator="bdf1")
TIMES = np.linspace(0.0, 0.2, 21)


def rope(depth: float = 0.0, lift: float = 0.0, stiffness: float | None = None) -> sb.Scene:
    """A rope that falls 1 mm onto a table, which moves up by `lift`; with a depth every second particle is driven, and
    pressed so far into it."""
    scene = sb.rope(0.2, 8, density=0.05, EA=1e5, EI=1e-4, start=(0, 0, RADIUS + 1e-3), pinned=())
    share = np.clip(TIMES / 0.1, 0.0, 1.0)
    ease = share**2 * (3 - 2 * share)
    if depth:
        hand = scene.ropes["rope"].particles[::2]
        path = np.repeat(scene.positions[hand][None], len(TIMES), axis=0)
        path[:, :, 2] -= (depth + 1e-3) * ease[:, None]
        scene.drive(hand, TIMES, path)
    table = sb.Plane(name="table").moving(TIMES, lift * ease[:, None] * [0.0, 0.0, 1.0])
    scene.contact(scene.ropes["rope"], table, friction=0.3, radius=RADIUS, stiffness=stiffness)
    return scene


def deepest(scene: sb.Scene, solver: sb.Solver = SOLVER) -> float:
    found = sb.simulate(scene, TIMES, solver).contacts["table"].deepest
    assert found is not None
    return found


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("lift", [0.0, 0.02])
def test_a_rope_at_rest_lies_as_deep_as_its_contact_is_stiff(integrator: str, lift: float) -> None:
    scene, solver = rope(lift=lift), replace(SOLVER, integrator=integrator)
    end = sb.simulate(scene, TIMES, solver).positions[-1, :, 2]
    rest = GRAVITY * SOLVER.h**2 / 1000  # docs/contact.md
    assert RADIUS + lift - end == pytest.approx(rest, rel=1e-2)
    assert rest < deepest(scene, solver) < 20 * rest + 2 * lift / 0.1 * SOLVER.h / 1000


def test_a_soft_contact_gives_way_by_weight_over_stiffness() -> None:
    depth, mass = 1e-3, 0.05 * 0.2 / 8
    scene = rope(stiffness=mass * GRAVITY / depth)
    end = sb.simulate(scene, TIMES, SOLVER).positions[..., 2]
    assert deepest(scene) == pytest.approx(RADIUS - end.min(), rel=1e-9)
    assert depth < deepest(scene) < 2.5 * depth


def test_what_is_driven_touches_nothing_and_what_it_presses_in_counts() -> None:
    scene = rope(depth=3e-3)
    x = sb.simulate(scene, TIMES, SOLVER).positions[..., 2]
    assert RADIUS - x[:, ::2].min() == pytest.approx(3e-3)
    assert deepest(scene) == pytest.approx(RADIUS - x[:, 1::2].min(), rel=1e-9)
    assert 0.5e-3 < deepest(scene) < 2e-3


def test_runs_that_are_combined_tell_the_depth_of_the_one_at_h() -> None:
    scene = rope()
    assert deepest(scene, replace(SOLVER, extrapolate=2)) == deepest(scene)
