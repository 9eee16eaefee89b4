"""Parts of the data that ask for different parameters: found where a model lacks something, and by chance as rarely as
promised."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.doubts.contradictions import splits
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.blocks import Split, contradiction
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.linearized import Linearized
from test_identifiability import design, errors

FRAMES, CHANNELS = 100, 4
LAYOUT = Layout(
    np.zeros(FRAMES * CHANNELS, dtype=int), np.repeat(np.arange(CHANNELS), FRAMES), np.tile(np.arange(FRAMES), CHANNELS)
)
HALVES = Split(LAYOUT.frame * 2 // FRAMES, ("early", "late"))
SPLITS = [HALVES, Split(LAYOUT.channel // 2, ("near", "far"))]


def jacobian() -> np.ndarray:
    return np.concatenate([design(FRAMES) * (1 + 0.3 * np.sin(np.arange(4) + k)) for k in range(CHANNELS)])


def fitted(J: np.ndarray, error: np.ndarray) -> np.ndarray:
    return error - J @ (np.linalg.pinv(J) @ error)


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_a_right_model_is_contradicted_as_rarely_as_promised(correlation: float) -> None:
    """One in a hundred; of 100 draws at most four, which a rate of 1 % passes in 99.7 % of all cases."""
    rng, J = np.random.default_rng(1), jacobian()
    draws = [fitted(J, errors(rng, correlation, CHANNELS, FRAMES, 0.0).ravel()) for _ in range(100)]
    assert sum(contradiction(Linearized(r, J, LAYOUT), SPLITS) is not None for r in draws) <= 4


def test_parts_that_differ_are_told_with_what_each_asks_for() -> None:
    """The second parameter is 1 in the first half and 3 in the second; the fit, with residuals y - model, is at 2."""
    rng, J = np.random.default_rng(2), jacobian()
    truth = np.where(HALVES.part == 0, 1.0, 3.0) * J[:, 1]
    r = fitted(J, errors(rng, 0.5, CHANNELS, FRAMES, 0.0).ravel() * 0.1 - truth)  # a residual is model - measured
    middle = np.linalg.pinv(J) @ truth
    found = contradiction(Linearized(r, J, LAYOUT), SPLITS)
    assert found is not None and found.chance < 1e-6
    second = found.differences[1]
    asked = sorted(middle[1] + np.array(second.steps))
    assert second.name in ("early", "late") and asked == approx([1.0, 3.0], abs=0.15)
    assert max(second.reaches) < 0.3 and second.reach < 0.4


def test_parameters_of_single_recordings_are_solved_for_and_not_compared() -> None:
    """Two recordings of one series each, with offsets of their own; then with a shared number that differs."""
    rng, t = np.random.default_rng(3), np.linspace(0, 1, 120)
    layout = Layout(np.repeat([0, 1], 120), np.zeros(240, dtype=int), np.tile(np.arange(120), 2))
    shared = np.tile(np.sin(9 * t), 2)
    J = np.column_stack([shared, np.repeat([1.0, 0.0], 120), np.repeat([0.0, 1.0], 120)])
    within = [(slice(0, 120), [1]), (slice(120, 240), [2])]
    recordings = [Split(layout.recording, ("a", "b"))]
    r = fitted(J, 0.1 * rng.standard_normal(240))
    assert contradiction(Linearized(r, J, layout, within), recordings) is None
    r = fitted(J, 0.1 * rng.standard_normal(240) - np.where(layout.recording == 0, 0.5, 1.5) * shared)
    found = contradiction(Linearized(r, J, layout, within), recordings)
    assert found is not None and [d.column for d in found.differences] == [0]
    assert sorted(found.differences[0].steps) == approx([-0.5, 0.5], abs=0.05)


def test_known_errors_of_the_residuals_are_no_contradiction() -> None:
    """What the residuals change on a finer mesh acts in one part only."""
    rng, J = np.random.default_rng(4), jacobian()
    shift = np.where(HALVES.part == 0, 0.0, 1.0) * J[:, 1] * np.linspace(1, 2, len(J))
    r = fitted(J, 0.1 * errors(rng, 0.0, CHANNELS, FRAMES, 0.0).ravel() + shift)
    assert contradiction(Linearized(r, J, LAYOUT), SPLITS) is not None
    assert contradiction(Linearized(r, J, LAYOUT, shifts=shift[:, None]), SPLITS) is None


def test_rows_of_no_part_do_not_make_parts_differ() -> None:
    """Both halves of a motion ask for 0.5, the first clearly; a static experiment beside them knows 0. Were the halves'
    mean held at 0, the second would seem to ask for -0.5."""
    rng, half = np.random.default_rng(5), 200
    layout = Layout(np.repeat([0, 1], [2 * half, 50]), np.zeros(450, dtype=int), np.r_[np.arange(400), np.arange(50)])
    motion = rng.standard_normal((2 * half, 2)) * np.repeat([[1.0, 1.0], [1.0, 0.5]], half, axis=0)
    J = np.vstack([motion, 50.0 * rng.standard_normal((50, 2))])
    asked = np.r_[motion[:, 1] * 0.5, np.zeros(50)] + 0.1 * rng.standard_normal(450)
    halves = Split(np.repeat([0, 1, -1], [half, half, 50]), ("early", "late"))
    assert contradiction(Linearized(fitted(J, -asked), J, layout), [halves]) is None
    asked[half : 2 * half] -= motion[half:, 1]  # now the second half does
    found = contradiction(Linearized(fitted(J, -asked), J, layout), [halves])
    assert found is not None and sorted(found.differences[1].steps) == approx([-0.5, 0.5], abs=0.1)


def test_a_prior_is_no_part_of_the_data() -> None:
    """Parts agree about what data tell; the prior pulls the parameter off all of them."""
    rng, J = np.random.default_rng(5), np.ones((200, 1))
    r = fitted(J, 0.1 * rng.standard_normal(200)) + 0.5
    rows = np.vstack([J, [[1e3]]])
    split = [Split(np.arange(200) // 100, ("early", "late"))]
    found = contradiction(Linearized(np.append(r, -0.1), rows, Layout.series(200)), split)
    assert found is None


def hanging(damping: float, EI: float = 2e-3, drag: float = 5e-3) -> sb.Scene:
    return sb.rope(0.5, 8, density=0.05, EI=EI, bend_damping=damping, drag_linear=drag, clamp_start=(1, 0, 0))


def recorded(model: sb.Scene, seed: int = 0) -> sb.Experiment:
    """A rope that falls and comes to rest, with a wind drag that grows as the square of its speed."""
    solver, times, at = sb.Solver(h=1 / 400), np.arange(151) / 100, [2, 4, 6, 8]
    true = sb.rope(0.5, 8, density=0.05, EI=2e-3, bend_damping=0.01, drag_quadratic=0.02, clamp_start=(1, 0, 0))
    clean = sb.simulate(true, times, solver).positions[:, at]
    noisy = clean + 3e-4 * np.random.default_rng(seed).standard_normal(clean.shape)
    recording = sb.Recording(positions=noisy, times=times, name="fall")
    places = [sb.on_particle(i) for i in at]
    return sb.Experiment(scene=model, recording=recording, markers=places, solver=solver, sigma=3e-4)


def test_a_loss_of_another_kind_is_found_by_its_parts() -> None:
    """Drag that is fitted as linear where it is quadratic: fast and slow parts of the motion ask for different ones."""
    found = sb.fit(recorded(hanging(0.01)), parameters=["rope_EI", "rope_drag_linear"], refine=False)
    drag = found["rope_drag_linear"]
    assert drag.verdict == "doubtful" and "parts of the data contradict each other" in drag.words
    assert "from the rest (to first order)" in drag.words
    right = sb.rope(0.5, 8, density=0.05, EI=2e-3, bend_damping=0.01, drag_quadratic=0.03, clamp_start=(1, 0, 0))
    sound = sb.fit(recorded(right), parameters=["rope_EI", "rope_drag_quadratic"], refine=False)
    assert {e.verdict for e in sound.result.estimates} == {"identified"}


def test_splits_are_by_time_and_by_place() -> None:
    e = recorded(hanging(0.01))
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    _, _, J = problem.evaluate(problem.parameters.initial())
    made = splits(problem, J)
    assert [split.names[0] for split in made] == [
        "the first half of the time",
        "the first third of the time",
        "the first quarter of the time",
        "one side's markers",
    ]
    layout = problem.rows_layout()
    for split, parts in zip(made, (2, 3, 4, 2), strict=True):
        assert sorted(set(split.part.tolist())) == list(range(parts))
    assert (made[0].part == (layout.frame > 75)).all()
    sides = {m: set(made[3].part[layout.channel // 3 == m].tolist()) for m in range(4)}
    assert all(len(side) == 1 for side in sides.values()) and sides[0] != sides[3]
