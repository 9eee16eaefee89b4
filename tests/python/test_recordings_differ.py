"""Many recordings that ask for different values: each is compared with the others, and so is their scatter."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.contradictions import MOST_RECORDINGS, splits
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.blocks import Contradiction, Split, contradiction
from sheetbend.statistics.covariance import covariance
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.left_out import left_out
from sheetbend.statistics.linearized import Linearized
from test_blocks import fitted
from test_identifiability import errors
from test_left_out import FRAMES, losses
from test_many_recordings import swings

WINDOWS = 12
ROWS = WINDOWS * FRAMES
LAYOUT = Layout(np.repeat(np.arange(WINDOWS), FRAMES), np.zeros(ROWS, dtype=int), np.tile(np.arange(FRAMES), WINDOWS))
SPLIT = Split(LAYOUT.recording, tuple(f"window {k}" for k in range(WINDOWS)), apart=True)
WITHIN = [(slice(k * FRAMES, (k + 1) * FRAMES), [2 + k]) for k in range(WINDOWS)]
WANTED = {
    "rope_EI": {"initial": 1e-3},
    "rope_drag_linear": {"initial": 0.01},
    "rope_bend_damping": {"private": True, "prior": (0.01, 0.5)},
}


def noise(seed: int, correlation: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.concatenate([errors(rng, correlation, 1, FRAMES, 0.0).ravel() for _ in range(WINDOWS)])


def compared(r: np.ndarray, J: np.ndarray) -> Contradiction | None:
    return contradiction(Linearized(r, J, LAYOUT, WITHIN), [SPLIT])


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_windows_of_a_right_model_hardly_ever_differ(correlation: float) -> None:
    """One in a hundred; of 30 draws at most two, which a rate of 1 % passes in 99.7 % of all cases."""
    J = losses(WINDOWS)
    assert sum(compared(fitted(J, noise(seed, correlation)), J) is not None for seed in range(30)) <= 2


def test_random_errors_of_all_windows_are_seen_in_their_scatter() -> None:
    """Friction of each window has an error of its own. No window alone moves an estimate out of its interval in half of
    the draws in which the interval is wrong."""
    J, wrong, by_one = losses(WINDOWS), 0, 0
    for seed in range(12):
        own = 0.02 * np.random.default_rng(1000 + seed).standard_normal(WINDOWS)
        error = 0.01 * noise(seed, 0.5) - own[LAYOUT.recording] * J[:, 0]
        r = fitted(J, error)
        found = compared(r, J)
        assert found is not None
        off, spread = np.abs(np.linalg.pinv(J) @ error)[:2], covariance(r, J, LAYOUT)
        reach = 1.96 * np.sqrt(np.diag(spread.matrix)[:2])
        for without in left_out(Linearized(r, J, LAYOUT, WITHIN), SPLIT):
            column = without.column
            if off[column] > reach[column]:
                wrong, by_one = wrong + 1, by_one + (abs(without.step) > max(reach[column], without.reach))
                assert without.surely > reach[column]
            assert off[column] < 1.5 * without.scatter
    assert wrong > 5 and by_one < 0.7 * wrong


def test_scatter_of_white_noise_is_the_interval() -> None:
    """Of one column in parts of the same size."""
    rng, parts, rows = np.random.default_rng(4), 40, 50
    J = np.tile(rng.standard_normal((rows, 1)), (parts, 1))
    split = Split(np.repeat(np.arange(parts), rows), tuple(map(str, range(parts))), apart=True)
    layout = Layout(split.part, np.zeros(parts * rows, dtype=int), np.tile(np.arange(rows), parts))
    r = fitted(J, rng.standard_normal(parts * rows))
    (found,) = left_out(Linearized(r, J, layout), split)
    alone = np.array([-np.linalg.lstsq(J[split.part == k], r[split.part == k], rcond=None)[0][0] for k in range(parts)])
    assert found.scatter == pytest.approx(2.0227 * np.std(alone, ddof=1) / np.sqrt(parts), rel=1e-3)  # t of 39
    assert found.surely == pytest.approx(found.scatter * 1.96 / 2.0227 * np.sqrt(39 / 54.572), rel=1e-3)  # chi square
    assert found.scatter == pytest.approx(1.96 / np.linalg.norm(J), rel=0.3)


def test_more_recordings_than_are_compared_go_in_groups_of_neighbors() -> None:
    es = swings(0.0, 30)
    problem = FitProblem(list(es), as_parameters(WANTED, es))
    _, _, J = problem.evaluate(problem.parameters.initial())
    (split,) = [s for s in splits(problem, J[: problem.core.data_rows]) if s.apart]
    assert len(split.names) == MOST_RECORDINGS and split.names[0] == "the group of swing 0 to swing 1"
    assert [name for name in split.names if " to " not in name]
    groups = {i: set(split.part[problem.rows_layout().recording == i].tolist()) for i in range(30)}
    assert all(len(mine) == 1 for mine in groups.values())
    assert sorted(set(split.part.tolist())) == list(range(MOST_RECORDINGS))


def test_recordings_too_short_to_be_compared_alone_are_compared_in_groups() -> None:
    """A rope at rest has three rows, and two parameters take 16 of each part."""
    scene = sb.rope(0.5, 4, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
    x = sb.equilibrium(scene).positions[[4]][None]
    each = [
        sb.Experiment(
            scene=scene,
            recording=sb.Recording(positions=x, times=[0.0], name=f"rest {k}"),
            markers=[sb.on_particle(4)],
            static=True,
            sigma=1e-3,
        )
        for k in range(16)
    ]
    problem = FitProblem(each, as_parameters(["rope_EI", "rope_length"], each))
    _, _, J = problem.evaluate(problem.parameters.initial())
    (split,) = [s for s in splits(problem, J) if s.apart]
    assert len(split.names) == 2 and np.bincount(split.part).min() == 24


def test_twelve_ropes_of_two_kinds_are_no_single_rope() -> None:
    """Every other one is 1.35 times as stiff: the halves of the recordings agree, and EI was "identified"."""
    for differ, verdict in ((0.15, "doubtful"), (0.0, "identified")):
        EI = sb.fit(list(swings(differ, 12)), parameters=WANTED, refine=False, profiles=False)["rope_EI"]
        assert EI.verdict == verdict, EI.words
