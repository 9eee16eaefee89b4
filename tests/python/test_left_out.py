"""Estimates without one part of the data, from the last Jacobian."""

from __future__ import annotations

import numpy as np
from pytest import approx
from sheetbend.statistics.blocks import Split, contradiction
from sheetbend.statistics.covariance import covariance
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.left_out import left_out
from sheetbend.statistics.linearized import Linearized
from test_blocks import fitted
from test_identifiability import errors

WINDOWS, FRAMES = 4, 200
LAYOUT = Layout(
    np.repeat(np.arange(WINDOWS), FRAMES), np.zeros(WINDOWS * FRAMES, dtype=int), np.tile(np.arange(FRAMES), WINDOWS)
)
SPLIT = Split(LAYOUT.recording, ("a", "b", "c", "d"))
WITHIN = [(slice(k * FRAMES, (k + 1) * FRAMES), [2 + k]) for k in range(WINDOWS)]


def losses(windows: int = WINDOWS) -> np.ndarray:
    """Friction and drag of a swing that shrinks from window to window. Each window shows nearly one combination of
    them; each has a start of its own."""
    t = np.linspace(0.0, 1.0, FRAMES)
    slow, wave = t * np.sin(20 * t), t**2 * np.sin(20 * t)
    columns = np.zeros((windows * FRAMES, 2 + windows))
    for k, size in enumerate(np.linspace(1.0, 0.7, windows)):
        mine = slice(k * FRAMES, (k + 1) * FRAMES)
        columns[mine, 0] = slow / size
        columns[mine, 1] = slow * size + 0.02 * wave
        columns[mine, 2 + k] = np.cos(20 * t)
    return columns


def test_the_step_is_that_of_the_other_rows() -> None:
    J = losses()
    r = fitted(J, errors(np.random.default_rng(1), 0.8, 1, WINDOWS * FRAMES, 0.0).ravel())
    for found in left_out(Linearized(r, J, LAYOUT, WITHIN), SPLIT):
        rest = LAYOUT.recording != "abcd".index(found.name)
        used = np.flatnonzero(J[rest].any(axis=0))
        assert found.step == approx(-np.linalg.lstsq(J[rest][:, used], r[rest], rcond=None)[0][found.column], rel=1e-6)
        spread = covariance(r[rest], J[rest][:, used], LAYOUT.of(rest))
        assert found.reach == approx(1.96 * np.sqrt(spread.matrix[found.column, found.column]), rel=0.5)


def test_a_part_that_decides_what_it_hardly_tells_is_found() -> None:
    """The last window has lost a little more than the model's law: by itself it tells neither loss."""
    rng, J = np.random.default_rng(2), losses()
    last = LAYOUT.recording == WINDOWS - 1
    r = fitted(J, 0.01 * errors(rng, 0.5, 1, WINDOWS * FRAMES, 0.0).ravel() - 0.05 * J[:, 0] * last)
    found = contradiction(Linearized(r, J, LAYOUT, WITHIN), [SPLIT])
    assert found is not None and found.split is SPLIT
    spread = covariance(r, J, LAYOUT)
    friction = left_out(Linearized(r, J, LAYOUT, WITHIN), found.split)[0]
    assert friction.name == "d"
    assert friction.reach < 0.1 * min(d.reaches[0] for d in found.differences if d.column == 0)
    assert abs(friction.step) > max(friction.reach, 1.96 * np.sqrt(spread.matrix[0, 0]))


def test_what_the_rest_leaves_open_is_left_out() -> None:
    """Only the first window shows the second parameter."""
    J = losses()
    J[FRAMES:, 1] = 0.0
    r = fitted(J, errors(np.random.default_rng(3), 0.0, 1, WINDOWS * FRAMES, 0.0).ravel())
    each = left_out(Linearized(r, J, LAYOUT, WITHIN), SPLIT)
    assert {(found.column, found.name == "a") for found in each} >= {(1, False)}


def test_windows_of_a_right_model_that_hardly_tell_two_losses_apart_agree() -> None:
    """Once 7 of 20 of them contradicted each other at a level of 1 %."""
    J, contradicted = losses(), 0
    for seed in range(20):
        r = fitted(J, errors(np.random.default_rng(seed), 0.0, 1, WINDOWS * FRAMES, 0.0).ravel())
        contradicted += contradiction(Linearized(r, J, LAYOUT, WITHIN), [SPLIT]) is not None
    assert contradicted <= 1
