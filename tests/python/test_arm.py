"""Rigid arms and pendulums against closed forms and a reference integrator, their derivatives, and what no body is."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.integrate import solve_ivp
from sheetbend.objects.arm import add_arm, add_pendulum
from sheetbend.objects.arm_data import Arm
from support import period

G = 9.81
BODY = {"mass": 0.1475, "first_moment": 0.0218, "inertia": 0.00333, "length": 0.2}
LOWER = {"mass": 0.1376, "first_moment": 0.0161, "inertia": 0.00315, "length": 0.25}


def angles(trajectory: sb.Trajectory, arm: Arm) -> np.ndarray:
    """(frames,) rad from straight down towards +x."""
    line = trajectory.positions[:, arm.end] - trajectory.positions[:, arm.pivot]
    return np.unwrap(np.arctan2(line[:, 0], -line[:, 2]))


def masses(scene: sb.Scene) -> np.ndarray:
    return scene.compiled.unpack(scene.compiled.inputs())["mass"]


@pytest.mark.parametrize("angle", [0.0, 1.1, -2.5])
def test_particles_have_the_mass_first_moment_and_inertia(angle: float) -> None:
    scene = sb.Scene("arms")
    upper = add_arm(scene, "upper", **BODY)
    lower = add_arm(scene, "lower", pivot=upper, angle=angle, **LOWER)
    # The lower pivot is the upper end, whose own share of mass is taken out by a scene without the lower arm.
    alone = sb.Scene("alone")
    add_arm(alone, "upper", **BODY)
    shares = masses(scene)
    shares[: len(masses(alone))] -= masses(alone)
    arms = scene.compiled.unpack(scene.compiled.inputs())["position"].reshape(-1, 3) - (0.0, 0.0, -BODY["length"])
    along = arms @ (math.sin(angle), 0.0, -math.cos(angle))
    assert lower.pivot == upper.end
    assert shares.sum() == approx(LOWER["mass"], rel=1e-12)
    assert shares @ along == approx(LOWER["first_moment"], rel=1e-12)
    assert shares @ (arms**2).sum(axis=1) == approx(LOWER["inertia"], rel=1e-12)
    assert shares @ (arms @ (math.cos(angle), 0.0, math.sin(angle))) == approx(0.0, abs=1e-15)
    assert (masses(scene) >= 0.0).all()


def test_small_swings_have_the_period_of_a_compound_pendulum() -> None:
    amplitude, h = 0.02, 5e-4
    scene = sb.Scene("compound")
    arm = add_arm(scene, angle=amplitude, **BODY)
    times = h * np.arange(2000)
    swing = angles(sb.simulate(scene, times, sb.Solver(h=h)), arm)
    expected = 2.0 * math.pi * math.sqrt(BODY["inertia"] / (BODY["first_moment"] * G)) * (1.0 + amplitude**2 / 16.0)
    assert period(times, swing) == approx(expected, rel=1e-5)


def test_an_arm_on_a_fixed_pivot_is_a_point_mass_at_its_reduced_length() -> None:
    mass, moment, inertia = BODY["mass"], BODY["first_moment"], BODY["inertia"]
    times = np.arange(201) * 0.005
    arms, points = sb.Scene("arm"), sb.Scene("point")
    arm = add_arm(arms, angle=1.5, rate=2.0, viscosity=2e-4, **BODY)
    point = add_pendulum(points, length=inertia / moment, mass=moment**2 / inertia, angle=1.5, rate=2.0, viscosity=2e-4)
    solver = sb.Solver(h=0.005 / 16)
    assert angles(sb.simulate(arms, times, solver), arm) == approx(
        angles(sb.simulate(points, times, solver), point), abs=1e-4
    )
    assert moment**2 / inertia < mass


def test_double_pendulum_follows_its_equations() -> None:
    start, viscosity = (1.2, -0.7, 0.5, 3.0), (3e-4, 5e-5)

    def equations(_: float, y: np.ndarray) -> list[float]:
        """Lagrange's equations with the state (angles, rates), viscous at both hinges."""
        a, b, u, v = y
        coupling = LOWER["first_moment"] * BODY["length"]
        inertia = np.array(
            [
                [BODY["inertia"] + LOWER["mass"] * BODY["length"] ** 2, coupling * math.cos(a - b)],
                [coupling * math.cos(a - b), LOWER["inertia"]],
            ]
        )
        between = viscosity[1] * (u - v)
        weight = (BODY["first_moment"] + LOWER["mass"] * BODY["length"]) * G
        upper = -coupling * math.sin(a - b) * v**2 - weight * math.sin(a) - viscosity[0] * u - between
        lower = coupling * math.sin(a - b) * u**2 - LOWER["first_moment"] * G * math.sin(b) + between
        return [u, v, *np.linalg.solve(inertia, [upper, lower])]

    times = np.arange(101) * 0.01
    exact = solve_ivp(equations, (0.0, 1.0), start, t_eval=times, rtol=1e-11, atol=1e-12, method="DOP853").y[:2]
    errors = []
    for h in (1e-3, 5e-4, 2.5e-4):
        scene = sb.Scene("double")
        upper = add_arm(scene, "upper", angle=start[0], rate=start[2], viscosity=viscosity[0], **BODY)
        lower = add_arm(scene, "lower", pivot=upper, angle=start[1], rate=start[3], viscosity=viscosity[1], **LOWER)
        motion = sb.simulate(scene, times, sb.Solver(h=h))
        errors.append(np.abs([angles(motion, upper), angles(motion, lower)] - exact).max())
        assert motion.positions[:, :, 1] == approx(0.0, abs=1e-12)
    assert errors[-1] < 1e-3
    assert math.log2(errors[0] / errors[1]) == approx(2.0, abs=0.4) and math.log2(errors[1] / errors[2]) == approx(
        2.0, abs=0.4
    )


