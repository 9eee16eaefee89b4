"""Losses that a free swing does not tell apart: the combination that it shows; and air that is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.losses import air_doubts, loss_sum
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.result.estimate import Estimate

TRUE = {"strip_bend_damping": 4e-3, "strip_drag_linear": 0.16}
LENGTH, CLAMP, NOISE = 0.4, 0.4 / 12, 2e-3  # m


def swing(noise: float, scale: float = 1.0, seed: int = 1) -> sb.Experiment:
    """A stiff strip without weight, clamped at one end and let go from near its first mode, which loses as much to its
    own damping as to the air; both losses are started off by a factor."""
    mesh = sb.mesh.grid(LENGTH, 0.13, 6, 2, pattern="one_way")
    held = mesh.within([-1, -1, -1], [0.07, 1, 1])  # two rows: a clamp in the middle of them
    share = np.maximum(mesh.vertices[:, 0] - CLAMP, 0.0) / (LENGTH - CLAMP)
    bent = mesh.vertices + np.outer(0.01 * share**2 * (3 - share), [0.0, 0.0, 1.0])
    bent[held] = mesh.vertices[held]
    values = {name.removeprefix("strip_"): scale * value for name, value in TRUE.items()}
    scene = sb.Scene("strip", gravity=(0, 0, 0))
    made = sb.add_cloth(
        scene, mesh, "strip", density=0.2, warp=2000, shear=500, bending=0.05, held=held, positions=bent, **values
    )
    scene.pin(made.particles[held])
    times = np.arange(40) / 30
    solver = sb.Solver(h=1 / 60, method="newton")
    true = sb.simulate(scene, times, solver, dict(TRUE)).positions
    free = [v for v in range(len(mesh.vertices)) if v not in held]
    x = true[:, free] + noise * np.random.default_rng(seed).standard_normal((len(times), len(free), 3))
    places = [sb.on_particle(int(made.particles[v])) for v in free]
    return sb.Experiment(scene=scene, recording=sb.Recording(x, times), markers=places, solver=solver, sigma=noise)


def test_a_swing_shows_the_sum_of_its_losses() -> None:
    e = swing(NOISE, 1.5)
    found = sb.fit(e, parameters=list(TRUE), refine=False, profiles=False)
    assert all(found[name].verdict != "identified" for name in TRUE)
    (words,) = [w for w in found.result.warnings if w.startswith("losses:")]
    assert "does not separate strip_bend_damping and strip_drag_linear." in words and "hysteresis" in words
    # The sum is right where neither of the two is.
    problem = FitProblem([e], as_parameters(list(TRUE), [e]))
    known = loss_sum(problem, problem.parameters.to_internal(found.values), list(TRUE))
    assert known is not None
    true = sum(w * TRUE[n] for w, n in zip(known.weights, known.names, strict=True))
    assert abs(known.value / true - 1) < known.half_width < 0.1
    assert all(abs(found[name].value / TRUE[name] - 1) > 0.5 for name in TRUE)
    # By hand: a mode of rate w loses by w^2 tau/2 and by c/(2 density), so c counts 1/(w^2 density) against tau.
    rate = 3.516 * np.sqrt(0.05 / 0.2) / (LENGTH - CLAMP) ** 2
    assert known.weights[1] == pytest.approx(1 / (rate**2 * 0.2), rel=0.1)
    assert f"= {known.value:.3g} s" in words


def test_a_loss_beside_known_ones_is_not_added() -> None:
    found = sb.fit(swing(NOISE / 4, seed=3), parameters=["strip_bend_damping"], refine=False, profiles=False)
    assert found["strip_bend_damping"].verdict == "identified"
    assert not [w for w in found.result.warnings if w.startswith("losses:")]


def test_air_of_too_much_density_is_doubted() -> None:
    air = Estimate(
        name="cloth_air_normal",
        value=4.0,
        unit="kg/m^3",
        lower=3.0,
        upper=5.0,
        half_width=1.0,
        statistical=1.0,
        discretization=0.0,
        verdict="weak",
        words="",
    )
    (words,) = air_doubts([air])
    assert "at least 3 kg/m^3, but air has 1.2" in words
    assert list(air_doubts([replace(air, value=1.0, lower=0.8, upper=1.2)])) == []
    assert list(air_doubts([replace(air, lower=0.9)])) == []  # the interval holds what air may have
    assert len(list(air_doubts([replace(air, name="cloth_air_normal[a]")]))) == 1
    cloth = replace(air, name="cloth_drag_quadratic", unit="N s^2/m^4")
    assert len(list(air_doubts([cloth, replace(cloth, unit="N s^2/m^3")]))) == 1
