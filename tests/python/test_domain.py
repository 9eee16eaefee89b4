"""No way of giving numbers lets a stiffness, a mass or a length be negative, and nothing that is given is ignored."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.quantities.parameters import Parameter

SOLVER = sb.Solver(h=1 / 400)
TIMES = np.array([0.0, 0.01, 0.02])


@pytest.fixture(scope="module")
def rope() -> sb.Scene:
    options = {"EA": 100.0, "stretch_damping": 1e-3, "bend_damping": 0.01, "drag_linear": 0.01}
    return sb.rope(0.5, 5, density=0.05, EI=1e-3, **options)


@pytest.fixture(scope="module")
def rod() -> sb.Scene:
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0))
    modes = {"softness_modes": (0, 1), "density_modes": (1,)}
    return sb.rod(0.5, 6, density=0.05, EI=1e-3, GJ=1e-3, EA=100.0, start=start, **modes)


@pytest.fixture(scope="module")
def cloth() -> sb.Scene:
    scene = sb.Scene("cloth")
    mesh = sb.mesh.grid(0.2, 0.2, 3, 3)
    made = sb.add_cloth(scene, mesh, density=0.1, warp=100.0, weft=80.0, shear=30.0, bending=1e-4)
    scene.pin(made.particles[mesh.sets["top"]])
    return scene


# --- values, without torch


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["rope_EI", "rope_EA", "rope_density", "rope_length", "rope_bend_damping"])
def test_values_are_refused_by_name(rope: sb.Scene, name: str, value: float) -> None:
    with pytest.raises(sb.SceneError, match=rf"values\.{name}: must be"):
        sb.simulate(rope, TIMES, SOLVER, values={name: value})


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("rope_EI", "makes the compliance of constraint 0 of group 'rope_bend' not finite"),
        ("rope_length", "makes the mass of particle 1 zero"),
        ("rope_density", "makes the mass of particle 1 zero"),
    ],
)
def test_a_zero_is_refused_by_what_it_makes(rope: sb.Scene, name: str, problem: str) -> None:
    with pytest.raises(sb.SceneError, match=rf"values\.{name}: {problem}"):
        sb.simulate(rope, TIMES, SOLVER, values={name: 0.0})


def test_a_mode_that_makes_a_mass_negative_is_named(rod: sb.Scene) -> None:
    with pytest.raises(sb.SceneError, match=r"values\.rod_density_1: makes the mass of particle \d+ negative .*-1\.5"):
        sb.simulate(rod, TIMES, SOLVER, values={"rod_density_1": -1.5})


@pytest.mark.parametrize("value", [-1.5, 2.0, -8.0])
def test_softness_keeps_every_stiffness_positive(rod: sb.Scene, value: float) -> None:
    compiled = rod.compiled
    offset, _ = compiled.layout["compliance"]
    group, first, _ = rod.group("rod_bend")
    own = slice(offset + first, offset + first + len(group.particles))
    plain = compiled.inputs()[own]
    soft = compiled.inputs(compiled.values({"rod_softness_1": value, "rod_softness_0": 0.1}))[own]
    s = np.arange(len(plain)) / 6
    assert soft == pytest.approx(plain * np.exp(0.1 + value * np.cos(np.pi * s)), rel=1e-14)
    assert (soft > 0).all() and np.isfinite(
        sb.simulate(rod, TIMES, SOLVER, values={"rod_softness_1": value}).positions
    ).all()


def test_softness_has_exact_derivatives(rod: sb.Scene) -> None:
    report = sb.check_gradients(rod, TIMES, SOLVER, values={"rod_softness_0": -0.7, "rod_softness_1": 0.9})
    rows = {row.name: row for row in report.rows}
    assert rows["rod_softness_0"].passed and rows["rod_softness_1"].passed, str(report)
    assert rows["rod_softness_1"].gradient > 0


def test_poisson_stays_between_its_limits(cloth: sb.Scene) -> None:
    with pytest.raises(sb.SceneError, match=r"values\.cloth_poisson: must be between -1 and 1"):
        sb.simulate(cloth, TIMES, SOLVER, values={"cloth_poisson": 1.5})
    with pytest.raises(sb.SceneError, match="'coupling' of constraint 0 of group 'cloth_membrane' outside its range"):
        sb.simulate(cloth, TIMES, SOLVER, values={"cloth_poisson": 1.0})


def test_what_starts_at_zero_stays_above_it() -> None:
    scene = sb.rope(0.5, 5, density=0.05, EI=1e-3, drag_linear=0.0)
    with pytest.raises(sb.SceneError, match=r"values\.rope_drag_linear: must be zero or more"):
        sb.simulate(scene, TIMES, SOLVER, values={"rope_drag_linear": -0.1})
    assert scene.quantities["rope_drag_linear"].limits == (0.0, math.inf)


# --- fits


def recording(scene: sb.Scene) -> sb.Recording:
    run = sb.simulate(scene, np.arange(0, 11) / 100, SOLVER)
    nodes = next(iter(scene.ropes.values())).particles
    markers = [f"m{i}" for i in range(len(nodes))]
    return sb.Recording(times=run.times, positions=run.positions[:, nodes], markers=markers, name="r")


def test_a_fit_refuses_such_a_start(rod: sb.Scene) -> None:
    wanted = {"rod_density_1": {"initial": -1.5}}
    with pytest.raises(sb.SceneError, match=r"values\.rod_density_1: makes the mass of particle \d+ negative"):
        sb.fit(rod, recording(rod), wanted, solver=SOLVER)
    with pytest.raises(sb.SceneError, match=r"values\.rod_EI: must be a positive number"):
        sb.fit(rod, recording(rod), [Parameter(name="rod_EI", initial=-1e-3)], solver=SOLVER)


def test_a_fit_does_not_step_there(rod: sb.Scene) -> None:
    from sheetbend.experiment.wanted import as_parameters
    from sheetbend.problem.problem import FitProblem

    e = sb.Experiment(scene=rod, recording=recording(rod), solver=SOLVER)
    problem = FitProblem([e], as_parameters(["rod_density_1"], [e]))
    assert problem.evaluate(np.array([0.5]))[0]
    assert not problem.evaluate(np.array([-1.5]))[0]
    assert "mass: entry" in problem.core.failure
    with pytest.raises(sb.InputError, match="mass: entry"):
        problem.simulate(np.array([-1.5]))
