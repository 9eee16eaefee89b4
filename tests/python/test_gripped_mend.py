"""Exchanged, stray and frozen markers of a gripped rope are found and mended, or cost one recording and not the fit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import Screened, screened
from sheetbend.gripped.mend import mended

Array = np.ndarray
TIMES = np.arange(300) / 100.0
COUNT = 12
INNER = (1, COUNT - 2)


def moving(length: float = 0.9, turn: float = 0.0) -> Array:
    """(frames, 12, 3) m with noise of 0.5 mm: an arc that bends, swings at up to 1.5 m/s, and goes straight on into
    grips 3 cm long."""
    s = length * np.linspace(-0.5, 0.5, COUNT - 2)
    s = np.concatenate([[s[0] - 0.03], s, [s[-1] + 0.03]])
    curvature = (2.0 + np.sin(4.0 * TIMES + turn))[:, None]
    inside = np.clip(s, -length / 2, length / 2)
    angle, beyond = curvature * inside, s - inside
    x = np.sin(angle) / curvature + beyond * np.cos(angle)
    z = (1.0 - np.cos(angle)) / curvature + beyond * np.sin(angle)
    positions = np.stack([x, 0.3 * np.sin(5.0 * TIMES)[:, None] + 0.0 * x, z], axis=-1)
    return positions + 5e-4 * np.random.default_rng(1).standard_normal(positions.shape)


def recorded(positions: Array, name: str = "r") -> sb.Recording:
    times = TIMES[: len(positions)]
    n = positions.shape[1]
    return sb.Recording(positions, times, clamped=(0, 1, n - 2, n - 1), name=name)


def with_exchanged(positions: Array, pair: tuple[int, int], frames: slice) -> Array:
    changed = positions.copy()
    changed[frames, pair[0]], changed[frames, pair[1]] = positions[frames, pair[1]], positions[frames, pair[0]]
    return changed


class TestExchanged:
    def test_a_sound_recording_is_returned_as_it_is(self) -> None:
        recording = recorded(moving())
        assert mended(recording, INNER) == (recording, ())

    @pytest.mark.parametrize(
        ("pair", "frames", "words"),
        [
            ((10, 11), slice(None), "m10 and m11 of the last grip were exchanged throughout, and are put back"),
            ((10, 11), slice(257, None), "m10 and m11 of the last grip were exchanged from frame 257 (2.57 s) on"),
            ((0, 1), slice(None, 250), "m0 and m1 of the first grip were exchanged from frame 0 to 249"),
            ((0, 1), slice(100, 101), "m0 and m1 of the first grip were exchanged in frame 100 (1 s)"),
            ((5, 6), slice(200, None), "m5 and m6 were exchanged from frame 200 (2 s) on, and are put back"),
            ((5, 6), slice(None), "m5 and m6 were exchanged throughout, and are put back"),
            ((1, 2), slice(90, None), "m1 and m2 were exchanged from frame 90 (0.9 s) on, and are put back"),
        ],
    )
    def test_neighbors_are_put_back(self, pair: tuple[int, int], frames: slice, words: str) -> None:
        positions = moving()
        found, notes = mended(recorded(with_exchanged(positions, pair, frames)), INNER)
        np.testing.assert_array_equal(found.positions, positions)
        assert len(notes) == 1 and words in notes[0]

    def test_both_grips_and_twice(self) -> None:
        positions = moving()
        changed = with_exchanged(with_exchanged(positions, (0, 1), slice(None)), (10, 11), slice(40, 90))
        found, notes = mended(recorded(with_exchanged(changed, (10, 11), slice(200, 240))), INNER)
        np.testing.assert_array_equal(found.positions, positions)
        assert len(notes) == 2 and "2 times from frame 40 to 239" in notes[1]

    def test_one_that_happens_while_a_marker_is_hidden_is_found(self) -> None:
        positions = moving()
        positions[100:104, 11] = np.nan
        changed = with_exchanged(positions, (10, 11), slice(102, None))
        found, notes = mended(recorded(changed), INNER)
        np.testing.assert_array_equal(found.positions[104:], positions[104:])
        assert len(notes) == 1


def folded(turn: float = 0.0, end: float = 0.1) -> Array:
    """The same with a rope that turns back at its first grip, about which the next link swings from 150 to 170 degrees
    away from straight on; it is `end` m long."""
    x = moving(turn=turn)
    angle = np.deg2rad(160.0 + 10.0 * np.sin(6.0 * TIMES))
    ahead = x[:, 1] - x[:, 0]
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    aside = np.cross(ahead, [0.0, 1.0, 0.0])
    link = end * (np.cos(angle)[:, None] * ahead + np.sin(angle)[:, None] * aside)
    x[:, 2:] += (x[:, 1] + link - x[:, 2])[:, None]
    return x


class TestFoldedBack:
    """Two markers of a grip that are exchanged and a rope that folds back at it look alike in one recording's mean
    distances. Once the markers of such a rope were exchanged."""

    def test_the_link_in_other_recordings_tells_a_fold(self) -> None:
        good = [recorded(moving(turn=0.1 * k), f"{k}") for k in range(3)]
        found = screened([*good, recorded(folded(), "folded")], 0.0)
        (note,) = found.notes
        assert note.startswith("folded: the rope folds back at m0 and m1 of the first grip, which stay as they are: ")
        assert "the next link is 100 mm long as given" in note and "101 mm in the other recordings" in note
        np.testing.assert_allclose(found[3].positions[:, :2], folded()[:, :2], atol=2e-3)

    @pytest.mark.parametrize("end", [0, 1])
    def test_and_an_exchange(self, end: int) -> None:
        pair = ((0, 1), (10, 11))[end]
        good = [recorded(moving(turn=0.1 * k), f"{k}") for k in range(3)]
        found = screened([recorded(with_exchanged(moving(), pair, slice(None)), "bad"), *good], 0.0)
        (note,) = found.notes
        grip = f"m{pair[0]} and m{pair[1]} of the {('first', 'last')[end]} grip"
        assert note == f"bad: {grip} were exchanged throughout, and are put back"

    def test_a_link_of_another_length_than_the_rest_is_known_from_other_recordings(self) -> None:
        """By the other links of the rope, one of 70 mm behind the grip looks like either."""
        x = [moving(turn=0.1 * k) for k in range(3)]
        for each in x:
            each[:, 2:] += (each[:, 1] - each[:, 2])[:, None] * 0.3
        good = [recorded(each, f"{k}") for k, each in enumerate(x)]
        bad = recorded(with_exchanged(x[0], (0, 1), slice(None)), "bad")
        assert "bad: m0 and m1 of the first grip were exchanged" in screened([*good, bad], 0.0).notes[0]
        (note,) = screened([*good, recorded(folded(end=0.07), "folded")], 0.0).notes
        assert "the rope folds back" in note and "or they were" not in note

    def test_one_recording_alone_is_told_by_its_other_links_as_a_guess(self) -> None:
        (motion,) = (found := screened([recorded(folded(), "r")], 0.0))
        assert "folds back at m0 and m1" in found.notes[0] and "or they were exchanged throughout" in found.notes[0]
        np.testing.assert_allclose(motion.positions[:, :2], folded()[:, :2], atol=2e-3)

    def test_uneven_links_alone_tell_nothing_and_both_are_named(self) -> None:
        x = folded()
        x[:, 5] += 0.3 * (x[:, 6] - x[:, 5])
        _, (note,) = mended(recorded(x), INNER)
        assert "exchanged throughout, and are put back (or the rope folds back there: the next link is 100 mm" in note


class TestImpossible:
    def test_a_grip_that_is_seen_elsewhere_for_a_moment_is_not_used_there(self) -> None:
        positions = moving()
        changed = positions.copy()
        changed[120:126, :2] += (0.0, 1.5, 0.0)
        found, (note,) = mended(recorded(changed), INNER)
        assert np.isnan(found.positions[120:126, :2]).all() and np.isnan(found.positions).sum() == 36
        assert "m0, m1 jumped elsewhere from frame 120 to 125" in note
        (motion,) = screened([recorded(changed)], 0.0)
        assert np.abs(motion.positions[:, :2] - positions[:, :2]).max() < 5e-3

    def test_a_free_marker_that_is_lost_to_another_place_for_long_is_not_seen_there(self) -> None:
        changed = moving()
        changed[150:, 4] = changed[150:, 8] + 0.01
        found, notes = mended(recorded(changed), INNER)
        assert np.isnan(found.positions[150:, 4]).all() and np.isfinite(found.positions[:150, 4]).all() and notes

    @pytest.mark.parametrize("away", [0.06, 0.3])
    def test_a_free_marker_that_goes_elsewhere_and_comes_back_is_not_seen_there(self, away: float) -> None:
        """Once it was believed there where it was so near that a fast marker gets there between two frames."""
        changed = moving()
        changed[140:160, 5] += (away, 0.0, 0.0)
        found, (note,) = mended(recorded(changed), INNER)
        assert np.isnan(found.positions[140:160, 5]).all() and np.isnan(found.positions).sum() == 60
        assert "m5 jumped elsewhere from frame 140 to 159" in note

    def test_numbers_that_repeat_from_a_moving_frame_on_are_cut_off(self) -> None:
        """A recording whose last second repeats one frame once was one of a rope that is stopped in the air."""
        changed = moving()
        changed[190:] = changed[189]
        found, (note,) = mended(recorded(changed), INNER)
        assert "all markers stood still although the rope moved from frame 190 (1.9 s) on: not used there" in note
        (motion,) = screened([recorded(changed)], 0.0)
        assert len(motion.recording.times) == 190 and np.isfinite(found.positions[:190]).all()
        ended = np.concatenate([moving()[:189], np.repeat(moving()[188:189], 3, axis=0)])
        assert mended(recorded(ended), INNER)[1] == ()  # too short to tell

    def test_frozen_tracking_is_not_used(self) -> None:
        changed = moving()
        changed[100:130, 5] = changed[100, 5]
        found, (note,) = mended(recorded(changed), INNER)
        assert np.isnan(found.positions[101:130, 5]).all() and np.isnan(found.positions).sum() == 3 * 29
        assert "m5 stood still although the rope moved from frame 101 to 129" in note

    @pytest.mark.parametrize(("marker", "frames"), [(4, slice(100, 140)), (0, slice(250, 252)), (11, slice(0, 3))])
    def test_zeros_are_no_places(self, marker: int, frames: slice) -> None:
        """Once two neighbors were exchanged there, and frames before it were thrown away."""
        positions = moving()
        changed = positions.copy()
        changed[frames, marker] = 0.0
        found, (note,) = mended(recorded(changed), INNER)
        positions[frames, marker] = np.nan
        np.testing.assert_array_equal(found.positions, positions)
        assert f"m{marker} lay exactly at the origin from frame {frames.start}" in note

    def test_a_marker_may_rest_at_the_origin(self) -> None:
        x = moving()
        positions = np.concatenate([np.repeat(x[:1], 50, axis=0), x[:250]]) - x[0, 5]
        assert not any("origin" in note for note in mended(recorded(positions), INNER)[1])

    def test_rest_and_repeated_frames_are_not_frozen(self) -> None:
        clean = moving()
        resting = np.concatenate([np.repeat(clean[:1], 50, axis=0), clean[:250]])
        slow = np.repeat(clean[:50], 6, axis=0)
        positions = np.round(resting, 3)
        for x in (positions, np.where(np.arange(300)[:, None, None] < 50, positions[:1], positions), slow):
            assert not any("stood still" in note for note in mended(recorded(x), INNER)[1])

    def test_a_fast_swing_at_few_frames_is_possible(self) -> None:
        times = np.arange(60) / 20.0
        swing = 0.5 * np.sin(2 * np.pi * 1.2 * times)[:, None, None] * [0.0, 1.0, 0.0]
        x = np.linspace(0.0, 0.9, COUNT)[:, None] * [1.0, 0.0, 0.0] + swing
        recording = sb.Recording(x, times, clamped=(0, 1, 10, 11))
        assert mended(recording, INNER) == (recording, ())


class TestLostFrames:
    """A recorder that loses frames repeats one in their place, or goes on as if they had not been."""

    def test_repeated_frames_are_left_out(self) -> None:
        changed = moving()
        for k in (50, 51, 200):
            changed[k] = changed[k - 1]
        found, (note,) = mended(recorded(changed), INNER)
        np.testing.assert_array_equal(found.times, np.delete(TIMES, [50, 51, 200]))
        np.testing.assert_array_equal(found.positions, np.delete(moving(), [50, 51, 200], axis=0))
        assert note == "3 frames that are left out repeat the one before (frame 50 (0.5 s) and 2 later)"

    def test_times_count_frames_that_are_missing(self) -> None:
        lost = [81, 150, 185, 244]
        found, (note,) = mended(recorded(np.delete(moving(), lost, axis=0)), INNER)
        np.testing.assert_allclose(found.times, np.delete(TIMES, lost), atol=1e-9)
        assert note == "4 frames were lost before frame 81 (0.81 s) and 3 later: later times count them"

    def test_times_that_count_them_stay(self) -> None:
        lost = [81, 150, 151, 244]
        kept = np.delete(moving(), lost, axis=0)
        recording = sb.Recording(kept, np.delete(TIMES, lost), clamped=(0, 1, 10, 11))
        assert mended(recording, INNER) == (recording, ())

    def test_a_rope_that_starts_stops_or_turns_back_lost_none(self) -> None:
        still = np.repeat(moving()[:1], 100, axis=0)
        jerked = moving()[:200] + 0.1 * (np.arange(200) >= 100)[:, None, None] * np.eye(3)[1] * TIMES[:200, None, None]
        back = np.concatenate([moving()[:150], moving()[149::-1]])
        for x in (np.concatenate([still, moving()[:150], still[:50]]), jerked, back):
            assert not any("lost" in note or "repeat" in note for note in mended(recorded(x), INNER)[1])


class TestScreened:
    def names(self, found: Screened) -> list[str]:
        return [m.recording.name for m in found]

    def test_one_bad_recording_of_many_is_left_out_with_its_reason(self) -> None:
        frozen = moving()
        frozen[100:200, :2] = frozen[100, :2]
        good = [recorded(moving(turn=0.1 * k), f"{k}") for k in range(5)]
        bad = [recorded(frozen, "frozen"), recorded(moving()[:, 1:], "fewer")]
        found = screened([*good[:2], *bad, *good[2:], recorded(moving(1.0), "longer")], 0.08)
        assert self.names(found) == ["0", "1", "2", "3", "4"]
        assert [note.split(" is left out: ")[0] for note in found.notes] == ["frozen", "fewer", "longer"]
        reasons = "\n".join(found.notes)
        for words in ("stood still", "it has 11 markers, most others 12", "1 m long"):
            assert words in reasons, reasons

    @pytest.mark.parametrize(
        ("marker", "lost", "used", "words"),
        [
            (0, slice(40, 80), slice(80, 300), "only 0.8 to 2.99 s are used, since clamped marker 'm0' is lost"),
            (11, slice(230, 260), slice(0, 230), "only 0 to 2.29 s are used"),
            (1, slice(0, 7), slice(7, 300), "only 0.07 to 2.99 s are used"),
            (10, slice(290, 300), slice(0, 290), "only 0 to 2.89 s are used"),
            (slice(2, 9), slice(0, 30), slice(30, 300), "only 0.3 to 2.99 s are used"),
        ],
        ids=["in the middle", "near the end", "at the start", "at the end", "free ones at the start"],
    )
    def test_a_grip_that_is_lost_costs_part_of_a_recording(
        self, marker: int | slice, lost: slice, used: slice, words: str
    ) -> None:
        """Once it cost all of it, and where most had such gaps the fit."""
        positions = moving()
        positions[lost, marker] = np.nan
        found = screened([recorded(positions + 1e-6 * k, f"{k}") for k in range(3)], 0.08)
        assert self.names(found) == ["0", "1", "2"] and words in found.notes[0]
        assert len(found.notes) == (3 if isinstance(marker, slice) else 1)  # free ones: each is named
        assert np.array_equal(found[0].recording.times, TIMES[used])

    def test_times_that_jump_cost_part_of_a_recording(self) -> None:
        late = np.where(np.arange(300) < 120, 0.0, 0.7) + TIMES
        found = screened([sb.Recording(moving(), late, clamped=(0, 1, 10, 11), name="r")], 0.08)
        assert np.array_equal(found[0].recording.times, late[120:])
        assert "only 1.9 to 3.69 s are used, since times of r jump by 0.71 s" in found.notes[0]

    def test_other_places_of_markers_are_another_rope(self) -> None:
        places = np.concatenate([[0, 1], 1 + np.cumsum([1, 1.5, 0.5, 1, 1, 1, 1.5, 0.5, 1]), [11]])
        x = moving()
        k = np.clip(places.astype(int), 0, COUNT - 2)
        other = x[:, k] + (places - k)[None, :, None] * (x[:, k + 1] - x[:, k])
        found = screened([*(recorded(moving(turn=0.1 * n), f"{n}") for n in range(5)), recorded(other, "other")], 0.08)
        assert self.names(found) == ["0", "1", "2", "3", "4"]
        assert "other is left out: its markers have other distances" in found.notes[0]

    def test_where_most_are_bad_the_first_reason_is_raised(self) -> None:
        frozen = moving()
        frozen[100:200, :2] = frozen[100, :2]
        with pytest.raises(sb.RecordingError, match="stood still"):
            screened([recorded(frozen, "a"), recorded(frozen + 1e-6, "b"), recorded(moving(), "c")], 0.08)

    def test_a_recording_that_is_given_twice_counts_once(self) -> None:
        one, other = recorded(moving(), "one"), recorded(moving(turn=0.1), "other")
        found = screened([one, other, one], 0.08)
        assert self.names(found) == ["one", "other"]
        assert found.notes == ("one is left out: it has the same positions as one",)

    def test_several_that_are_left_out_are_told_in_the_plural(self) -> None:
        same = [recorded(moving(), f"{k}") for k in range(5)]
        assert screened(same, 0.08).notes == ("1, 2, 3 and 1 more are left out: they have the same positions as 0",)

    def test_motions_stay_and_what_was_screened_is_returned(self) -> None:
        found = screened([recorded(moving())], 0.08)
        assert screened(found, 0.2) is found
        assert screened(list(found), 0.2)[0] is found[0]

    @pytest.mark.parametrize("wrong", [lambda x: x[:, :3], lambda x: x[:2]], ids=["no two grips", "two frames"])
    def test_a_single_recording_that_cannot_be_used_is_refused(self, wrong: Callable[[Array], Array]) -> None:
        x = wrong(moving())
        with pytest.raises(sb.RecordingError):
            screened([sb.Recording(x, TIMES[: len(x)], clamped=(0, 1))], 0.08)