def test_gradients_by_every_quantity() -> None:
    scene = sb.Scene("double")
    upper = add_arm(scene, "upper", angle=0.9, rate=0.5, viscosity=3e-4, **BODY)
    add_arm(scene, "lower", pivot=upper, angle=-0.4, rate=1.0, viscosity=5e-5, **LOWER)
    report = sb.check_gradients(scene, np.arange(6) * 0.01, sb.Solver(h=1.25e-3))
    assert {row.name for row in report.rows} >= {
        f"{name}_{q}" for name in ("upper", "lower") for q in (*BODY, "angle", "rate", "hinge_viscosity")
    }
    assert report.passed, str(report)


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"mass": -1.0}, "mass", "must be positive"),
        ({"mass": math.nan}, "mass", "must be positive"),
        ({"first_moment": 0.0}, "first_moment", "must be positive"),
        ({"inertia": -1e-3}, "inertia", "must be positive"),
        ({"length": 0.0}, "length", "must be positive"),
        ({"inertia": 0.003}, "mass", "is too small"),  # below first_moment^2/mass: no body has it
        ({"length": 0.15}, "length", "leaves the pair a negative mass"),
        ({"pivot": (0.0, 0.0)}, "pivot", "shape"),
    ],
)
def test_impossible_arms_are_refused(change: dict, field: str, words: str) -> None:
    with pytest.raises(sb.SceneError, match=words) as caught:
        add_arm(sb.Scene("bad"), **(BODY | change))
    assert caught.value.field == f"arm.{field}" and caught.value.fix


@pytest.mark.parametrize("change", [{"mass": 0.0}, {"length": -0.1}, {"length": math.inf}])
def test_impossible_pendulums_are_refused(change: dict) -> None:
    with pytest.raises(sb.SceneError, match="must be positive"):
        add_pendulum(sb.Scene("bad"), **({"length": 0.15, "mass": 0.1} | change))
