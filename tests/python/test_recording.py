"""Recording: what it refuses, and what its methods keep."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sheetbend.errors import DivergenceError, InputError, RecordingError, SheetbendError
from sheetbend.recording.recording import Recording

NAN = np.nan


def moving(frames: int = 21, markers: int = 3, rate: float = 100.0, **fields: object) -> Recording:
    """Markers on parabolas in time: cubic interpolation is exact, linear is not."""
    t = np.arange(frames) / rate
    m = np.arange(markers)[None, :]
    x = np.stack([m + 0 * t[:, None], (1 + m) * t[:, None], 4 * t[:, None] ** 2 + 0 * m], axis=2)
    return Recording(x, t, **fields)


def with_gap(recording: Recording, marker: int, gap: slice) -> Recording:
    x = recording.positions.copy()
    x[gap, marker] = NAN
    return Recording(x, recording.times, recording.markers, recording.clamped)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    frames, markers = draw(st.integers(2, 12)), draw(st.integers(1, 4))
    steps = draw(st.lists(st.floats(1e-3, 2.0), min_size=frames, max_size=frames))
    times = draw(st.floats(-50, 50)) + np.cumsum(steps)
    x = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).normal(size=(frames, markers, 3))
    lost = draw(st.lists(st.tuples(st.integers(1, frames - 1), st.integers(0, markers - 1)), max_size=12))
    for frame, marker in lost:
        x[frame, marker] = NAN
    clamped = draw(st.lists(st.integers(0, markers - 1), unique=True))
    return Recording(x, times, clamped=clamped)


# ---- what is refused ------------------------------------------------------------------------------------

GOOD = np.zeros((4, 2, 3))
TIMES = np.arange(4.0)


def changed(index: tuple, value: object) -> np.ndarray:
    x = GOOD.copy()
    x[index] = value
    return x


@pytest.mark.parametrize(
    ("fields", "field", "words"),
    [
        ({"positions": np.zeros((4, 3))}, "positions", r"shape \(frames, markers, 3\) \(got \(4, 3\)\)"),
        ({"positions": np.zeros((4, 2, 2))}, "positions", "shape"),
        ({"positions": np.zeros((0, 2, 3)), "times": []}, "positions", "at least one frame"),
        ({"positions": np.zeros((4, 0, 3))}, "positions", "at least one frame and one marker"),
        ({"positions": [["a", "b"]]}, "positions", "real numbers"),
        ({"positions": GOOD.astype(complex)}, "positions", "real numbers"),
        ({"positions": np.full((4, 2, 3), None)}, "positions", "real numbers"),
        ({"positions": [[1.0], [1.0, 2.0]]}, "positions", "ragged"),
        ({"positions": changed((2, 1, 0), np.inf)}, "positions", "infinite in frame 2, marker 1"),
        ({"positions": changed((2, 1, 0), NAN)}, "positions", "some coordinates only, in frame 2, marker 1"),
        ({"positions": changed((slice(None), 1), NAN)}, "positions", r"never seen .* \['m1'\]"),
        ({"times": np.arange(3.0)}, "times", r"one entry per frame, 4 \(got 3\)"),
        ({"times": np.zeros((4, 1))}, "times", "shape"),
        ({"times": [0.0, 1.0, NAN, 3.0]}, "times", "not finite in frame 2"),
        ({"times": [0.0, 1.0, np.inf, 3.0]}, "times", "not finite in frame 2"),
        ({"times": [0.0, 2.0, 1.0, 3.0]}, "times", r"runs backwards at frame 2 \(got \(2.0, 1.0\)\)"),
        ({"times": [0.0, 1.0, 1.0, 3.0]}, "times", "repeats at frame 2"),
        ({"times": ["0", "1", "2", "3"]}, "times", "real numbers"),
        ({"clamped": [2]}, "clamped", r"out of range for 2 markers \(got 2\).*0 to 1"),
        ({"clamped": [-1]}, "clamped", "out of range"),
        ({"clamped": [0, 0]}, "clamped", "twice"),
        ({"clamped": [0.5]}, "clamped", "names or indices"),
        ({"clamped": [True]}, "clamped", "names or indices"),
        ({"clamped": ["grip"]}, "clamped", r"unknown marker \(got 'grip'\).*m0, m1"),
        ({"clamped": "m0"}, "clamped", "must be a list"),
        ({"clamped": 0}, "clamped", "must be a list"),
        ({"markers": ["a"]}, "markers", r"one name per marker \(got 1\).*2 names"),
        ({"markers": ["a", "a"]}, "markers", r"twice \(got 'a'\)"),
        ({"markers": ["a", ""]}, "markers", "no name at 1"),
        ({"markers": ["a", 7]}, "markers", "no name at 1"),
        ({"markers": ["a", "b\n"]}, "markers", "no name at 1"),
        ({"markers": "ab"}, "markers", "must be a list"),
        ({"gravity": [0.0, -9.81]}, "gravity", "three finite numbers"),
        ({"gravity": [0.0, 0.0, NAN]}, "gravity", "three finite numbers"),
        ({"gravity": "down"}, "gravity", "real numbers"),
        ({"name": ""}, "name", "non-empty"),
        ({"metadata": [1]}, "metadata", "dict"),
        ({"metadata": {1: 2}}, "metadata", "text keys"),
    ],
)
def test_bad_field_is_refused_by_name(fields: dict, field: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words) as caught:
        Recording(**{"positions": GOOD, "times": TIMES, **fields})
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: ")
    assert "Fix: " in str(caught.value)


def test_errors_are_one_family_and_survive_pickling() -> None:
    error = RecordingError("times", "runs backwards", (2.0, 1.0), "sort them")
    assert isinstance(error, InputError) and isinstance(error, SheetbendError) and isinstance(error, ValueError)
    assert str(error) == "times: runs backwards (got (2.0, 1.0)). Fix: sort them."
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is RecordingError and str(again) == str(error) and again.got == (2.0, 1.0)

    diverged = DivergenceError(substep=7, time=0.25, particle=3, where="rope (direct)")
    assert isinstance(diverged, RuntimeError)
    assert str(pickle.loads(pickle.dumps(diverged))) == str(diverged)
    assert all(part in str(diverged) for part in ("particle 3", "substep 7", "0.25 s", "rope (direct)"))


def test_huge_offenders_are_shortened() -> None:
    assert len(str(InputError("x", "is wrong", "a" * 10_000, "mend it"))) < 300


# ---- what is kept ---------------------------------------------------------------------------------------


def test_recording_is_immutable_and_owns_its_arrays() -> None:
    x = GOOD.copy()
    metadata = {"known": {"length": 1.0}}
    recording = Recording(x, TIMES, metadata=metadata)
    x[0] = 5.0
    metadata["known"]["length"] = 2.0
    assert np.all(recording.positions == 0.0)
    assert recording.metadata["known"]["length"] == 1.0
    for part in (recording, recording.piece(1.0)):
        with pytest.raises(ValueError, match="read-only"):
            part.positions[0, 0, 0] = 1.0
    with pytest.raises(AttributeError):
        recording.name = "other"  # type: ignore[misc]
    assert recording.positions.dtype == np.float64
    assert Recording(GOOD.astype(np.float32), [0, 1, 2, 3]).times.dtype == np.float64


def test_markers_clamped_free_and_mask() -> None:
    recording = moving(markers=4, clamped=["m3", 0])
    assert recording.markers == ("m0", "m1", "m2", "m3")
    assert recording.clamped == (3, 0)
    assert recording.free == (1, 2)
    lost = with_gap(recording, 2, slice(5, 8))
    assert lost.mask.shape == (21, 4) and lost.mask.sum() == 21 * 4 - 3 and not lost.mask[5:8, 2].any()


@settings(deadline=None)
@given(recordings(), st.floats(-60, 60), st.floats(-60, 60))
def test_pieces_tile(recording: Recording, one: float, other: float) -> None:
    start, stop = sorted((one, other))
    parts = []
    for bounds in ((None, start), (start, stop), (stop, None)):
        try:
            parts.append(recording.piece(*bounds))
        except RecordingError as error:
            assert "holds no frame" in str(error)
    assert np.array_equal(np.concatenate([part.times for part in parts]), recording.times)
    positions = np.concatenate([part.positions for part in parts])
    assert np.array_equal(positions, recording.positions, equal_nan=True)


def test_piece_is_half_open_and_forgives_decimal_bounds() -> None:
    recording = moving(frames=101)
    piece = recording.piece(0.07, 0.29)
    assert np.array_equal(piece.times, recording.times[7:29])
    uneven = Recording(GOOD, [0.0, 1 - 0.9, 0.1 + 0.2, 1.0])  # 1 - 0.9 < 0.1, 0.1 + 0.2 > 0.3
    assert len(uneven.piece(None, 0.1).times) == 1
    assert len(uneven.piece(0.1, 0.3).times) == 1
    assert uneven.piece(0.3).times[0] == 0.1 + 0.2
    with pytest.raises(RecordingError, match=r"holds no frame \(got \(5, 6\)\).*0 to 1 s"):
        uneven.piece(5, 6)


def test_piece_may_lose_sight_of_a_marker_but_is_not_saved(tmp_path) -> None:
    piece = with_gap(moving(), 1, slice(5, 15)).piece(0.06, 0.12)
    assert not piece.mask[:, 1].any()
    with pytest.raises(RecordingError, match=r"never seen .* \['m1'\]"):
        piece.save(tmp_path / "piece.npz")
    assert list(tmp_path.iterdir()) == []


def test_hidden_spans_lose_free_markers_and_no_frame() -> None:
    recording = moving(frames=101, markers=4, clamped=["m3"])
    found = recording.hidden([(0.07, 0.29), [0.5, 0.6]])
    inside = np.zeros(101, dtype=bool)
    inside[7:29] = inside[50:60] = True
    assert np.array_equal(found.times, recording.times) and found.clamped == (3,)
    assert np.array_equal(found.mask[:, :3], np.repeat(~inside[:, None], 3, axis=1)) and found.mask[:, 3].all()
    assert np.array_equal(found.positions[~inside], recording.positions[~inside])
    assert recording.mask.all()
    for spans, words in (
        ([(5, 6)], r"hidden\[0\]: holds no frame \(got \(5, 6\)\).*0 to 1 s"),
        ([(0.1, 0.2), (0.4, 0.3)], r"hidden\[1\]: holds no frame"),
        ([0.1, 0.2], r"hidden\[0\]: is not a span.*give \(start, stop\)"),
        ([(0.0, np.inf)], r"hidden\[0\]: is not a span"),
        ([(0.0, 0.5), (0.5, 2.0)], "hidden: leaves nothing seen"),
    ):
        with pytest.raises(RecordingError, match=words):
            recording.hidden(spans)  # type: ignore[arg-type]


def test_frames_select_and_shifted() -> None:
    recording = moving(markers=4, clamped=[0, 3], metadata={"a": 1})
    assert np.array_equal(recording.frames(slice(1, None, 5)).times, recording.times[1::5])
    for bad in (slice(None, None, -1), slice(50, 60), 3):
        with pytest.raises(RecordingError, match="frames"):
            recording.frames(bad)  # type: ignore[arg-type]

    chosen = recording.select(["m2", 3, 1])
    assert chosen.markers == ("m2", "m3", "m1") and chosen.clamped == (1,) and chosen.metadata == {"a": 1}
    assert np.array_equal(chosen.positions, recording.positions[:, [2, 3, 1]])
    for bad_markers, words in ((["tip"], "unknown"), ([], "at least one"), ([1, "m1"], "twice")):
        with pytest.raises(RecordingError, match=words):
            recording.select(bad_markers)

    release = recording.times[6]
    assert recording.shifted(release).times[6] == 0.0
    with pytest.raises(RecordingError, match="t0"):
        recording.shifted(NAN)


# ---- interpolation and gaps -----------------------------------------------------------------------------


@settings(deadline=None)
@given(recordings(), st.sampled_from(["linear", "cubic"]), st.floats(0, 3))
def test_resampling_at_the_frames_changes_nothing(recording: Recording, kind: str, max_gap: float) -> None:
    """Seen samples come back to the bit; lost ones are closed only from neighbors within max_gap."""
    again = recording.resample(recording.times, kind, max_gap)
    seen = recording.mask
    assert np.array_equal(again.positions[seen], recording.positions[seen])
    t = recording.times
    for frame, marker in np.argwhere(~seen):
        before, after = t[:frame][seen[:frame, marker]], t[frame + 1 :][seen[frame + 1 :, marker]]
        close = len(before) > 0 and len(after) > 0 and after[0] - before[-1] <= max_gap
        assert again.mask[frame, marker] == close


@settings(deadline=None)
@given(recordings(), st.lists(st.floats(0, 1), min_size=1, max_size=9, unique=True))
def test_linear_stays_within_its_neighbors(recording: Recording, where: list[float]) -> None:
    t = recording.times
    at = np.unique(np.clip(t[0] + np.array(where) * (t[-1] - t[0]), t[0], t[-1]))
    x = recording.resample(at, "linear", max_gap=1e9).positions
    assert np.nanmax(np.abs(x), initial=0) <= np.nanmax(np.abs(recording.positions)) * (1 + 1e-12)


def test_cubic_is_exact_for_quadratic_motion_on_uneven_times() -> None:
    t = np.array([0.0, 0.1, 0.15, 0.4, 0.6, 0.65, 1.0])
    motion = lambda t: np.stack([3 - 2 * t, t**2, 1 + t - 5 * t**2], axis=-1)[:, None]  # noqa: E731
    recording = Recording(motion(t), t)
    at = np.linspace(0, 1, 57)
    error = recording.resample(at, "cubic", 1.0).positions - motion(at)
    assert np.abs(error).max() < 1e-14
    assert np.abs(recording.resample(at, "linear", 1.0).positions - motion(at)).max() > 1e-2


def test_cubic_is_continuously_differentiable_and_of_third_order() -> None:
    def largest_error(frames: int) -> float:
        t = np.linspace(0, 1, frames)
        x = np.sin(6 * t)[:, None, None] * np.ones(3)
        at = np.linspace(0, 1, 801)
        got = Recording(x, t).resample(at, "cubic", 1.0).positions[:, 0, 0]
        return float(np.abs(got - np.sin(6 * at)).max())

    assert 3 - 0.3 < np.log2(largest_error(33) / largest_error(65)) < 3 + 0.3

    rng = np.random.default_rng(3)
    recording = Recording(rng.normal(size=(9, 1, 3)), np.cumsum(rng.uniform(0.5, 2, 9)))
    for knot in recording.times[1:-1]:
        d = 1e-6
        x = recording.resample(knot + d * np.array([-2, -1, 0, 1, 2]), "cubic", 9.0).positions[:, 0]
        from_left, from_right = (
            (3 * x[2] - 4 * x[1] + x[0]) / (2 * d),
            (-3 * x[2] + 4 * x[3] - x[4]) / (2 * d),
        )
        assert np.allclose(from_left, from_right, atol=1e-7)


def test_long_gaps_stay_open_and_do_not_bend_what_is_beside_them() -> None:
    recording = moving(frames=41)
    x = recording.positions.copy()
    x[10:20, 1] = NAN  # 0.09 to 0.20 s
    x[20:, 1] += 7.0  # a jump behind the gap must not show in the slope before it
    at = np.linspace(0, 0.4, 161)
    got = Recording(x, recording.times).resample(at, "cubic").positions[:, 1]
    inside = (at > 0.09 + 1e-9) & (at < 0.20 - 1e-9)
    assert np.isnan(got[inside]).all() and not np.isnan(got[~inside]).any()
    before = at <= 0.09
    expected = np.stack([np.ones_like(at), 2 * at, 4 * at**2], axis=1)
    assert np.abs(got[before] - expected[before]).max() < 1e-14
    closed = Recording(x, recording.times).resample(at, "cubic", max_gap=0.11)
    assert closed.mask.all()


def test_default_gap_bridges_two_lost_frames_and_not_three() -> None:
    at = moving().times
    assert with_gap(moving(), 0, slice(4, 6)).resample(at).mask.all()
    assert not with_gap(moving(), 0, slice(4, 7)).resample(at).mask[4:7, 0].any()


def test_resample_refuses_what_it_cannot_do() -> None:
    recording = moving()
    for arguments, words in (
        (([0.0, 0.3],), r"within the recording, 0 to 0.2 s \(got \(0.0, 0.3\)\)"),
        (([-0.1, 0.1],), "within the recording"),
        (([0.1, 0.1],), "repeats"),
        (([],), "shape"),
        (([0.1], "quintic"), "linear, cubic"),
        (([0.1], "cubic", -1.0), "max_gap"),
        (([0.1], "cubic", NAN), "max_gap"),
    ):
        with pytest.raises(RecordingError, match=words):
            recording.resample(*arguments)


def test_filled_closes_driven_markers_only() -> None:
    whole = moving(clamped=[0])
    gapped = with_gap(with_gap(whole, 0, slice(4, 6)), 1, slice(8, 10))
    filled = gapped.filled()
    assert np.abs(filled.positions[:, 0] - whole.positions[:, 0]).max() < 1e-15
    assert not filled.mask[8:10, 1].any() and filled.mask.sum() == whole.mask.sum() - 2
    assert moving().filled().mask.all()  # nothing clamped


@pytest.mark.parametrize(
    ("gap", "words"),
    [
        (slice(4, 8), r"'m0': is lost from 0.03 to 0.08 s, longer than max_gap = 0.035 s"),
        (slice(0, 2), r"'m0': is lost at an end .*within 0.02 to 0.2 s"),
        (slice(20, 21), r"'m0': is lost at an end .*within 0 to 0.19 s"),
    ],
)
def test_filled_refuses_what_it_cannot_close(gap: slice, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        with_gap(moving(clamped=[0]), 0, gap).filled()


def test_filled_accepts_slow_frames_without_a_gap() -> None:
    pause = Recording(np.zeros((4, 1, 3)), [0.0, 0.01, 0.02, 5.0], clamped=[0])
    assert pause.filled().mask.all()


# ---- noise and summary ----------------------------------------------------------------------------------


@pytest.mark.parametrize("uneven", [False, True])
def test_noise_is_found_under_motion(uneven: bool) -> None:
    """2,000 frames give the median a standard error near 4 %; the motion itself adds less than 1 %."""
    rng = np.random.default_rng(11)
    steps = rng.uniform(0.006, 0.014, 2000) if uneven else np.full(2000, 0.01)
    t = np.cumsum(steps)
    sigma = np.array([1e-5, 4e-4])
    clean = 0.02 * np.sin(2 * np.pi * 2 * t)[:, None, None] * np.ones((1, 2, 3))
    x = clean + sigma[:, None] * rng.normal(size=(2000, 2, 3))
    x[300:400, 0] = NAN
    x[1000:1010] += 0.5  # a burst of swaps must not count
    assert np.allclose(Recording(x, t).noise(), sigma, rtol=0.12)
    assert Recording(clean, t).noise().max() < 0.01 * 4e-4


def test_noise_counts_the_coordinates_that_are_measured() -> None:
    """Of a camera that tracks a plane it was sqrt(2/3) of what it is."""
    x = np.random.default_rng(5).normal(0.0, 1e-3, (400, 3, 3))
    x[..., 2] = 0.7
    assert np.allclose(Recording(x, np.arange(400) / 50).noise(), 1e-3, rtol=0.12)


def test_noise_is_unknown_for_short_recordings() -> None:
    assert np.isnan(moving(frames=4).noise()).all()
    assert np.isnan(Recording(np.zeros((1, 2, 3)), [0.0]).noise()).all()
    assert moving(frames=12).noise().max() < 1e-15


def test_summary_says_what_matters() -> None:
    source = {"source": {"attribution": "Copyright (c) 2020 A Laboratory"}}
    recording = moving(clamped=["m0"], name="swing", gravity=[0, 0, -9.81], metadata=source)
    text = recording.summary()
    for part in ("swing: 21 frames, 3 markers", "0 to 0.2 s, 100 Hz", "0.00%", "m0", "-9.81", "A Laboratory"):
        assert part in text
    assert Recording(np.zeros((1, 1, 3)), [0.0]).summary().startswith("recording: 1 frame, 1 marker\n")


def test_recordings_need_numpy_alone() -> None:
    program = (
        "import sys, sheetbend.recording.recording, sheetbend.recording.io, sheetbend.recording.baseline;"
        "print([m for m in ('scipy', 'torch', 'pandas', 'matplotlib') if m in sys.modules])"
    )
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "[]"
