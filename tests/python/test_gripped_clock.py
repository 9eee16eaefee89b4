"""Grips that are recorded later than the other markers are found, and predictions take them as earlier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion, RopeReport, evaluate, fit_rope
from sheetbend.gripped.climb import Climb
from sheetbend.gripped.clock import lateness
from sheetbend.gripped.judging import predict
from sheetbend.gripped.ladder import CLOCK, TWIST
from sheetbend.gripped.search import Search
from sheetbend.gripped.slips import Slip
from sheetbend.gripped.steps import Rope
from sheetbend.report.scores import coordinate_error
from test_gripped_motion import carried_about, model_of

MOTION = GrippedMotion.of(carried_about(), 0.0)
MODEL = model_of(MOTION, smoothing=0.0)
LATE = 0.012


def recorded(late: float, seed: int = 0, name: str = "seen") -> GrippedMotion:
    """A recording of the model with noise of 0.3 mm, the grips' markers late by so many s."""
    (x,) = predict(MODEL, [MOTION], {})
    gripped = [k for k in range(x.shape[1]) if k not in MOTION.free]
    x[:, gripped] = MOTION.later(-late).positions[:, gripped]
    x += 3e-4 * np.random.default_rng(seed).standard_normal(x.shape)
    return GrippedMotion.of(replace(MOTION.recording, positions=x, name=name), 0.08)


@pytest.mark.parametrize("late", [LATE, -LATE, 0.0])
def test_it_is_found(late: float) -> None:
    found = lateness(replace(MODEL, smoothing=0.08), [recorded(late, k) for k in range(2)], {})
    assert found == pytest.approx(late, abs=1.5e-3)


def test_later_grips_go_on_beyond_the_recording() -> None:
    by, moved = 0.015, MOTION.later(0.015)
    path = MOTION.positions[:, 0]
    np.testing.assert_allclose(moved.positions[:-2, 0], 0.5 * (path[1:-1] + path[2:]), atol=1e-4)
    beyond = path[-1] + by * MOTION.velocities[-1, 0]
    np.testing.assert_allclose(moved.positions[-1, 0], beyond, atol=1e-9)
    free = list(MOTION.free)
    np.testing.assert_array_equal(moved.positions[:, free], MOTION.positions[:, free])
    assert moved.recording is MOTION.recording and MOTION.later(0.0) is MOTION


@pytest.fixture(scope="module")
def unseen() -> GrippedMotion:
    return recorded(LATE, 9, "unseen")


def test_a_fit_predicts_with_earlier_grips_and_says_so(unseen: GrippedMotion, monkeypatch: pytest.MonkeyPatch) -> None:
    """And of a slip in an unseen recording."""
    twist = replace(TWIST, parameters=tuple(p for p in TWIST.parameters if p.name in ("rope_EI", "rope_length")))
    motions = [recorded(LATE, k, f"{k}") for k in range(4)]
    spans = ((0.5, 1.0), (1.0, 3.0))
    found = fit_rope(
        motions, density=0.06, ladder=(twist, CLOCK), bending_lengths=(0.3,), windows=spans, max_segments=12
    )
    assert found.model.late == pytest.approx(LATE, abs=1.5e-3)
    (bare,) = predict(replace(found.model, late=0.0), [unseen], found.values)
    error, less = (coordinate_error(unseen.recording, x) for x in (bare, found.predict(unseen)))
    assert less < 0.5 * error
    assert any("ms after the others" in words for words in found.warnings)
    assert RopeReport("arch", found).to_dict()["grips_late"] == found.model.late
    monkeypatch.setattr(sb.gripped.evaluation, "slips", lambda motion: (Slip(end=True, by=-2e-3, time=0.4),))
    (note,) = evaluate(found, [unseen]).notes
    assert note.startswith("unseen: the rope slips by 2 mm into its end grip about 0.4 s")


def test_ctrl_c_in_the_fit_leaves_the_grips_as_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    """The motions were moved before the fit, and the last fit went on with them as if nothing was late."""

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    climb = Climb(Search([MOTION], 0.0, ((0.5, 1.0),), 1, list[str]().append))
    climb.rope, split = Rope(MODEL, (), {}), climb.search.split
    monkeypatch.setattr("sheetbend.gripped.climb.lateness", lambda *_: LATE)
    monkeypatch.setattr(Climb, "_long", stopped)
    with pytest.raises(KeyboardInterrupt):
        climb._climbed(CLOCK)
    assert climb.search.split is split and climb.late == 0.0 and climb.search.whole == [MOTION]
