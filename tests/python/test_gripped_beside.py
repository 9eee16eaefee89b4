"""Markers beside the rope: their offsets are found, and predictions start from the rope's axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sheetbend.gripped import GrippedMotion, RopeReport, fit_rope
from sheetbend.gripped.beside import beside, frames_of, offsets_found
from sheetbend.gripped.climb import Climb
from sheetbend.gripped.judging import predict
from sheetbend.gripped.ladder import BESIDE, TWIST
from sheetbend.gripped.offsets import offset_reach
from sheetbend.gripped.pieces import experiments_of, problem_of
from sheetbend.gripped.search import Search
from sheetbend.gripped.steps import Rope
from sheetbend.report.scores import coordinate_error
from test_gripped_motion import carried_about, model_of

MOTION = GrippedMotion.of(carried_about(), 0.08)
MODEL = model_of(MOTION)
RANDOM = np.random.default_rng(1)
OFFSETS = tuple((float(a), float(b)) for a, b in 3e-3 * RANDOM.standard_normal((len(MOTION.free), 2)))


def recorded(offsets: tuple[tuple[float, float], ...], seed: int, name: str = "seen") -> GrippedMotion:
    """A recording of the model, with markers beside the rope and noise of 0.3 mm."""
    (x,) = predict(MODEL, [MOTION], {})
    x[:, list(MOTION.free)] += beside(MODEL, MOTION, {}, offsets)
    x += 3e-4 * np.random.default_rng(seed).standard_normal(x.shape)
    return GrippedMotion.of(replace(MOTION.recording, positions=x, name=name), 0.08)


def found_in(motion: GrippedMotion) -> tuple[tuple[float, float], ...]:
    found = offsets_found([motion], predict(MODEL, [motion], {}), [frames_of(MODEL, motion, {})])
    assert found is not None
    return found


def test_offsets_are_found_and_predictions_start_from_the_axis() -> None:
    seen, unseen = recorded(OFFSETS, 0), recorded(OFFSETS, 1)
    found = found_in(seen)
    assert np.abs(np.subtract(found, OFFSETS)).mean() < 0.25 * np.abs(OFFSETS).mean()
    bare, better = (predict(replace(MODEL, beside=o), [unseen], {})[0] for o in ((), found))
    error, less = (coordinate_error(unseen.recording, x) for x in (bare, better))
    assert less < 0.4 * error
    gripped = [k for k in range(bare.shape[1]) if k not in unseen.free]
    np.testing.assert_array_equal(better[:, gripped], bare[:, gripped])


def test_a_prediction_sees_no_more_with_offsets_than_without() -> None:
    seen = recorded(OFFSETS, 0)
    later = seen.recording.positions.copy()
    later[40:, list(seen.free)] += 0.05  # past the frames that a start is smoothed over
    other = GrippedMotion.of(replace(seen.recording, positions=later), 0.08)
    other = replace(other, fractions=seen.fractions, length=seen.length)
    model = replace(MODEL, beside=OFFSETS)
    free = list(seen.free)
    np.testing.assert_array_equal(predict(model, [seen], {})[0][:, free], predict(model, [other], {})[0][:, free])


def test_a_motion_that_diverges_has_no_offsets() -> None:
    (x,) = predict(MODEL, [MOTION], {})
    assert offsets_found([MOTION], [x * np.nan], [frames_of(MODEL, MOTION, {})]) is None


def test_intervals_count_offsets_that_were_found_as_if_they_were_not() -> None:
    seen = recorded(OFFSETS, 0)
    moved = seen.moved(-beside(MODEL, seen, {}, OFFSETS))
    wanted = [p for p in TWIST.parameters if p.name == "rope_EI"]
    reaches = []
    for motion, offsets in ((seen, ()), (moved, OFFSETS), (moved, ())):
        problem = problem_of(experiments_of(MODEL, [motion], (1.0, 1.0), {}), wanted, {"rope_EI": 0.02})
        reaches.append(offset_reach(problem, problem.parameters.initial(), offsets)["rope_EI"])
    known, again, forgotten = reaches
    assert again == pytest.approx(known, rel=0.3)
    assert forgotten < 0.5 * known


def climb_of(motions: list[GrippedMotion]) -> Climb:
    climb = Climb(Search(motions, 0.25, ((0.5, 1.0), (1.0, 3.0)), 1, lambda text: None))
    parameters = tuple(p for p in TWIST.parameters if p.name == "rope_EI")
    climb.rope = climb.search.judged(Rope(MODEL, parameters, {"rope_EI": 0.02}))
    return climb


def test_the_rung_stays_where_markers_sit_beside_the_rope() -> None:
    climb = climb_of([recorded(OFFSETS, k, f"{k}") for k in range(4)])
    before = climb.search.split
    assert climb._climbed(BESIDE)
    assert np.abs(np.subtract(climb.beside, OFFSETS)).mean() < 0.3 * np.abs(OFFSETS).mean()
    assert len(climb.search.whole) == 4 and climb.search.split is not before
    once = climb.beside
    climb._climbed(BESIDE)  # little is left; it adds to what was found
    assert np.abs(np.subtract(climb.beside, once)).max() < 5e-4


def test_recordings_stay_as_they_are_where_the_rung_does_not_help(monkeypatch: pytest.MonkeyPatch) -> None:
    motions = [recorded(OFFSETS, k, f"{k}") for k in range(4)]
    climb = climb_of(motions)
    before = climb.search.split
    monkeypatch.setattr(Search, "judged", lambda self, rope: climb.rope)  # no better
    assert not climb._climbed(BESIDE)
    assert climb.beside == () and climb.search.split is before and climb.search.whole == motions


def test_a_fit_predicts_with_its_offsets_and_reports_them() -> None:
    motions, unseen = [recorded(OFFSETS, k, f"{k}") for k in range(4)], recorded(OFFSETS, 9)
    twist = replace(TWIST, parameters=tuple(p for p in TWIST.parameters if p.name in ("rope_EI", "rope_length")))
    spans = ((0.5, 1.0), (1.0, 3.0))
    found = fit_rope(
        motions, density=0.06, ladder=(twist, BESIDE), bending_lengths=(0.3,), windows=spans, max_segments=12
    )
    assert np.abs(np.subtract(found.model.beside, OFFSETS)).mean() < 0.3 * np.abs(OFFSETS).mean()
    (bare,) = predict(replace(found.model, beside=()), [unseen], found.values)
    error, less = (coordinate_error(unseen.recording, x) for x in (bare, found.predict(unseen)))
    assert less < 0.6 * error
    report = RopeReport("arch", found)
    assert report.to_dict()["markers_beside"] == [list(pair) for pair in found.model.beside]
    assert "Markers beside the rope" in report.plain()
