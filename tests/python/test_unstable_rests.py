"""A wire that was fitted to a shape at rest in which it would not stay."""

import tomllib
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend import config
from sheetbend.doubts.unstable import unstable_rests
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "wires"
MODES = ("black_set_1", "black_set_2", "black_set_3", "black_set_4")
STAYS = dict(zip(MODES, (-3.1932, -2.4297, -0.2886, 1.4726), strict=True)) | {
    "black_EI": 1.468e-3,
    "black_start_angle": 0.0314,
    "black_end_angle": -0.0785,
}
LEAVES = dict(zip(MODES, (-8.5266, -6.8286, 2.0555, 2.2578), strict=True)) | {
    "black_EI": 2.3518e-3,
    "black_start_angle": 0.1467,
    "black_end_angle": -0.0886,
}


def black() -> config.Study:
    """The first shape of the black wire, on 100 links and with four modes of a shape without load."""
    described = tomllib.loads((FOLDER / "wires.toml").read_text())
    rope = next(rope for rope in described["scene"]["rope"] if rope["name"] == "black")
    rope |= {"segments": 100, "set_modes": [1, 2, 3, 4]}
    (recording,) = (r for r in described["recording"] if r["file"] == "data/black_0.npz")
    kept = {"experiment": described["experiment"], "scene": {"rope": [rope]}, "recording": [recording]}
    return config.build(config.Config.model_validate(kept), FOLDER)


def fitted_shape(EI: float) -> tuple[FitProblem, np.ndarray]:
    """The problem of all parameters, and a point of it: that of LEAVES with another stiffness."""
    experiments = black().experiments
    problem = FitProblem(experiments, as_parameters([*STAYS], experiments))
    return problem, problem.parameters.to_internal(LEAVES | {"black_EI": EI})


def test_the_saddle_of_a_wire_is_left_for_a_stable_shape() -> None:
    """Its energy falls by 1.4e-3 N/m sideways alone: so little that the old search came back to it from 2 cm aside."""
    (e,) = black().experiments
    saddle = sb.equilibrium(e.scene, values=LEAVES, stable=False)
    assert saddle.unstable_modes == 1
    aside = np.zeros_like(saddle.nodes)
    wire = e.scene.ropes["black"].particles
    aside[wire, 1] = 0.02 * np.sin(np.linspace(0.0, np.pi, len(wire)))
    for start in (saddle.nodes, saddle.nodes + aside, saddle.nodes - aside):
        rest, again = (sb.equilibrium(e.scene, start, values=LEAVES) for _ in range(2))
        assert rest.unstable_modes == 0 and rest.energy < saddle.energy - 0.05
        assert np.array_equal(rest.nodes, again.nodes)


def test_a_shape_at_the_edge_of_stability_is_named() -> None:
    """Between two stiffnesses of a strongly set wire the measured shape loses its stability. Just before this edge all
    parameters are doubtful, and well before it none is."""
    problem, stays = fitted_shape(1.2e-3)
    assert unstable_rests(problem, problem.parameters.to_internal(STAYS)) == {}
    near, far = problem.simulate_one(0, stays), problem.simulate_one(0, fitted_shape(2.3518e-3)[1])
    assert np.nanmax(np.abs(far - near)) > 0.1
    low, high = 1.2e-3, 2.3518e-3
    for _ in range(20):
        middle = 0.5 * (low + high)
        leaps = np.nanmax(np.abs(problem.simulate_one(0, fitted_shape(middle)[1]) - near)) > 0.1
        low, high = (low, middle) if leaps else (middle, high)
    found = unstable_rests(problem, fitted_shape(low)[1])
    assert set(found) == set(STAYS) and "would snap to another shape" in found["black_EI"], found
