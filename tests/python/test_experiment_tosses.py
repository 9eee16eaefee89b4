"""A tossed cube: gravity from four free flights, a prediction of the others, and where tosses come to rest."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments" / "tosses"))


def test_gravity_of_a_few_flights_predicts_the_others_from_their_first_frames() -> None:
    from cube import experiment, flights, parameters, turning
    from tosses import predicted

    every = flights()
    assert len(every) == 61
    rate, half = turning(every[:30])
    assert rate == pytest.approx(turning(every[30:])[0], abs=0.01) and half < 0.004  # rad/s
    group = [experiment(f.steady(rate)) for f in every[:6:2]]
    found = sb.fit(group, parameters=parameters(["gravity", "cube_inertia_2", "cube_inertia_3"]), refine=False)
    gravity = found["gravity"]
    assert gravity.value == pytest.approx(9.62, abs=0.06)
    assert found.values["cube_inertia_2"] == pytest.approx(found.values["cube_inertia_3"], rel=0.15)
    assert "cube_inertia_1" in found.report()  # what the ratios rest on
    errors = np.array([predicted(f, gravity.value, 0.02, (0.0, 0.0, 0.006), rate) for f in every[30:45]])
    assert np.median(errors[:, 0]) < 0.4e-3
    assert np.median(errors[:, 1]) < 0.5
    assert errors[:, 0].max() < 1.6e-3
    assert errors[:, 1].max() < 2.0


def test_tosses_come_to_rest_as_predicted() -> None:
    from landings import FROM, INERTIA, errors, scene_of, tosses, without_physics

    every = tosses()
    assert len(every) == 63
    group = every[1:16:2]
    found = FROM | {"table_friction": 0.180, "table_contact_dissipation": 2.88, "rounding": 3.9e-3, "stretch": 2.4e-3}
    found |= {f"cube_inertia_{axis}": 1.58 * INERTIA for axis in (1, 2, 3)} | {"cube_center_z": 5.8e-3}
    off = np.array([errors(toss, found, scene_of(toss, toss.free)) for toss in group])  # as in expected/landings.txt
    assert off[:, 0].mean() < 10.0  # mm
    assert off[:, 1].mean() < 18.0
    assert off[:, 0].mean() < 0.07 * np.mean([without_physics(toss)[1, 0] for toss in group])
    centered = np.array([errors(toss, found | {"cube_center_z": 0.0}, scene_of(toss, toss.free)) for toss in group])
    assert off[:, 2].mean() < centered[:, 2].mean()  # the attitude tells where the center of mass is


def test_tosses_of_another_folder_are_cut_as_the_shipped_ones(tmp_path: Path) -> None:
    """Each begins two frames later here, in the columns of the source."""
    from landings import tosses

    shipped = tosses()[:3]
    ends = np.cumsum([0] + [len(toss.times) - 2 for toss in shipped])
    turns = np.concatenate([toss.quaternions[2:] for toss in shipped])[:, [3, 0, 1, 2]]
    places = np.concatenate([toss.positions[2:] for toss in shipped])
    columns = {"starts": ends, "toss": np.array([7, 8, 9]), "position": places, "quaternion": turns}
    np.savez(tmp_path / "cube_tosses.npz", **columns)
    for old, new, number in zip(shipped, tosses(tmp_path), (7, 8, 9), strict=True):
        frames = len(new.times)
        assert new.name == f"toss {number}" and 0 <= len(old.times) - 2 - frames <= 3
        assert np.array_equal(new.positions, old.positions[-frames:])
        assert np.array_equal(new.quaternions, old.quaternions[-frames:])
        assert len(old.times) - old.free == frames - new.free  # the same first contact


def test_first_frames_after_contact_tell_that_the_cube_is_hollow(monkeypatch: pytest.MonkeyPatch) -> None:
    """With half as many substeps as the experiment."""
    import landings
    from landings import INERTIA, SOLVER, fitted, tosses

    monkeypatch.setattr(landings, "SOLVER", replace(SOLVER, h=2 * SOLVER.h))
    found = fitted(tosses()[:16:2])
    for axis in (1, 2, 3):
        estimate = found[f"cube_inertia_{axis}"]
        assert 1.3 < estimate.value / INERTIA < 1.9
    assert 0.15 < found.values["table_friction"] < 0.19
    assert 2e-3 < found.values["cube_center_z"] < 10e-3
