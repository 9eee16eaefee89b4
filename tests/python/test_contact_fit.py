"""Friction, radius and height of a table among the parameters of a fit: what a recording knows of them."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")
TIMES = np.linspace(0.0, 0.6, 31)
SIGMA = 1e-3  # m


def dragged(friction: float, aside: float = 0.15, slope: float = 0.0, depth: float = 0.0) -> sb.Scene:
    """A rope whose start is drawn aside by so many m; on a plane that falls off to its side where it has a slope."""
    scene = sb.rope(0.3, 11, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.006), pinned=())
    rope = scene.ropes["rope"]
    share = np.clip((TIMES - 0.04) / 0.3, 0.0, 1.0)
    path = np.zeros((len(TIMES), 1, 3))
    path[:, 0, 1] = aside * share**2 * (3 - 2 * share)
    if aside:
        scene.drive(rope.particles[:1], TIMES, scene.positions[rope.particles[:1]] + path)
    scene.contact(rope, sb.Plane((0, 0, -depth), (0, slope, 1), name="table"), friction=friction, radius=0.005)
    return scene


def fitted(true: sb.Scene, model: sb.Scene, names: list[str], seed: int, **values: float) -> sb.Fit:
    particles = true.ropes["rope"].particles
    x = sb.simulate(true, TIMES, SOLVER, values=values).positions[:, particles]
    seen = x + SIGMA * np.random.default_rng(seed).standard_normal(x.shape)
    recording = sb.Recording(positions=seen, times=TIMES, name="drag")
    places = [sb.on_particle(int(p)) for p in particles]
    return sb.fit(model, recording, names, markers=places, solver=SOLVER, sigma=SIGMA)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_dragged_rope_tells_its_friction(seed: int) -> None:
    fit = fitted(dragged(0.3), dragged(0.2), ["table_friction", "rope_EI"], seed)
    friction, bending = fit.result.estimates
    assert friction.verdict == bending.verdict == "identified"
    assert friction.lower < 0.3 < friction.upper
    assert bending.lower < 1e-4 < bending.upper
    assert friction.statistical < 0.005
    assert any(refit.name == "time step" for refit in fit.result.refits)  # whole, for contacts have kinks
    assert fit.result.warnings == ()


@pytest.mark.parametrize(("start", "seed"), [(0.4, 0), (0.19, 1)])
def test_a_rope_that_sticks_tells_that_friction_is_large_enough(start: float, seed: int) -> None:
    fit = fitted(dragged(0.5, aside=0.0, slope=0.2), dragged(start, aside=0.0, slope=0.2), ["table_friction"], seed)
    (friction,) = fit.result.estimates
    assert friction.verdict == "one-sided"
    assert 0.18 < friction.lower <= 0.201  # the slope; what slides by less than the noise shows is allowed
    assert friction.upper is None and "sticks" in friction.words


def test_a_start_that_sticks_is_no_minimum_of_a_recording_that_slides() -> None:
    fit = fitted(dragged(0.1, aside=0.0, slope=0.2), dragged(0.4, aside=0.0, slope=0.2), ["table_friction"], 0)
    (friction,) = fit.result.estimates
    assert friction.verdict == "no minimum" and "start from there" in friction.words


@pytest.mark.parametrize(("aside", "depth"), [(0.0, 0.0), (0.05, 3.0)])
def test_a_rope_that_only_rests_or_touches_nothing_tells_no_friction(aside: float, depth: float) -> None:
    true, model = dragged(0.3, aside, depth=depth), dragged(0.2, aside, depth=depth)
    fit = fitted(true, model, ["table_friction"], 0)
    (friction,) = fit.result.estimates
    assert friction.verdict == "not identifiable"


def test_the_height_of_a_table_is_found_where_a_rope_lands() -> None:
    fit = fitted(dragged(0.3, 0.05), dragged(0.3, 0.05), ["table_z"], 0, table_z=-3e-3)
    (height,) = fit.result.estimates
    assert height.verdict == "identified"
    assert height.lower < -3e-3 < height.upper
    assert height.half_width < 3e-4


def test_height_and_radius_of_a_flat_table_trade() -> None:
    fit = fitted(dragged(0.3, 0.05), dragged(0.3, 0.05), ["table_z", "table_contact_radius"], 0, table_z=-3e-3)
    assert {e.verdict for e in fit.result.estimates} == {"not identifiable"}
    assert "table_contact_radius" in fit.result.estimates[0].words
