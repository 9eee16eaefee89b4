"""Soft contacts that dissipate: the speed after an impact in closed form, its gradient, a fit, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from scipy.optimize import brentq

MASS, STIFFNESS, SPEED, LOSS = 0.2, 5e3, 1.5, 0.6  # kg, N/m, m/s, s/m
CONTACT_TIME = np.pi * np.sqrt(MASS / STIFFNESS)  # without loss, 20 ms


def ball(loss: float | None = LOSS, speed: float = SPEED, gravity: float = 0.0, **contact) -> sb.Scene:
    """A ball that flies straight down onto a soft table, from 15 mm above it."""
    scene = sb.Scene("ball", gravity=(0.0, 0.0, -gravity))
    scene.add_particles([[0.0, 0.0, 0.015]], MASS, [[0.0, 0.0, -speed]])
    given = {"friction": 0.0, "stiffness": STIFFNESS, "dissipation": loss} | contact
    scene.add_contact([0], sb.Plane(name="table"), **given)
    return scene


def leaves(loss: float, speed: float = SPEED) -> float:
    """The speed after an impact. From m v dv/(1 + a v) = -k d dd: a v - ln(1 + a v) is the same before and after."""

    def conserved(v: float) -> float:
        return loss * v - np.log1p(loss * v)

    return brentq(lambda v: conserved(-v) - conserved(speed), 1e-9, (1.0 - 1e-12) / loss, xtol=1e-14)


def found(scene: sb.Scene, h: float, values: dict[str, float] | None = None) -> float:
    """The speed at which it flies off."""
    motion = sb.simulate(scene, [0.0, 0.06, 0.08], sb.Solver(h=h, method="implicit", integrator="bdf2"), values)
    heights = motion.positions[:, 0, 2]
    assert heights[1] > 0.0
    return float((heights[2] - heights[1]) / 0.02)


def test_a_ball_leaves_at_the_speed_of_the_closed_form():
    errors = [found(ball(), h) - leaves(LOSS) for h in (2e-4, 1e-4, 5e-5)]
    assert abs(errors[-1]) < 2e-3 * leaves(LOSS)
    assert 1.5 < errors[0] / errors[1] < 4.5 and 1.5 < errors[1] / errors[2] < 4.5
    assert leaves(LOSS) < 0.7 * SPEED  # so that the loss is felt
    slow = found(ball(speed=0.75), 5e-5)
    assert slow / 0.75 > found(ball(), 5e-5) / SPEED  # slower impacts lose less


def test_without_loss_it_is_elastic():
    assert found(ball(loss=None), 2.5e-5) == pytest.approx(SPEED, rel=4e-3)
    assert found(ball(loss=0.0), 1e-4) == found(ball(loss=None), 1e-4)


def test_the_gradient_is_that_of_the_closed_form():
    step = 1e-5
    exact = (leaves(LOSS + step) - leaves(LOSS - step)) / (2.0 * step)
    scene = ball()
    solver = sb.Solver(h=5e-5, method="implicit", integrator="bdf2")
    rollout = sb.rollout(scene, [0.0, 0.06, 0.08], solver)
    bar = np.zeros_like(rollout.positions)
    bar[1, 0, 2], bar[2, 0, 2] = -50.0, 50.0
    gradient = rollout.gradient(bar).quantities["table_contact_dissipation"]
    assert gradient == pytest.approx(exact, rel=5e-3)


def test_gradients_of_a_body_that_tumbles_agree_with_complex_steps():
    scene = sb.Scene("toss")
    sides = (0.1, 0.08, 0.12)
    start = {"at": (0.0, 0.0, 0.14), "velocity": (0.8, 0.1, -1.0), "spin": (2.0, -3.0, 1.0)}
    box = scene.add_body("box", of=sb.Inertia.box(0.3, sides), **start)
    points = sb.box_corners(sides)
    scene.add_contact(box, sb.Plane(name="table"), friction=0.2, stiffness=8e3, dissipation=0.8, points=points)
    checked = sb.check_gradients(scene, [0.0, 0.05, 0.1], sb.Solver(h=1e-3, method="implicit"))
    assert checked.passed, checked
    row = next(r for r in checked.rows if r.name == "table_contact_dissipation")
    assert row.gradient > 0.0 and row.complex_step < 1e-8


def test_dissipation_is_fitted_inside_its_interval():
    times = np.arange(0.0, 0.3, 1 / 200)
    solver = sb.Solver(h=5e-4, method="implicit")
    clean = sb.simulate(ball(gravity=9.81), times, solver).positions
    noisy = clean + 1e-4 * np.random.default_rng(1).standard_normal(clean.shape)
    recording = sb.Recording(positions=noisy[:, :1], times=times, name="ball")
    scene = ball(loss=0.3, gravity=9.81)
    fit = sb.fit(
        scene,
        recording,
        ["table_contact_dissipation", "table_contact_stiffness"],
        markers=[sb.on_particle(0)],
        solver=solver,
        sigma=1e-4,
        refine=None,
    )
    for found_one, truth in zip(fit.result.estimates, (LOSS, STIFFNESS), strict=True):
        assert found_one.verdict == "identified", fit.report()
        assert found_one.lower < truth < found_one.upper


def test_a_file_keeps_it(tmp_path):
    scene = ball()
    sb.save_scene(scene, tmp_path / "ball.npz")
    again = sb.load_scene(tmp_path / "ball.npz")
    assert again.quantities["table_contact_dissipation"].value == LOSS
    assert found(again, 1e-3) == found(ball(), 1e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"dissipation": -0.1}, "must be a number, not negative"),
        ({"dissipation": np.nan}, "must be a number, not negative"),
        ({"dissipation": "much"}, "must be a number, not negative"),
        ({"stiffness": None}, "give a stiffness"),
        ({"restitution": 0.5}, "leave out the dissipation"),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(sb.SceneError, match=words) as error:
        ball(**given) if "dissipation" not in given else ball(loss=given["dissipation"])
    assert error.value.field == "table.contact.dissipation"
