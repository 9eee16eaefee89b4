"""A rope that rests when a recording begins tells by its balance what had slid inside it before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped import slid as slid_before
from sheetbend.gripped.judging import predict
from sheetbend.gripped.rest import SEEN, creep, rests
from sheetbend.gripped.slid import MODES, noise
from sheetbend.motion.simulate import simulate
from sheetbend.report.scores import coordinate_error
from test_gripped_motion import GRIP, LENGTH, arch, model_of, simulated

NOISE = 3e-4  # m
STILL, MOVED = 4.0, 1.0  # s: grips that stand still, between which the rope comes to rest, and that move
FIRST = round(100 * STILL) - 10  # frame at which the recording begins
MODEL_VALUES = {"EI": 0.05, "yield_curvature": 1.5, "yield_share": 0.5, "drag_linear": 0.3}
HISTORY = {"rope_slid_1_0": 2.0, "rope_slid_2_1": 2.5}  # 1/m, before it comes to rest


def whole() -> GrippedMotion:
    """Of the free markers only the first shape counts."""
    times = np.arange(round(100 * (STILL + MOVED)) + 1) / 100.0
    u = np.clip((times - STILL) / MOVED, 0.0, 1.0)
    pace = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    shares = np.concatenate([[-GRIP / LENGTH], np.linspace(0.0, 1.0, 10), [1.0 + GRIP / LENGTH]])
    positions = np.repeat(arch(shares)[None], len(times), axis=0)
    positions[:, -2:] += pace[:, None, None] * np.array([0.1, 0.0, 0.15])
    return GrippedMotion.of(sb.Recording(positions, times, clamped=(0, 1, 10, 11), name="rests"), 0.08)


WHOLE = whole()
MODEL = model_of(WHOLE).with_values(**MODEL_VALUES)


def recorded(seed: int = 0) -> GrippedMotion:
    """What is recorded of the model's motion once it rests; what had slid by then is in it."""
    e = replace(MODEL, slid_modes=MODES).experiment(WHOLE)
    times, positions = e.recording.times, simulated(e, WHOLE, HISTORY)
    positions += NOISE * np.random.default_rng(seed).standard_normal(positions.shape)
    part = replace(e.recording, positions=positions[FIRST:], times=times[FIRST:] - times[FIRST])
    return GrippedMotion.of(part, 0.08)


def frames(first: int) -> np.ndarray:
    return np.arange(first, first + 9)


def test_a_rope_at_rest_is_told_from_one_that_moves() -> None:
    motion = recorded()
    size = noise(motion.recording.positions)
    assert size == pytest.approx(NOISE, rel=0.1)
    assert rests(motion, frames(0), size)
    assert not any(rests(motion, frames(first), size) for first in range(30, 90, 5))


@pytest.mark.parametrize(("first", "resting"), [(2, True), (0, False)])
def test_markers_that_are_not_seen_at_first(first: int, resting: bool) -> None:
    """Seen in some of the first frames they have a place at rest; otherwise the motion must do."""
    motion = recorded()
    gone = motion.recording.positions.copy()
    gone[first:9, [3, 4, 6, 7]] = np.nan
    part = GrippedMotion.of(replace(motion.recording, positions=gone), 0.08)
    assert rests(part, frames(0), NOISE) == resting
    (x,) = predict(MODEL, [part], {})
    assert coordinate_error(motion.recording, x) < 1.5e-3


def test_a_rope_that_turns_back_does_not_rest() -> None:
    """At the turning point of a swing nothing moves, but it is about to."""
    motion = recorded()
    swung = motion.recording.positions + 0.5 * 2.0 * (motion.recording.times[:, None, None] - 0.04) ** 2
    assert not rests(replace(motion, recording=replace(motion.recording, positions=swung)), frames(0), NOISE)


def test_its_balance_tells_more_than_how_it_begins_to_move(monkeypatch: pytest.MonkeyPatch) -> None:
    motions = [recorded(seed) for seed in range(3)]

    def error() -> float:
        predicted = predict(MODEL, [replace(m) for m in motions], {})  # new ones: what had slid is known of the old
        return float(np.mean([coordinate_error(m.recording, x) for m, x in zip(motions, predicted, strict=True)]))

    balanced = error()
    monkeypatch.setattr(slid_before, "rests", lambda *given: False)
    moving = error()
    monkeypatch.setattr(slid_before, "slid", lambda *given: {})
    assert balanced < 0.9 * moving
    assert balanced < 0.55 * error()  # without a history


def test_with_what_had_slid_it_stays_where_it_is() -> None:
    motion = recorded()
    model = replace(MODEL, slid_modes=MODES)
    e = creep(model, motion, frames(0), NOISE)
    times = np.array([0.0, float(e.recording.times[-1])])

    def crept(history: dict[str, float]) -> float:
        first, last = simulate(e.scene, times, e.solver, history).positions
        return float(np.abs(last - first).max())

    assert crept(slid_before.slid(model, motion, 0.0, {})) < 0.3 * crept({})


def test_only_its_end_is_compared() -> None:
    motion = recorded()
    e = creep(MODEL, motion, frames(0), NOISE)
    assert len(e.fitted().times) == SEEN
    assert np.ptp(e.recording.positions, axis=0).max() == 0.0
    np.testing.assert_allclose(e.recording.positions[0], motion.recording.positions[:9].mean(axis=0))
