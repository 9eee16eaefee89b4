"""A rope that falls on a table from many heights: the mean of the gradient over a window of heights is the slope of the
loss over it (`experiments/rope_on_table/heights.py`)."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments" / "rope_on_table"))
import heights


@cache
def measured(integrator: str, damping: float) -> tuple[heights.Array, float]:
    """By how much the mean gradient of each window is off its slope, as a share, and the largest jump of the loss
    [mm^2]: what the mean of both gradients does not explain between one height and the next."""
    solver = sb.Solver(h=1e-3, method="implicit", integrator=integrator)
    losses, slopes = np.array([heights.loss_and_slope(z, solver, damping) for z in heights.HEIGHTS]).T
    steps = np.diff(losses) - 0.5 * (slopes[1:] + slopes[:-1]) * np.diff(heights.HEIGHTS)
    return np.array([own / between - 1.0 for between, own in heights.windows(losses, slopes)]), 1e6 * np.abs(
        steps
    ).max()


@pytest.mark.parametrize(("integrator", "damping"), [("bdf1", 0.0), ("bdf2", heights.DAMPED)])
def test_the_mean_gradient_is_the_slope_of_the_loss(integrator: str, damping: float):
    off, jump = measured(integrator, damping)
    assert np.abs(off).max() < 0.02
    assert jump < 0.5


def test_jumps_of_bdf2_come_from_vibrations_that_nothing_damps():
    """Substeps of 1 ms are too long for them: the links' highest frequency times the substep is 5."""
    assert measured("bdf2", 0.0)[1] > 10.0 * measured("bdf2", heights.DAMPED)[1]
