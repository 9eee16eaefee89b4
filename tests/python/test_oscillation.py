"""First frequencies against motions whose frequency is known."""

from __future__ import annotations

import numpy as np
import pytest
from sheetbend.recording.oscillation import along, dominant_direction, first_frequency

TIMES = np.arange(100) / 100.0


@pytest.mark.parametrize("frequency", [3.2, 4.34, 7.74, 15.0])
@pytest.mark.parametrize("decay", [0.0, 1.5])
@pytest.mark.parametrize("phase", np.linspace(0.0, 3.0, 4))
def test_decaying_oscillations_that_creep(frequency: float, decay: float, phase: float) -> None:
    series = np.exp(-decay * TIMES) * np.cos(2 * np.pi * frequency * TIMES + phase) + 0.3 * TIMES + 2.0
    assert first_frequency(TIMES, series) == pytest.approx(frequency, rel=5e-3)


def test_steps_need_not_be_equal() -> None:
    times = TIMES + 0.002 * np.sin(40.0 * TIMES)
    assert first_frequency(times, np.cos(2 * np.pi * 5.0 * times)) == pytest.approx(5.0, rel=5e-3)


def test_no_frequency_where_too_little_is_seen() -> None:
    assert first_frequency(TIMES, np.cos(2 * np.pi * 1.5 * TIMES)) is None
    assert first_frequency(TIMES, np.ones(100)) is None
    assert first_frequency(TIMES[:6], TIMES[:6]) is None


def test_dominant_direction_is_where_the_markers_move_together() -> None:
    swing = np.cos(2 * np.pi * 5.0 * TIMES)
    positions = np.zeros((100, 2, 3))
    positions[:, 0, 2], positions[:, 1, 0] = 3.0 * swing, 4.0 * swing
    positions[:, 1, 1] = 1e-3 * TIMES
    positions[10:12, 0] = np.nan
    direction = dominant_direction(positions)
    assert abs(direction[0, 2]) == pytest.approx(0.6, abs=0.01)
    assert abs(direction[1, 0]) == pytest.approx(0.8, abs=0.01)
    assert first_frequency(TIMES, along(positions, direction)) == pytest.approx(5.0, rel=5e-3)
