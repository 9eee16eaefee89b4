"""Whether a rung stays: by the ratio of each recording's errors, never by a mean that one recording decides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.judging import Errors, Split, errors_of, misfits, predict, verdict
from test_gripped_motion import carried_about, model_of

INF = np.inf
Array = np.ndarray


def errors(judged: Array, fitted: Array | float = 1.0) -> Errors:
    judged = np.asarray(judged, dtype=float)
    return Errors(np.atleast_1d(np.asarray(fitted, dtype=float)), judged[:, None])


class TestVerdict:
    @pytest.mark.parametrize(
        ("fitted", "others", "stays"),
        [(0.9, 0.9, True), (1.0, 0.9, True), (0.9, 0.995, False), (1.01, 0.9, False), (0.9, INF, False)],
        ids=["better", "better on others", "hardly better", "worse where it was fitted", "diverges"],
    )
    def test_it_stays_only_where_it_predicts_others_better(self, fitted: float, others: float, stays: bool) -> None:
        assert verdict(errors([others] * 4, fitted), errors([1.0] * 4)).stays == stays

    def test_one_bad_recording_does_not_veto_what_helps_all_others(self) -> None:
        smaller = np.full(14, 9.4)
        larger = np.full(14, 7.7)
        smaller[3], larger[3] = 1000.0, 8036.0  # the means are 80 and 581
        told = verdict(errors(larger), errors(smaller))
        assert told.stays and told.ratio == pytest.approx(7.7 / 9.4) and (told.better, told.count) == (13, 14)

    def test_nor_does_one_bad_recording_keep_what_helps_no_other(self) -> None:
        smaller, larger = np.full(14, 7.7), np.full(14, 7.9)
        smaller[3], larger[3] = 8036.0, 10.0
        assert not verdict(errors(larger), errors(smaller)).stays

    def test_luck_is_no_reason(self) -> None:
        others = np.array([0.9, 0.9, 0.9, 0.98, 1.2, 1.2, 1.2])  # four of seven
        told = verdict(errors(others), errors(np.ones(7)))
        assert told.ratio == pytest.approx(0.98) and not told.stays
        assert verdict(errors([0.9] * 5 + [1.2] * 2), errors(np.ones(7))).stays
        assert not verdict(errors([0.5]), errors([1.0])).stays  # one piece of one recording

    def test_a_recording_that_diverges_under_both_has_no_voice(self) -> None:
        told = verdict(errors([0.9, 0.9, 0.9, INF]), errors([1.0, 1.0, 1.0, INF]))
        assert told.stays and told.count == 3
        assert verdict(errors([0.9, 0.9, 0.9, 1.0]), errors([1.0, 1.0, 1.0, INF])).better == 4
        assert verdict(errors([0.9, 0.9, 0.9, INF]), errors([1.0] * 4)).better == 3

    def test_what_diverges_everywhere_never_stays(self) -> None:
        told = verdict(errors([INF] * 4, INF), errors([INF] * 4, INF))
        assert not told.stays and told.count == 0

    def test_a_piece_in_which_nothing_is_seen_has_no_voice(self) -> None:
        told = verdict(errors([0.9, 0.9, 0.9, np.nan]), errors([1.0, 1.0, 1.0, np.nan]))
        assert told.stays and (told.better, told.count) == (3, 3)


class TestMisfits:
    def test_what_diverges_or_is_far_off_does_not_belong(self) -> None:
        found = misfits(np.array([5.0, 6.0, 5.5, INF, 4.0, 40.0, 6.5]))
        assert found == {3: "its prediction diverges", 5: "its error is 7 times the median"}

    def test_recordings_that_differ_as_real_ones_do_belong(self) -> None:
        assert misfits(np.array([3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0])) == {}
        assert misfits(np.array([5.0, 9.9])) == {}

    def test_what_is_not_seen_is_not_said_to_diverge(self) -> None:
        found = misfits(np.array([5.0, np.nan, 5.5, INF, 4.0]))
        assert found == {1: "none of its free markers is seen where it would be judged", 3: "its prediction diverges"}
        assert list(misfits(np.array([np.nan, INF, 5.0]))) == [0]  # half of those that can be judged stay

    def test_half_of_them_are_no_misfits(self) -> None:
        assert misfits(np.array([5.0, INF, INF, 6.0])) == {}


class TestSplit:
    def motions(self, count: int) -> list[GrippedMotion]:
        return [GrippedMotion.of(carried_about(name=f"{k}"), 0.08) for k in range(count)]

    @pytest.mark.parametrize(
        ("count", "judged", "cut", "pieces"), [(1, 1, True, 4), (2, 2, True, 2), (4, 1, False, 4), (16, 4, False, 1)]
    )
    def test_few_recordings_are_judged_in_pieces(self, count: int, judged: int, cut: bool, pieces: int) -> None:
        split = Split.of(self.motions(count), 0.25)
        assert (len(split.judged), split.cut, split.pieces) == (judged, cut, pieces)

    def test_of_many_recordings_some_wait(self) -> None:
        """Of 56 recordings all were predicted after every rung, though the windows of a fit are of six."""
        motions = self.motions(32)
        split = Split.of(motions, 0.25)
        assert (len(split.fitted), len(split.judged), len(split.waiting)) == (18, 8, 6)
        assert sorted(int(m.recording.name) for m in (*split.motions, *split.waiting)) == list(range(32))
        smaller = split.without({0})
        assert smaller.fitted == split.fitted[1:] and smaller.waiting == split.waiting
        assert Split.of(motions[:24], 0.25).waiting == ()

    def test_what_is_left_out_is_neither_fitted_nor_judged(self) -> None:
        split = Split.of(self.motions(8), 0.25)
        smaller = split.without({0, 7})
        assert smaller.fitted == split.fitted[1:] and smaller.judged == split.judged[:1] and smaller.pieces == 4

    def test_a_fitted_recording_judges_where_the_only_judge_is_left_out(self) -> None:
        """Of three to five recordings one judges, the first; it may be the one that is spoiled."""
        split = Split.of(self.motions(4), 0.25)
        smaller = split.without({3})
        assert smaller.fitted == split.fitted[:-1] and smaller.judged == split.fitted[-1:]
        assert smaller.since == (2,) and smaller.pieces == 4
        assert not smaller.without({1, 2}).judged  # one recording is fitted, and nothing is left to judge

    def test_a_piece_without_free_markers_is_not_judged(self) -> None:
        """Gripped markers are predicted by themselves: their error there is zero under every model."""
        (motion,) = self.motions(1)
        x = motion.recording.positions.copy()
        x[-10:, list(motion.free)] = np.nan
        motion = replace(motion, recording=replace(motion.recording, positions=x))
        values = {"rope_length": motion.length}
        found = errors_of(model_of(motion), values, Split.of([motion], 0.25))
        assert np.isnan(found.judged).tolist() == [[False, False, False, True]]
        assert np.isfinite(found.whole).all() and np.isfinite(found.typical).all()
        assert verdict(found, found).ratio == 1.0

    def test_errors_are_those_of_the_pieces(self) -> None:
        motions = self.motions(4)
        found = errors_of(model_of(motions[0]), {"rope_length": motions[0].length}, Split.of(motions, 0.25))
        assert found.fitted.shape == (3,) and found.judged.shape == (1, 4)
        assert found.whole[0] == found.fitted[0] and found.whole[3] == pytest.approx(found.fitted[0], rel=0.02)

    def test_the_end_of_a_recording_is_predicted_from_its_beginning(self) -> None:
        """What slides inside has a history: a prediction that starts in the middle does not know it."""
        (motion,) = self.motions(1)
        split = Split.of([motion], 0.25)
        assert split.judged == (motion,) and split.since == (len(split.fitted[0].recording.times),) == (76,)
        values = {"rope_length": motion.length}
        (x,) = predict(model_of(motion), [motion], values)
        expected = np.abs(x - motion.recording.positions)[76:].mean()
        assert errors_of(model_of(motion), values, split).judged.mean() == pytest.approx(expected, rel=0.02)

    def test_a_prediction_beyond_the_rope_diverges(self) -> None:
        (motion,) = self.motions(1)
        found = errors_of(model_of(motion), {"rope_length": 1e200}, Split.of([motion], 0.0))
        assert np.isinf(found.fitted).all() and found.judged is found.fitted
