"""Whether rest shapes that differ from recording to recording are seen in residuals, and only they."""

from __future__ import annotations

import numpy as np
from sheetbend.gripped.own_rest import differing

WINDOWS, FRAMES, ROWS, MODES, SIGMA = 12, 200, 20, 4, 5e-3


def parts(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Slow residuals (windows, frames, rows) and derivatives (..., modes) that change over time, and where they are."""
    rng = np.random.default_rng(seed)
    waves = np.cumsum(rng.standard_normal((WINDOWS, FRAMES, ROWS)), axis=1) / 20.0
    slow = waves - waves.mean(axis=1, keepdims=True)
    turns = np.cumsum(rng.standard_normal((WINDOWS, FRAMES, 1, 1)), axis=1) / 15.0
    J = rng.standard_normal((1, 1, ROWS, MODES)) + 0.5 * np.sin(turns) * rng.standard_normal((1, 1, ROWS, MODES))
    window, frame, _ = np.indices(slow.shape)
    return slow, J, window.ravel(), frame.ravel(), rng.standard_normal((WINDOWS, MODES))


def test_rest_shapes_of_their_own_are_seen() -> None:
    slow, J, window, frame, own = parts(1)
    changed = np.einsum("wfrm,wm->wfr", J, 0.3 * own)
    found = differing((0.3 * slow + changed).ravel(), J.reshape(-1, MODES), window, frame, SIGMA)
    assert found is not None and found.better == found.count == WINDOWS
    apart = changed - np.einsum("wfrm,m->wfr", J, 0.3 * own.mean(axis=0))
    true = SIGMA * np.sqrt(np.mean(apart[:, FRAMES // 2 :] ** 2))
    assert 0.5 * true < found.moves < true  # drawn to zero
    assert "differ from recording to recording" in found.words


def test_what_is_left_for_other_reasons_is_none() -> None:
    """Slow residuals, and a change of the rest shape that all windows share: the fit has not ended, but they agree."""
    for seed in range(2, 12):
        slow, J, window, frame, own = parts(seed)
        shared = np.einsum("wfrm,m->wfr", J, 0.1 * own[0])
        assert differing((slow + shared).ravel(), J.reshape(-1, MODES), window, frame, SIGMA) is None
