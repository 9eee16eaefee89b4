"""A wire that was fitted to a shape at rest in which it would not stay."""

import tomllib
from pathlib import Path

import sheetbend as sb
from sheetbend import config
from sheetbend.doubts.unstable import unstable_rests
from sheetbend.minimum.problem import FitProblem, as_parameters

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


def test_a_shape_in_which_a_wire_would_not_stay_is_named() -> None:
    """On its way to its minimum the fit of three shapes came by both; the solver leaves the second shape, in which the
    energy falls in one direction, five times and comes back each time."""
    experiments = black().experiments
    problem = FitProblem(experiments, as_parameters([*STAYS], experiments))
    at = {name: problem.parameters.to_internal(values) for name, values in (("stays", STAYS), ("leaves", LEAVES))}
    assert unstable_rests(problem, at["stays"]) == {}
    found = unstable_rests(problem, at["leaves"])
    assert set(found) == set(STAYS) and "its energy falls in one direction" in found["black_EI"]


def test_what_such_a_shape_tells_is_doubtful() -> None:
    """With all else as that shape has it, EI was "identified"."""
    near = {"black_EI": {"initial": LEAVES["black_EI"], "prior": [LEAVES["black_EI"], 2e-3]}}
    held = {name: {"fixed": True, "initial": value} for name, value in LEAVES.items() if name != "black_EI"}
    EI = sb.fit(black().experiments, parameters=near | held, profiles=False, refine=False)["black_EI"]
    assert EI.verdict == "doubtful" and "is unstable" in EI.words, EI
