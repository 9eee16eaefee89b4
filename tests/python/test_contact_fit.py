"""Friction, radius and height of a table among the parameters of a fit: what a recording knows of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    scene.add_contact(rope, sb.Plane((0, 0, -depth), (0, slope, 1), name="table"), friction=friction, radius=0.005)
    return scene


def fitted(
    true: sb.Scene,
    model: sb.Scene,
    free: Sequence[str | sb.Parameter],
    seed: int,
    world: sb.Solver = SOLVER,
    noise: float = SIGMA,
    **values: float,
) -> sb.Fit:
    particles = true.ropes["rope"].particles
    x = sb.simulate(true, TIMES, world, values=values).positions[:, particles]
    seen = x + noise * np.random.default_rng(seed).standard_normal(x.shape)
    recording = sb.Recording(positions=seen, times=TIMES, name="drag")
    places = [sb.on_particle(int(p)) for p in particles]
    return sb.fit(model, recording, free, markers=places, solver=SOLVER, sigma=noise)


def test_a_dragged_rope_tells_its_friction_in_the_limit_of_short_substeps() -> None:
    """The substep of the fit is off by five standard errors, so the estimate has to move, and hardly widens for it."""
    world = sb.Solver(h=2e-4, method="implicit", integrator="bdf1", extrapolate=2)
    fit = fitted(dragged(0.3), dragged(0.2), ["table_friction", "rope_EI"], 1, world)
    friction, bending = fit.result.estimates
    assert friction.verdict == bending.verdict == "identified"
    assert friction.lower < 0.3 < friction.upper
    assert bending.lower < 1e-4 < bending.upper
    assert friction.statistical < 0.005
    assert abs(friction.moved) > 0.004
    assert friction.discretization < 0.3 * abs(friction.moved)
    assert not [w for w in fit.result.warnings if "noise of its driven motion" not in w]  # which the intervals count


def test_a_recording_that_was_simulated_at_the_substep_of_the_fit_is_told_as_such() -> None:
    fit = fitted(dragged(0.3), dragged(0.2), ["table_friction", "rope_EI"], 0)
    (friction, _) = fit.result.estimates
    assert friction.lower < 0.3 < friction.upper
    assert friction.moved == 0.0
    assert "simulated at the same substep" in "".join(fit.result.warnings)


def test_a_knot_that_nobody_weighed_is_named_where_residuals_hardly_exceed_noise() -> None:
    """Friction was 0.493 +/- 0.043 for 0.3, "identified", and no word: what a model lacks was looked for only where the
    residuals' sum of squares exceeds noise by a fifth."""
    true = dragged(0.3)
    true.add_point_mass(int(true.ropes["rope"].particles[-1]), 1.3e-3, "knot")
    world = sb.Solver(h=4e-4, method="implicit", integrator="bdf1", extrapolate=2)
    found = fitted(true, dragged(0.4), ["table_friction", "rope_EI"], 1, world).result
    assert found.misfit is not None and found.misfit.reduced_chi_square < 1.25
    assert found["table_friction"].value > 0.45 and found["table_friction"].verdict == "doubtful"
    assert any("more hung on the end of rope" in w for w in found.warnings)


@pytest.mark.parametrize(("start", "seed"), [(0.4, 0), (0.19, 1)])
def test_a_rope_that_sticks_tells_that_friction_is_large_enough(start: float, seed: int) -> None:
    fit = fitted(dragged(0.5, aside=0.0, slope=0.2), dragged(start, aside=0.0, slope=0.2), ["table_friction"], seed)
    (friction,) = fit.result.estimates
    assert friction.verdict == "one-sided"
    assert 0.18 < friction.lower <= 0.201  # the slope; what slides by less than the noise shows is allowed
    assert friction.upper is None and "stick" in friction.words


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


def test_the_report_tells_what_touches_and_where_motions_have_kinks() -> None:
    world = sb.Solver(h=2e-4, method="implicit", integrator="bdf1")
    result = fitted(dragged(0.3), dragged(0.29), ["table_friction"], 1, world).result
    (touch,), (kinks,) = result.contacts, result.kinks
    assert (touch.contact, touch.particles, touch.most, touch.bdf1) == ("table", 12, 11, 1.0)  # one is driven
    assert touch.began >= 11 and touch.began - touch.ended == 11  # it falls on the table
    assert touch.sliding + touch.sticking == pytest.approx(1.0)
    assert 0.3 < touch.sliding < 0.9
    assert 0.3e-7 < touch.deepest < 1e-6  # 3.9e-8 m at rest
    assert kinks.name == "table_friction" and kinks.stick > 0 and kinks.begin == kinks.end == 0
    report = result.report()
    assert (
        "11 of 12" in report
        and "< 0.001 mm" in report
        and "the search for a drag or damping that the model lacks is linear" in " ".join(report.split())
    )
    assert sb.FitResult.from_dict(result.to_dict()) == result


def test_an_interval_that_leaves_the_range_of_a_friction_without_bounds_has_no_kinks() -> None:
    """No motion has a negative friction, and the fit ends all the same."""
    friction = sb.Parameter(name="table_friction", initial=0.29)
    result = fitted(dragged(0.3), dragged(0.29), [friction], 1, noise=0.3).result
    (estimate,), (kinks,) = result.estimates, result.kinks
    assert estimate.lower < 0.0 < estimate.upper
    assert kinks.begin == kinks.end == kinks.stick == kinks.slide == 0


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_slides_and_sticks_are_those_of_a_block_on_a_slope(integrator: str) -> None:
    """Below the critical angle all sticks at rest, above it all slides, also where drag adds to the mass."""
    for friction, sliding in ((0.25, 0.0), (0.15, 1.0)):
        scene = sb.Scene("block")
        (block,) = scene.add_particles([[0.0, 0.0, 0.0]], 0.1)
        plane = sb.Plane(normal=(0.0, -0.2, 1.0), name="slope")
        scene.add_contact([block], plane, friction=friction)
        scene.set_drag(linear=[1e-3])
        motion = sb.simulate(scene, np.linspace(0.0, 0.2, 11), replace(SOLVER, integrator=integrator))
        modes = motion.contact_modes["slope"]
        assert modes.shape == (11, 1)
        assert modes[0, 0] == sb.ContactMode.APART
        assert float((modes[2:] == sb.ContactMode.SLIDES).mean()) == sliding
        assert float((modes[2:] == sb.ContactMode.STICKS).mean()) == 1.0 - sliding
