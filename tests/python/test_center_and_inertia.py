"""What no recording of a pendulum tells: its center of mass beside its moment of inertia. The report says so."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

TIMES = np.arange(151) / 100
MASS, CENTER, INERTIA, VISCOSITY = 0.4, 0.2, 4e-3, 3e-3
SOLVER = sb.Solver(h=1 / 400)
POINTS = np.array([[0.02, 0.0, -0.1], [-0.02, 0, -0.2], [0.01, 0, -0.3], [0, 0.02, -0.35]])


def pendulum(center: float, inertia: float, viscosity: float) -> tuple[sb.Scene, sb.Body]:
    scene = sb.Scene("pendulum")
    body = scene.add_body("bar", mass=MASS, inertia=[4e-3, inertia, 4e-3], center=(0, 0, -center))
    sb.hinge(None, body, at=(0, 0, 0), axis=(0, -1, 0), rate=0.0, viscosity=viscosity)
    return scene, body


def seen(center: float, inertia: float, viscosity: float, angle: float) -> np.ndarray:
    """Markers over time, in a swing from an angle."""
    scene, body = pendulum(center, inertia, viscosity)
    origin, frame = body.pose(sb.simulate(scene, TIMES, SOLVER, {"hinge_angle": angle}))
    return origin[:, None] + np.einsum("fab,kb->fka", frame, POINTS)


@pytest.mark.parametrize("angle", [0.1, 0.6, 2.5])
@pytest.mark.parametrize("off", [-0.005, 0.02])
def test_another_center_with_its_own_inertia_swings_alike(angle: float, off: float) -> None:
    """(I + m d^2)/(m g d) and viscosity/(m g d) are all that enters: a center 5 mm off, with an inertia 8 % off, moves
    every marker to the same place in every swing, also in those that were not fitted."""
    ratio = (CENTER + off) / CENTER
    inertia = (INERTIA + MASS * CENTER**2) * ratio - MASS * (CENTER + off) ** 2
    there = seen(CENTER + off, inertia, VISCOSITY * ratio, angle)
    assert abs(inertia / INERTIA - 1) > 0.05
    here = seen(CENTER, INERTIA, VISCOSITY, angle)
    assert np.ptp(here, axis=0).max() > 0.05
    assert np.abs(there - here).max() < 1e-8  # of 0.3 mm of noise nothing


def test_the_report_says_what_a_millimeter_of_the_center_moves() -> None:
    """The fitted inertia is 8 % off, "identified", at residuals of noise."""
    scene, body = pendulum(CENTER, 5e-3, 2e-3)
    x = seen(CENTER - 0.005, INERTIA, VISCOSITY, 0.6)
    x += 3e-4 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(x, TIMES, name="swing")
    e = sb.Experiment(scene=scene, recording=recording, markers=sb.on_body(body, POINTS), solver=SOLVER, sigma=3e-4)
    free = {"hinge_viscosity": {}, "hinge_angle": {"initial": 0.55}, "bar_inertia_2": {}}
    found = sb.fit(e, parameters=free, refine=False, profiles=False)
    inertia = found.result["bar_inertia_2"]
    off = abs(inertia.value - INERTIA)
    assert off > 50 * inertia.half_width and found.result.misfit.reduced_chi_square < 1.1
    (row,) = [line for line in found.report().splitlines() if "bar_center_z" in line and " 1 mm " in line]
    per_mm = float(row.split("%")[-2].split()[-1]) / 100 * inertia.value  # the last column
    assert 5 * abs(per_mm) == pytest.approx(off, rel=0.15)
    assert abs(per_mm) < inertia.in_all < off  # counts 1 mm of it
