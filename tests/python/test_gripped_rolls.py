"""Grips that roll as they lean, which no marker shows: found from how the rope between them moves."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.arrays.rotations import rotated
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.descent import descend
from sheetbend.gripped.judging import predict
from sheetbend.gripped.ladder import ROLLS
from sheetbend.gripped.pieces import experiments_of, problem_of
from sheetbend.gripped.rolls import lean
from sheetbend.objects.grip import Grip
from sheetbend.objects.grip_freedom import axes_of
from test_gripped_motion import TIMES, carried_about, model_of

QUATERNIONS = np.stack(
    [0.25 * np.sin(4 * TIMES), 0.25 - 0.25 * np.cos(3 * TIMES), 0.0 * TIMES, 1.0 + 0.0 * TIMES], axis=1
)
QUATERNIONS /= np.linalg.norm(QUATERNIONS, axis=1, keepdims=True)
STILL = carried_about()
LEANING = GrippedMotion.of(
    replace(STILL, positions=np.stack([rotated(QUATERNIONS, x) for x in STILL.positions.swapaxes(0, 1)], axis=1)), 0.0
)
MODEL = model_of(LEANING, smoothing=0.0)
TRUE = {"rope_start_roll_1": 0.4, "rope_end_roll_12": -0.5, "rope_end_roll_2": 0.3}


@dataclass(frozen=True, eq=False)
class Rolled(GrippedMotion):
    """The same motion between grips that roll by what `TRUE` says, built by turning their frames."""

    def grip(self, end: bool, frames: slice, nominal: np.ndarray) -> Grip:
        given = super().grip(end, frames, nominal)
        u, v, _, uv, _ = lean(given.direction, nominal)
        angle = np.arctan(0.3 * v - 0.5 * uv if end else 0.4 * u)[:, None]
        first, second, _ = axes_of(given)
        return replace(given, director=np.cos(angle) * first + np.sin(angle) * second)


ROLLED = Rolled(**{f.name: getattr(LEANING, f.name) for f in fields(GrippedMotion)})


def test_held_frames_are_those_of_grips_that_roll() -> None:
    """Also beside a roll that is built in, which turns the end's frame at all times."""
    roll = {"rope_roll": 1.1}
    free = replace(MODEL, **ROLLS.options)
    (found,), (true,) = predict(free, [LEANING], {**TRUE, **roll}), predict(MODEL, [ROLLED], roll)
    (without,) = predict(MODEL, [LEANING], roll)
    assert np.abs(found - true).max() < 0.02 * np.abs(without - true).max()
    assert np.abs(without - true).max() > 5e-4


def test_a_start_in_mid_motion_is_turned_as_far() -> None:
    """Frames begin with the turn of their grips spread over them: those of the grip's own links agree exactly."""
    late = (float(TIMES[len(TIMES) // 2]), float(TIMES[-1]))
    e = replace(MODEL, **ROLLS.options).experiment(LEANING, late)
    other = MODEL.experiment(ROLLED, late)
    solver = sb.Solver(h=0.5 * float(np.diff(TIMES).min()))
    for values in ({"rope_roll": 0.0}, {"rope_roll": -0.8}):
        x, y = (sb.simulate(d.scene, [0.0], solver, v).nodes[0] for d, v in ((e, {**TRUE, **values}), (other, values)))
        for k in range(1, len(e.scene.ropes["rope"].directors) - 1):
            q, p = (z[d.scene.ropes["rope"].directors[k]] for z, d in ((x, e), (y, other)))
            assert q @ p / np.linalg.norm(q) / np.linalg.norm(p) > np.cos(0.02)


def test_rolls_come_back() -> None:
    (x,) = predict(MODEL, [ROLLED], {})
    motion = replace(LEANING, recording=replace(LEANING.recording, positions=x))
    free = replace(MODEL, **ROLLS.options)
    wanted = [replace(p, prior=None) for p in ROLLS.parameters if p.name in TRUE]
    end = descend(problem_of(experiments_of(free, [motion], (1.0, 1.0), {}), wanted, {}), 20)
    assert end.ended
    for name, value in TRUE.items():
        assert end.values[name] == pytest.approx(value, abs=0.02), name
