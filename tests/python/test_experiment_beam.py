"""The silicone beam of experiments/beam: what is fitted, and what is predicted of frames that the fit did not see."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load
from sheetbend.fit import Fit
from sheetbend.prediction import Comparison
from sheetbend.result import RecordingFit

BEAM = Path(__file__).resolve().parents[2] / "experiments" / "beam" / "beam.toml"
SECOND_MOMENT = 0.03**4 / 12  # of the section, m^4


@pytest.fixture(scope="module")
def fit() -> Fit:
    study = load(BEAM)
    return sb.fit(study.experiments, parameters=study.parameters)


def row(fit: Fit, name: str) -> RecordingFit:
    return next(r for r in fit.result.recordings if r.name == name)


def about_rest(c: Comparison, frames: np.ndarray) -> float:
    """Error over the measured motion about its rest, the mean of the recording's last second."""
    rest = c.experiment.recording.positions[-100:, list(c.experiment.compared)].mean(axis=0)
    error, motion = c.rms(frames), c.rms(frames, np.broadcast_to(rest, c.recording.positions.shape))
    assert error is not None
    assert motion
    return error / motion


def test_stiffness_is_in_the_published_range(fit: Fit) -> None:
    assert fit.result.converged
    assert fit["beam_EI"].verdict == "identified"
    assert 250e3 <= fit["beam_EI"].value / SECOND_MOMENT <= 300e3
    assert fit.result.seconds < 10.0


def test_next_second_of_the_bare_beam(fit: Fit) -> None:
    fall = next(c for c in fit.comparisons if c.experiment.name == "fall")
    assert fall.held_out.sum() == 100
    assert about_rest(fall, fall.held_out) <= 0.25
    assert row(fit, "fall").held_out <= 0.25 * row(fit, "fall").motion


def test_first_second_of_the_loaded_beam(fit: Fit) -> None:
    loaded = next(c for c in fit.comparisons if c.experiment.name == "loaded")
    assert about_rest(loaded, loaded.recording.times < loaded.recording.times[0] + 0.995) <= 0.35
    assert row(fit, "loaded").held_out <= 0.35 * row(fit, "loaded").motion


def test_first_frequency_of_the_loaded_beam(fit: Fit) -> None:
    """Measured: 4.34 Hz (fit of a damped sinusoid to the same recording)."""
    loaded = row(fit, "loaded")
    assert loaded.measured_frequency == pytest.approx(4.34, rel=0.01)
    assert loaded.simulated_frequency == pytest.approx(loaded.measured_frequency, rel=0.04)


def test_nothing_of_the_material_is_fitted_to_the_loaded_run(fit: Fit) -> None:
    own = [given.name for given in fit.result.given if "[loaded]" in given.name]
    assert own == ["pull_z[loaded]"]
