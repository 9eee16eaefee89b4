"""Free flights of a tossed cube: gravity from four of them, and a prediction of the others."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments" / "tosses"))


def test_gravity_of_a_few_flights_predicts_the_others_from_their_first_frames() -> None:
    from cube import experiment, flights, parameters
    from tosses import predicted

    every = flights()
    assert len(every) == 61
    group = [experiment(f) for f in every[:6:2]]
    found = sb.fit(group, parameters=parameters(["gravity", "cube_inertia_2", "cube_inertia_3"]), refine=False)
    gravity = found["gravity"]
    assert gravity.value == pytest.approx(9.62, abs=0.06)
    assert found.values["cube_inertia_2"] == pytest.approx(found.values["cube_inertia_3"], rel=0.15)
    assert "cube_inertia_1" in found.report()  # what the ratios rest on
    errors = np.array([predicted(f, gravity.value, 0.02) for f in every[30:45]])
    assert np.median(errors[:, 0]) < 1e-3
    assert np.median(errors[:, 1]) < 0.5
    assert errors[:, 0].max() < 2e-3
    assert errors[:, 1].max() < 2.0
