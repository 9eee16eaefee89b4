"""What a motion about a fixed axis tells of the ten numbers of a body, in the words of the report."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.quantities.expression import numbers, rotation
from sheetbend.statistics.body_numbers import ten_numbers


def test_numbers_of_a_body_are_those_of_its_points() -> None:
    rng = np.random.default_rng(4)
    x, m = rng.normal(size=(30, 3)), rng.uniform(0.1, 1.0, 30)
    center = m @ x / m.sum()
    about = np.einsum("n,nab->ab", m, np.eye(3) * (x**2).sum(1)[:, None, None] - x[:, :, None] * x[:, None, :])
    inertia = sb.Inertia(m.sum(), about - m.sum() * (np.eye(3) * (center @ center) - np.outer(center, center)), center)
    moments, principal = inertia.principal()
    turn = rng.normal(size=3)
    back = np.linalg.inv(
        numbers(rotation("abc"), dict(zip("abc", turn, strict=True)))
    )  # undone by the turn of the axes
    found = ten_numbers(np.concatenate([[m.sum()], center, moments, turn]), back @ principal)
    assert found == pytest.approx([m.sum(), *(m @ x), *np.diag(about), *about[[0, 0, 1], [1, 2, 2]]], rel=1e-12)


@pytest.mark.parametrize(
    ("torque", "known"),
    [
        (
            {"torque": ([0.0, 0.3, 0.6, 1.0], [0.02, -0.05, 0.04, 0.0]), "rotor": 1e-4},
            "only {0}, {1} and {2} are known",
        ),
        ({}, "only the ratios between {0}, {1} and {2} are known"),
    ],
)
def test_about_a_fixed_axis_its_inertia_and_two_first_moments_are_known(torque: dict, known: str) -> None:
    """With a known torque themselves, by weight alone their ratios, whichever of the ten numbers are fitted."""
    scene = sb.Scene("axis")
    load = scene.add_body("load", mass=0.4, inertia=(1.1e-3, 1.6e-3, 2.0e-3), center=(0.05, 0.01, 0.03))
    sb.hinge(None, load, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), rate=1.0, **torque)
    points = np.array([[0.1, 0.02, 0.0], [0.0, -0.02, 0.1], [-0.05, 0.0, 0.05]])
    times, solver = np.arange(51) * 0.02, sb.Solver(h=2e-3)
    origin, frame = load.pose(sb.simulate(scene, times, solver))
    x = origin[:, None] + np.einsum("tab,kb->tka", frame, points)
    noise = np.random.default_rng(0).normal(0.0, 2e-4, x.shape)
    recording = sb.Recording(x + noise, times, markers=["a", "b", "c"])
    vectors = [f"load_{what}_{a}" for what in ("center", "axes_turn") for a in "xyz"]
    names = ["load_mass", *vectors, *(f"load_inertia_{k}" for k in (1, 2, 3)), "hinge_angle", "hinge_rate"]
    given = {"markers": sb.on_body(load, points), "solver": solver, "sigma": 2e-4}
    fit = sb.fit(scene, recording, names, **given, refine=None, profiles=False)
    first = ("load_mass * load_center_x", "load_mass * load_center_z", "the moment of inertia of load about y")
    (words,) = fit.result.gauges
    assert words.startswith(known.format(*first)), words
    for name in ("load_mass", "load_center_x", "load_center_z", "load_inertia_2"):
        assert fit[name].verdict == "not identifiable" and words in fit[name].words
    assert fit["load_inertia_1"].verdict == fit["load_center_y"].verdict == "not identifiable"
