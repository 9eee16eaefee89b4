"""Leave-one-out prediction of recordings that hold nothing out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx

SIGMA = 1e-4


def hanging() -> sb.Scene:
    """A wire that leaves its clamp at an angle and hangs."""
    scene = sb.Scene("wire")
    clamp = {"clamp_start": (1, 0, 0), "clamp_angles": True, "plane": (0, 1, 0)}
    sb.add_rope(scene, length=0.3, segments=20, density=0.02, EI=1e-4, **clamp)
    return scene.freeze()


def experiments(angles: list[float]) -> list[sb.Experiment]:
    rng = np.random.default_rng(1)
    found = []
    for i, angle in enumerate(angles):
        scene = hanging()
        rest = sb.equilibrium(scene, values={"rope_start_angle": angle}).positions[scene.ropes["rope"].particles]
        recording = sb.Recording(rest[None] + SIGMA * rng.standard_normal(rest[None].shape), [0.0], name=f"hang_{i}")
        found.append(sb.Experiment(scene=scene, recording=recording, static=True, sigma=SIGMA, axes="xz"))
    return found


PARAMETERS = {"rope_EI": {"initial": 2e-4}, "rope_start_angle": {"private": True}}


def test_every_recording_is_predicted_by_the_others() -> None:
    angles = [0.1, 0.1, 0.1]
    found = sb.fit(experiments(angles), parameters=PARAMETERS, leave_one_out=True).result
    for row in found.recordings:
        assert row.held_out == approx(np.sqrt(2) * SIGMA, rel=0.5)
        assert row.baseline == approx(np.sqrt(2 * 1.5) * SIGMA, rel=0.5)
    assert "others" in found.held_out_is and "held out: every recording" in found.report()


def test_an_outlier_is_not_hidden_by_its_own_fit() -> None:
    """The mean of the others' private angles misses it, although its own fit does not."""
    found = sb.fit(experiments([0.1, 0.1, 0.3]), parameters=PARAMETERS, leave_one_out=True).result
    odd = found.recordings[2]
    assert odd.rms < 2 * SIGMA
    assert odd.held_out > 50 * SIGMA
    assert odd.baseline > 50 * SIGMA


def test_it_equals_the_fit_to_the_others() -> None:
    every = experiments([0.05, 0.1, 0.2])
    row = sb.fit(every, parameters=PARAMETERS, leave_one_out=True).result.recordings[0]
    first = replace(every[0], predict="mean")
    apart = sb.fit([*every[1:], first], parameters=PARAMETERS).result.recordings[-1]
    assert row.held_out == approx(apart.held_out, rel=1e-3)
    assert row.baseline == approx(apart.baseline, rel=1e-12)


def test_a_single_recording_is_refused() -> None:
    with pytest.raises(sb.InputError, match="leave_one_out"):
        sb.fit(experiments([0.1]), parameters=PARAMETERS, leave_one_out=True)
