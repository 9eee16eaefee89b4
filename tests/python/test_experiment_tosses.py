"""A tossed cube: gravity from four free flights, a prediction of the others, and where tosses come to rest."""

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


def test_tosses_come_to_rest_as_predicted() -> None:
    from landings import AUTHORS, errors, scene_of, tosses, without_physics

    every = tosses()
    assert len(every) == 63
    group = every[1:16:2]
    fitted = AUTHORS | {"table_restitution": 0.232, "hollow": 0.614, "stretch": 0.00124}  # expected/landings.txt
    found = np.array([errors(toss, fitted, scene_of(toss, toss.free)) for toss in group])
    assert found[:, 0].mean() < 14.0  # mm
    assert found[:, 1].mean() < 26.0
    assert found[:, 0].mean() < 0.1 * np.mean([without_physics(toss)[1, 0] for toss in group])
