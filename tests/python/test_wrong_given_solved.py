"""Wrong given numbers of motions whose start, or whose driven markers, the fit solves for on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.draft import drafts
from sheetbend.doubts.tangents import tangents
from sheetbend.doubts.told import told_numbers
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from test_misread import AT, SIGMA, SOLVER, TRUE, rope, wrong_and_identified
from test_missing_loss import shaken

TIMES = np.arange(15, 76) / 100  # a recording that begins in the middle of a fall
LOSSES = {"drag_linear": 0.005, "bend_damping": 0.003}


def middle(model: sb.Scene, seed: int = 0) -> sb.Experiment:
    """The rope of `rope` from the middle of its fall on; the scene starts level and at rest."""
    x = sb.simulate(rope(), TIMES, SOLVER).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(seed).standard_normal(x.shape)
    recording, places = sb.Recording(positions=x, times=TIMES, name="fall"), [sb.on_particle(i) for i in AT]
    return sb.Experiment(
        scene=model, recording=recording, markers=places, solver=SOLVER, sigma=SIGMA, start="estimated"
    )


def fitted(e: sb.Experiment, *names: str) -> sb.FitResult:
    return sb.fit(e, parameters=names or tuple(TRUE), profiles=False, refine=False, beginnings=False).result


CASES: dict[str, tuple[Callable[[], sb.Scene], str]] = {
    "gravity": (lambda: rope((-0.1712, 0.0, -9.8085)), "gravity were turned by 1 degrees toward x"),
    "clamp": (
        lambda: rope(clamp_start=(1, 0, 0.0175)),
        "the clamps and everything attached to them were turned by 1 degrees about y",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_wrong_number_beside_an_estimated_start_is_named(case: str) -> None:
    """EI was "identified" without a word, 7 and 3 half-widths off."""
    make, words = CASES[case]
    result = fitted(middle(make()))
    assert any(words in w for w in result.warnings), result.warnings
    EI = result["rope_EI"]
    assert EI.verdict == "doubtful" and EI.half_width is not None
    assert abs(EI.value - TRUE["rope_EI"]) > 2 * EI.half_width
    assert wrong_and_identified(result) == []


def test_a_missing_drag_beside_an_estimated_start_is_named() -> None:
    """What a little of it changes is known from the motion that starts where the fit found it."""
    result = fitted(middle(rope(drag_linear=None)), "rope_EI", "rope_bend_damping")
    assert any("it had a drag_linear of 0." in w for w in result.warnings), result.warnings


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_right_model_beside_an_estimated_start_has_no_warning(seed: int) -> None:
    result = fitted(middle(rope(), seed))
    assert result.warnings == () and wrong_and_identified(result) == []


def test_told_numbers_change_the_motion_that_starts_where_the_fit_found_it() -> None:
    """With the forces of a draft, the start was sought once more, from the scene's: over a long motion such a search
    ends elsewhere, and all told numbers changed that other motion."""
    e = replace(middle(rope()), fit=(0.15, 0.25))
    problem = FitProblem([e], as_parameters(list(TRUE), [e]))
    u = problem.parameters.initial()
    told, why = told_numbers(problem, u)
    assert not why
    blown, moves = drafts(problem, u, 0)
    assert moves and blown.experiments[0].start == "settled"
    assert (blown.experiments[0].scene.positions == problem.experiment_at(0, u).scene.positions).all()
    (size,) = [one.column for one in told if one.label == "size of gravity"]
    plain = tangents(problem, u, 0, {"gravity": e.scene.gravity})[:, 0]
    assert np.abs(size - plain).max() < 1e-6 * np.abs(plain).max()


def test_a_wrong_length_under_a_corrected_hand_is_named() -> None:
    """What corrections of the hand could take up of it is no evidence of it; the rest is."""
    right = shaken(LOSSES, **LOSSES)
    assert fitted(right, "rope_EI").warnings == ()
    x = right.recording.positions.copy()
    x[:, 1:] = x[:, :1] + 1.01 * (x[:, 1:] - x[:, :1])
    result = fitted(replace(right, recording=replace(right.recording, positions=x)), "rope_EI")
    assert any("rope_length were" in w and "% more" in w for w in result.warnings), result.warnings
