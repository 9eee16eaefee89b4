"""The baselines without physics: exact where they claim to be, and never flattered."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sheetbend.errors import RecordingError
from sheetbend.recording.baseline import baseline, blend_baseline, hold_baseline, rest_baseline, rms_about
from sheetbend.recording.recording import Recording

NAN = np.nan
T = np.linspace(0, 1, 21)


def rope(left: np.ndarray, right: np.ndarray, share: np.ndarray, sag: float = 0.1) -> Recording:
    """A rope that follows its ends (frames, 3) by share (markers,), with a sag that never changes."""
    x = (1 - share)[None, :, None] * left[:, None] + share[None, :, None] * right[:, None]
    x[:, :, 2] -= sag * share * (1 - share)
    return Recording(x, T, clamped=[0, len(share) - 1])


def ends() -> tuple[np.ndarray, np.ndarray]:
    left = np.stack([0.1 * np.sin(4 * T), 0 * T, 0.05 * T], axis=1)
    return left, left + np.array([1.0, 0.0, 0.0])


UNEVEN = np.array([0.0, 0.1, 0.35, 0.8, 1.0])


def test_hold_stays_where_first_seen() -> None:
    x = np.arange(12.0).reshape(4, 1, 3) * np.ones((1, 2, 1))
    x[0, 1] = NAN
    held = hold_baseline(Recording(x, np.arange(4.0)))
    assert held.shape == (4, 2, 3)
    assert np.array_equal(held[:, 0], np.tile(x[0, 0], (4, 1)))
    assert np.array_equal(held[:, 1], np.tile(x[1, 1], (4, 1)))


def test_rest_is_the_mean_of_what_is_seen() -> None:
    x = np.zeros((4, 2, 3))
    x[:, 0, 0] = [0, 1, 2, 9]
    x[:, 1, 2] = [4, 8, 0, 0]
    x[2:, 1] = NAN
    recording = Recording(x, np.arange(4.0))
    assert rest_baseline(recording).tolist() == [[3.0, 0.0, 0.0], [0.0, 0.0, 6.0]]
    late = rest_baseline(recording.piece(2.0))
    assert late[0].tolist() == [5.5, 0.0, 0.0] and np.isnan(late[1]).all()
    two = rest_baseline([recording.piece(0, 1), recording.piece(3)])
    assert two.tolist() == [[4.5, 0.0, 0.0], [0.0, 0.0, 4.0]]
    with pytest.raises(RecordingError, match="at least one"):
        rest_baseline([])
    with pytest.raises(RecordingError, match=r"at least one in a list \(got 3"):
        rest_baseline(3)
    with pytest.raises(RecordingError, match=r"m0, m1"):
        rest_baseline([recording, recording.select([1])])


@settings(deadline=None)
@given(
    st.lists(st.floats(0.02, 1), min_size=2, max_size=7),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    st.integers(0, 2**32 - 1),
)
def test_blend_is_exact_for_a_carried_rope(gaps: list[float], offset: list[float], seed: int) -> None:
    """Both ends move alike: the rope keeps its shape, whatever that is, and the blend misses nothing."""
    share = np.append(0.0, np.cumsum(gaps)) / sum(gaps)
    motion = np.random.default_rng(seed).normal(size=(len(T), 3))
    recording = rope(motion, motion + np.array(offset) + [2, 0, 0], share)
    assert np.abs(blend_baseline(recording) - recording.positions).max() < 1e-12


def test_blend_weights_by_arc_length_not_by_number() -> None:
    """A straight rope on unevenly spaced markers that is swung about one end."""
    left = np.zeros((len(T), 3))
    right = np.stack([np.cos(T), np.sin(T), 0 * T], axis=1)
    recording = rope(left, right, UNEVEN, sag=0.0)
    assert np.abs(blend_baseline(recording) - recording.positions).max() < 1e-15
    swapped = recording.positions.copy()
    swapped[7, 2] += 5.0  # one bad sample must not move the shares
    robust = blend_baseline(Recording(swapped, T, clamped=[0, 4]))
    assert np.abs(robust - recording.positions).max() < 1e-15
    even = rope(left, right, np.linspace(0, 1, 5), sag=0.0)
    assert np.abs(blend_baseline(even) - recording.positions).max() > 0.1


def test_blend_starts_where_a_marker_is_first_seen() -> None:
    recording = rope(*ends(), UNEVEN)
    x = recording.positions.copy()
    x[:5, 2] = NAN  # first seen in frame 5
    x[7:9, 0] = NAN  # a short gap in a driven end is closed
    gapped = Recording(x, T, clamped=recording.clamped)
    assert np.abs(blend_baseline(gapped) - recording.positions).max() < 1e-4
    assert np.abs(blend_baseline(gapped)[5:7, 2] - recording.positions[5:7, 2]).max() < 1e-15


@pytest.mark.parametrize("clamped", [[0, 1, 5, 6], [6, 1, 0, 5], [0, 5, 6], [0, 1, 2, 6]])
def test_blend_takes_several_driven_markers_at_an_end(clamped: list[int]) -> None:
    """Grips that move alike and do not turn carry the rope; driven markers are as recorded whatever the grips do."""
    share = np.array([0.0, 0.05, 0.3, 0.5, 0.6, 0.95, 1.0])
    carried = Recording(rope(*ends(), share).positions, T, clamped=clamped)
    assert np.abs(blend_baseline(carried) - carried.positions).max() < 1e-15
    x = np.random.default_rng(3).normal(size=(len(T), 7, 3))
    wild = Recording(x, T, clamped=clamped)
    assert np.array_equal(blend_baseline(wild)[:, sorted(clamped)], x[:, sorted(clamped)])
    assert baseline(wild.piece(0, 0.5), wild.piece(0.5)).errors.keys() == {"rest", "hold", "blend"}


def test_blend_follows_the_driven_markers_next_to_the_free_ones() -> None:
    """By hand: markers at 0, 1, 2, 4, 5, 6 m; those at 1 and 5 m move by 3 and -1 m, the outer ones elsewhere."""
    x = np.zeros((2, 6, 3))
    x[:, :, 0] = [0, 1, 2, 4, 5, 6]
    x[1, [0, 1, 4, 5], 2] = [70, 3, -1, 90]
    predicted = blend_baseline(Recording(x[[0, 0, 0, 1]], np.arange(4.0), clamped=[0, 1, 4, 5]))
    assert predicted[3, :, 2].tolist() == [70, 3, 0.75 * 3 - 0.25, 0.25 * 3 - 0.75, -1, 90]
    assert np.array_equal(predicted[:, :, 0], x[[0, 0, 0, 1], :, 0])


def test_blend_with_two_driven_markers_is_that_of_the_rope_between_them() -> None:
    x = np.random.default_rng(5).normal(size=(len(T), 8, 3))
    whole = blend_baseline(Recording(x, T, clamped=[0, 1, 6, 7]))
    between = blend_baseline(Recording(x[:, 1:-1], T, clamped=[0, 5]))
    assert np.array_equal(whole[:, 1:-1], between)


@pytest.mark.parametrize("clamped", [[], [0], [0, 1], [0, 2, 4], [1, 4], [0, 3], [0, 1, 2, 3, 4]])
def test_blend_refuses_other_boundaries(clamped: list[int]) -> None:
    recording = rope(*ends(), UNEVEN)
    with pytest.raises(RecordingError, match="first and the last"):
        blend_baseline(Recording(recording.positions, T, clamped=clamped))


def test_blend_refuses_neighbors_never_seen_together() -> None:
    x = rope(*ends(), UNEVEN).positions.copy()
    x[:10, 2] = NAN
    x[10:, 3] = NAN
    with pytest.raises(RecordingError, match=r"never seen together \(got \('m2', 'm3'\)\)"):
        blend_baseline(Recording(x, T, clamped=[0, 4]))


def test_rms_is_a_distance_over_free_seen_markers() -> None:
    x = np.zeros((2, 3, 3))
    x[:, 0] = 100.0  # clamped
    x[0, 1] = [3, 4, 0]  # 5 away
    x[1, 1] = [0, 0, 1]
    x[1, 2] = NAN
    recording = Recording(x, [0.0, 1.0], clamped=[0])
    assert rms_about(recording, np.zeros((3, 3))) == np.sqrt((25 + 1 + 0) / 3)
    assert rms_about(recording, np.zeros((2, 3, 3)), recording.mask & [[False], [True]]) == 1.0
    reference = np.zeros((2, 3, 3))
    reference[1, 2] = NAN  # not needed where nothing was seen
    assert rms_about(recording, reference) == np.sqrt(26 / 3)
    reference[0, 1] = NAN
    for bad, scored, words in (
        (reference, None, "not finite"),
        (np.zeros((2, 3)), None, r"reference: does not fit .*\(2, 3, 3\)"),
        (np.zeros((3, 3)), np.ones((2, 2), bool), "scored: does not fit"),
        (np.zeros((3, 3)), np.zeros((2, 3), bool), "nothing to compare"),
    ):
        with pytest.raises(RecordingError, match=words):
            rms_about(recording, bad, scored)


# ---- which one is picked --------------------------------------------------------------------------------


def swinging(frames: int = 400, clamped: tuple[int, ...] = (0,)) -> Recording:
    t = np.linspace(0, 10, frames)
    x = np.zeros((frames, 2, 3))
    x[:, 1, 0] = 0.1 * np.cos(5 * t)
    return Recording(x, t, clamped=clamped)


def test_a_swing_is_predicted_by_its_mean() -> None:
    recording = swinging()
    found = baseline(recording.piece(0, 4 * np.pi / 5), recording.piece(2 * np.pi))
    assert found.kind == "rest"
    assert found.rms == pytest.approx(0.1 / np.sqrt(2), rel=0.05)
    assert (
        "rest: every marker stays at its mean position" in found.words and found.errors["hold"] > found.errors["rest"]
    )


def test_a_creep_is_predicted_by_its_start() -> None:
    t = np.linspace(0, 10, 101)
    x = np.zeros((101, 2, 3))
    x[:, 1, 2] = -0.1 * t
    recording = Recording(x, t, clamped=[0])
    assert baseline(recording.piece(0, 8), recording.piece(8)).kind == "hold"


def test_a_driven_rope_is_predicted_by_its_ends() -> None:
    recording = rope(*ends(), UNEVEN)
    found = baseline(recording.piece(0, 0.4), recording.piece(0.4))
    assert found.kind == "blend" and found.rms < 1e-15
    assert found.positions.shape == recording.piece(0.4).positions.shape


def test_what_a_baseline_is_given_is_not_scored() -> None:
    recording = swinging()
    held_out = recording.piece(5)
    found = baseline(recording.piece(0, 5), held_out)
    assert not found.scored[0].any() and found.scored[1:, 1].all() and not found.scored[:, 0].any()
    assert found.rms == rms_about(held_out, found.positions, found.scored)
    for prediction in (hold_baseline(held_out), rest_baseline(recording.piece(0, 5))):
        assert found.rms <= rms_about(held_out, prediction, found.scored)


def test_a_static_shape_is_predicted_by_the_other_ones() -> None:
    """One frame: holding it would be no prediction, so the mean of the other rehangings is taken."""
    shapes = [Recording(np.full((1, 3, 3), value), [0.0], clamped=[0, 2]) for value in (1.0, 3.0, 4.0)]
    found = baseline(shapes[:2], shapes[2])
    assert found.kind == "rest" and found.rms == pytest.approx(2 * np.sqrt(3))
    assert found.scored.tolist() == [[False, True, False]]
    assert list(found.errors) == ["rest"]


def test_nothing_to_predict_from_is_an_error() -> None:
    fitted = swinging()
    x = fitted.positions.copy()
    x[200:, 1] = NAN
    lost = Recording(x, fitted.times, clamped=[0])
    with pytest.raises(RecordingError, match="no baseline"):
        baseline(lost.piece(6), fitted.frames(slice(7, 8)))
    assert baseline(lost.piece(6), fitted.piece(2)).kind == "hold"
    with pytest.raises(RecordingError, match="differ"):
        baseline(fitted, fitted.select([1]))
    with pytest.raises(RecordingError, match="nothing to compare"):
        baseline(fitted, lost.piece(6))
