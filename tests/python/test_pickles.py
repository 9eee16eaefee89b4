"""Pickles of rope recordings: every way NumPy writes them is read, and nothing that a file names is run."""

from __future__ import annotations

import builtins
import copyreg
import json
import os
import pickle
import pickletools
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sheetbend.errors import RecordingError
from sheetbend.recording.io import plain_pickle
from sheetbend.recording.recording import Recording

RNG = np.random.default_rng(7)
FRAMES = [RNG.normal(size=(3, 6)) for _ in range(5)]
POSITIONS = np.ascontiguousarray(np.stack(FRAMES).transpose(0, 2, 1))
PROTOCOLS = range(6)


def stored(folder: Path, content: object, protocol: int = 4) -> Path:
    path = folder / "motion.pkl"
    path.unlink(missing_ok=True)  # a file that is written over waits for the disk, a new one does not
    path.write_bytes(content if isinstance(content, bytes) else pickle.dumps(content, protocol=protocol))
    return path


# ---- what NumPy writes ----------------------------------------------------------------------------------


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_list_of_frames_is_read(tmp_path: Path, protocol: int) -> None:
    recording = Recording.load(stored(tmp_path, FRAMES, protocol))
    assert np.array_equal(recording.positions, POSITIONS)
    assert recording.times.tolist() == [0.0, 0.01, 0.02, 0.03, 0.04]
    assert recording.clamped == (0, 1, 4, 5) and recording.free == (2, 3)
    assert recording.name == "motion" and recording.gravity is None


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(
    "content",
    [
        np.stack(FRAMES),
        POSITIONS.transpose(0, 2, 1),  # in neither order in memory
        np.asfortranarray(np.stack(FRAMES)),
        tuple(FRAMES),
        [np.asfortranarray(frame) for frame in FRAMES],
        [frame.astype(">f8") for frame in FRAMES],
        np.stack(FRAMES).tolist(),
        [[list(row) for row in frame] for frame in FRAMES],
        [tuple(map(tuple, frame.tolist())) for frame in FRAMES],
    ],
    ids=[
        "array",
        "view",
        "columns first",
        "tuple",
        "frames by columns",
        "big-endian",
        "lists of floats",
        "lists of NumPy floats",
        "tuples of floats",
    ],
)
def test_every_form_of_the_same_numbers_is_read(tmp_path: Path, content: object, protocol: int) -> None:
    assert np.array_equal(Recording.load(stored(tmp_path, content, protocol)).positions, POSITIONS)


@pytest.mark.parametrize("number", ["f2", "f4", "<f8", ">f4", "i1", "i2", ">i4", "i8", "u1", "u2", "u4", "u8"])
def test_every_type_of_number_is_read(tmp_path: Path, number: str) -> None:
    whole = [np.arange(18).reshape(3, 6).astype(number) for _ in range(2)]
    assert np.array_equal(Recording.load(stored(tmp_path, whole)).positions, np.stack(whole).transpose(0, 2, 1))


def respelled(content: bytes, module: str, other: str) -> bytes:
    """The same pickle with another module name; frames, whose lengths would be wrong, are taken out."""
    starts = [at for code, _, at in pickletools.genops(content) if code.name == "FRAME" and at is not None]
    for at in reversed(starts):
        content = content[:at] + content[at + 9 :]
    content = content.replace(f"c{module}\n".encode(), f"c{other}\n".encode())
    short = [b"\x8c" + bytes([len(name)]) + name.encode() for name in (module, other)]
    return content.replace(*short)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_both_spellings_of_the_core_are_read(tmp_path: Path, protocol: int) -> None:
    """NumPy 1 writes numpy.core, NumPy 2 numpy._core."""
    content = pickle.dumps(FRAMES, protocol=protocol)
    for part in ("multiarray", "numeric"):
        for old, new in (("numpy._core", "numpy.core"), ("numpy.core", "numpy._core")):
            other = respelled(content, f"{old}.{part}", f"{new}.{part}")
            assert np.array_equal(Recording.load(stored(tmp_path, other)).positions, POSITIONS)
    names = (b"numpy.core.", b"numpy._core.")
    assert sum(name in content for name in names) == 1  # one of the two was replaced


def test_single_numbers_are_read_as_such(tmp_path: Path) -> None:
    first, second = plain_pickle.arrays(stored(tmp_path, [np.float64(2.5), np.int32(7)]))
    assert (first, first.shape, second, second.dtype) == (2.5, (), 7, np.int32)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    frames=st.integers(1, 5),
    markers=st.integers(1, 7),
    rate=st.sampled_from([100.0, 29.97, 1e-3, 1 / 3, 1e6]),
    clamped=st.lists(st.integers(0, 6), unique=True),
    suffix=st.sampled_from([".pkl", ".pickle", ".PKL"]),
    seed=st.integers(0, 2**32 - 1),
)
def test_saving_and_loading_give_the_same_recording(
    tmp_path: Path, frames: int, markers: int, rate: float, clamped: list[int], suffix: str, seed: int
) -> None:
    positions = np.random.default_rng(seed).normal(size=(frames, markers, 3))
    positions[1:, -1] = np.nan
    clamped = [i for i in clamped if i < markers]
    times = np.arange(frames) / rate
    names = [f"marker {i}" for i in range(markers)]
    saved = Recording(positions, times, names, clamped, "swing", (0, -9.81, 0), {"note": "by hand"})
    path = tmp_path / f"same{suffix}"
    saved.save(path)
    loaded = Recording.load(path)
    assert np.array_equal(loaded.positions, positions, equal_nan=True)
    assert np.abs(loaded.times - times).max() <= 1e-6 / rate
    assert (loaded.markers, loaded.clamped, loaded.name) == (saved.markers, tuple(clamped), "swing")
    assert loaded.gravity.tolist() == [0, -9.81, 0] and loaded.metadata == {"note": "by hand"}
    written = pickle.loads(path.read_bytes())  # what other programs find
    assert type(written) is list and {frame.shape for frame in written} == {(3, markers)}


# ---- what would run -------------------------------------------------------------------------------------


class Calls:
    """Pickles to a call."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self.call


def nested(target: Path) -> Path:
    """An NPY file whose objects make the target when they are read."""
    path = target.with_name("nested.npy")
    np.save(path, np.array([Calls(os.mkdir, str(target))], dtype=object), allow_pickle=True)
    return path


ATTACKS: dict[str, tuple[Callable[[Path], object], str]] = {
    "os.system": (lambda target: Calls(os.system, f"mkdir '{target}'"), r"posix\.system"),
    "os.mkdir in a list": (lambda target: [FRAMES[0], Calls(os.mkdir, str(target))], r"posix\.mkdir"),
    "subprocess": (lambda target: Calls(subprocess.check_call, ["mkdir", str(target)]), r"\.check_call"),
    "eval": (lambda target: Calls(builtins.eval, f"__import__('os').mkdir({str(target)!r})"), r"eval"),
    "exec": (lambda target: Calls(builtins.exec, f"import os; os.mkdir({str(target)!r})"), r"exec"),
    "getattr": (lambda target: Calls(getattr, Calls(Path, str(target)), "mkdir"), r"getattr"),
    "numpy.load": (lambda target: Calls(np.load, str(nested(target)), None, True), r"numpy\.load"),
    "object array": (lambda target: np.array([Calls(os.mkdir, str(target)), None], dtype=object), r"'O8'"),
    "global": (lambda target: f"cos\nmkdir\n(V{target}\ntR.".encode(), r"os\.mkdir"),
    "inst": (lambda target: f"(V{target}\nios\nmkdir\n.".encode(), r"os\.mkdir"),
    "obj": (lambda target: f"(cpathlib\nPath\nV{target}\no.".encode(), r"pathlib\.Path"),
    "stack global": (
        lambda target: b"\x8c\x02os\x8c\x05mkdir\x93" + f"(V{target}\ntR.".encode(),
        r"os\.mkdir",
    ),
    "dotted name": (
        lambda target: b"\x80\x04\x8c\x05numpy\x8c\x08os.mkdir\x93" + f"(V{target}\ntR.".encode(),
        r"numpy\.os\.mkdir",
    ),
    "newobj": (lambda target: b"\x80\x02csubprocess\nPopen\n)\x81.", r"subprocess\.Popen"),
}
RUNS = [name for name in ATTACKS if name not in ("getattr", "obj", "dotted name", "newobj")]


@pytest.mark.parametrize("name", ATTACKS)
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_nothing_is_run(tmp_path: Path, name: str, protocol: int) -> None:
    make, named = ATTACKS[name]
    target = tmp_path / "made"
    path = stored(tmp_path, make(target), protocol)
    with pytest.raises(RecordingError, match=named) as caught:
        Recording.load(path)
    assert not target.exists() and "motion.pkl" in str(caught.value) and "Fix: " in str(caught.value)
    if name in RUNS:  # else the test would show nothing
        pickle.loads(path.read_bytes())
        assert target.is_dir()


def test_what_the_program_registered_is_not_run(tmp_path: Path) -> None:
    """A pickle can name a function by a number of `copyreg`; the unpickler's cache of those asks nobody."""
    target = tmp_path / "made"
    copyreg.add_extension("posix", "mkdir", 240)
    try:
        path = stored(tmp_path, Calls(os.mkdir, str(target)), 2)
        assert b"\x82\xf0" in path.read_bytes()
        pickle.loads(path.read_bytes())
        target.rmdir()
        with pytest.raises(RecordingError, match="extension code 240"):
            Recording.load(path)
        assert not target.exists()
    finally:
        copyreg.remove_extension("posix", "mkdir", 240)


@pytest.mark.parametrize(
    "content",
    [
        {"forces": FRAMES[0]},
        {1: FRAMES},
        {"left": FRAMES, "right": FRAMES},
        [{"positions": FRAMES[0]}],
        [np.ma.masked_array(FRAMES[0])],
        [np.array(["a"])],
        [np.array([1 + 2j])],
        [np.array([True])],
        [np.zeros(2, dtype=[("x", "f8")])],
        [np.datetime64("2020-01-01")],
        FRAMES[0].tolist(),
        "text",
        None,
        7.5,
        [None, None],
        [FRAMES[0], [FRAMES[1]]],
        [np.float64],
        [np.dtype("f8")],
        [np.ndarray],
    ],
    ids=str,
)
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_only_arrays_of_numbers_are_read(tmp_path: Path, content: object, protocol: int) -> None:
    with pytest.raises(RecordingError, match=r"motion\.pkl.*Fix: "):
        Recording.load(stored(tmp_path, content, protocol))


RECONSTRUCT = b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K\x00tC\x01btR"
DOUBLE = b"cnumpy\ndtype\n(X\x02\x00\x00\x00f8\x89\x88tR"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (RECONSTRUCT + b".", "without numbers"),  # NumPy's own would give memory that was never written
        (RECONSTRUCT + b"(K\x01(K\x05t" + DOUBLE + b"\x89C\x08" + bytes(8) + b"tb.", r"shape \(5,\).* 8 bytes"),
        (RECONSTRUCT + b"(K\x01(J\xff\xff\xff\xffJ\xff\xff\xff\xfft" + DOUBLE + b"\x89C\x08" + bytes(8) + b"tb.", "-1"),
        (RECONSTRUCT + b"(K\x01(K\x01t" + DOUBLE + b"\x89](NNetb.", "from list"),
        (DOUBLE + b"(K\x03X\x01\x00\x00\x00?NNNtb.", r"byte order '\?'"),
        (b"cnumpy\nndarray\n(K\x03tR.", "damaged"),
        (b"cnumpy\nndarray\nN}X\x04\x00\x00\x00fillNs\x86b.", "damaged"),
        (b"c_codecs\nencode\nN}X\x0c\x00\x00\x00__defaults__)s\x86b.", "damaged"),
        (b"c_codecs\nencode\n(X\x01\x00\x00\x00aX\x05\x00\x00\x00utf_7tR.", "utf_7"),
        (b"\x80\x02Nr\xff\xff\xff\x7f.", "memo index 2147483647"),  # pickle.load would reserve 32 GB for this
        (b"\x80\x04\x8e\xff\xff\xff\xff\xff\x00\x00\x00.", "damaged"),
        (b"\x80\x02X\x01\x00\x00\x00aQ.", "BINPERSID"),
        (b"\x80\x05\x97.", "NEXT_BUFFER"),
        (b"\x80\x09N.", "protocol"),
        (b"N.N.", "goes on after the end.*2 bytes"),
        (b"](h\x00e.", "damaged"),
        (b"time,a_x,a_y,a_z\n0,1,2,3\n", "not a pickle"),
        (b"\x93NUMPY\x01\x00v\x00", "not a pickle"),
    ],
)
def test_a_damaged_or_forged_stream_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(stored(tmp_path, content))
    assert np.array_equal(Recording.load(stored(tmp_path, FRAMES)).positions, POSITIONS)  # and nothing stays behind


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_truncated_pickle_is_refused(tmp_path: Path, protocol: int) -> None:
    content = pickle.dumps(FRAMES[:2], protocol=protocol)
    for length in range(1, len(content)):
        with pytest.raises(RecordingError, match=r"motion\.pkl"):
            Recording.load(stored(tmp_path, content[:length]))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=300)
@given(protocol=st.sampled_from(PROTOCOLS), at=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_one_changed_byte_ends_in_a_recording_or_its_error(tmp_path: Path, protocol: int, at: float, flip: int) -> None:
    """A pickle has no checksum, so other numbers can come out, but no other exception."""
    content = bytearray(pickle.dumps(FRAMES[:2], protocol=protocol))
    content[int(at * len(content))] ^= flip
    try:
        recording = Recording.load(stored(tmp_path, bytes(content)))
    except RecordingError:
        return
    assert isinstance(recording, Recording)


# ---- the layout -----------------------------------------------------------------------------------------


def lost(marker: int) -> list[np.ndarray]:
    return [np.where(np.arange(6) == marker, np.nan, frame) for frame in FRAMES]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ([], "holds no frame"),
        ([frame.T for frame in FRAMES], r"frame 0: must have the shape \(3, markers\) \(got \(6, 3\)\)"),
        (POSITIONS, r"frame 0: must have the shape \(3, markers\) \(got \(6, 3\)\)"),
        (FRAMES[0], r"must have the shape \(frames, 3, markers\) \(got \(3, 6\)\)"),
        ([FRAMES[0], FRAMES[1][:, :5]], r"frame 1: has another number of markers \(got 5\).*6"),
        ([FRAMES[0], np.stack(FRAMES)], "frame 1: must have the shape"),
        ([np.float64(1.0)], r"frame 0: must have the shape .*\(got \(\)\)"),
        ([np.full((3, 6), np.nan)], "never seen"),
        (np.stack([FRAMES, FRAMES]), r"\(got \(2, 5, 3, 6\)\).* seems to hold 2 recordings"),
        (POSITIONS.reshape(5, 18), r"\(got \(5, 18\)\).*reshape\(len\(x\), -1, 3\)"),
        ([np.where(frame == frame[0], np.nan, frame) for frame in FRAMES], "some coordinates only"),
        ([np.full((3, 6), np.inf)], "infinite"),
    ],
)
def test_another_shape_is_refused(tmp_path: Path, content: object, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(stored(tmp_path, content))


@pytest.mark.parametrize("form", [np.asarray, np.ndarray.tolist, list], ids=["array", "lists", "list of arrays"])
@pytest.mark.parametrize("axes", [(0, 2, 1), (1, 2, 0), (1, 0, 2), (2, 1, 0)])
def test_another_order_of_axes_is_refused_with_what_puts_it_right(
    tmp_path: Path, axes: tuple[int, ...], form: Callable[[np.ndarray], object]
) -> None:
    """A minute of frames (3, markers): the fix, done to the file's numbers, is read."""
    right = RNG.normal(size=(600, 3, 12))
    wrong = np.ascontiguousarray(right.transpose(axes))
    with pytest.raises(RecordingError) as caught:
        Recording.load(stored(tmp_path, form(wrong)))
    told = caught.value.fix.partition("numpy.transpose(x, (")[2].partition(")")[0]
    put_right = wrong.transpose([int(k) for k in told.split(",")])
    np.testing.assert_array_equal(put_right, right)
    assert Recording.load(stored(tmp_path, form(np.ascontiguousarray(put_right)))).positions.shape == (600, 12, 3)


def moving(frames: int = 60, markers: int = 12) -> np.ndarray:
    """(frames, 3, markers): a chain that swings, as no random numbers do."""
    t, s = np.arange(frames)[:, None] / 100, 0.08 * np.arange(markers)
    return np.stack([s + 0.0 * t, 0.2 * np.sin(4.0 * t + s), 0.1 * s * (s - 1.0) + 0.0 * t], axis=1)


@pytest.mark.parametrize("form", [np.asarray, np.ndarray.tolist, list], ids=["array", "lists", "list of arrays"])
@pytest.mark.parametrize("axes", [(0, 2, 1), (1, 2, 0), (1, 0, 2), (2, 1, 0), (2, 0, 1)])
def test_another_order_of_axes_is_read_where_the_motion_shows_it(
    tmp_path: Path, axes: tuple[int, ...], form: Callable[[np.ndarray], object]
) -> None:
    right = moving()
    path = stored(tmp_path, form(np.ascontiguousarray(right.transpose(axes))))
    recording = Recording.load(beside(path, rate=100))
    assert np.array_equal(recording.positions, right.transpose(0, 2, 1)) and recording.clamped == (0, 1, 10, 11)
    told = [("frames", "coordinates", "markers")[k] for k in axes]
    expected = f"its axes are ({', '.join(told)}) instead of (frames, coordinates, markers), and are taken as such"
    assert recording.mends == [expected]


@pytest.mark.parametrize("axes", [(0, 1, 2), (0, 2, 1), (2, 1, 0)])
@pytest.mark.parametrize(("unit", "first"), [(1.0, False), (1e3, True), (1e9, False)])
def test_times_beside_the_coordinates_are_read(tmp_path: Path, axes: tuple[int, ...], unit: float, first: bool) -> None:
    right = moving()
    times = 5.0 + np.arange(60) / 120
    rows = np.broadcast_to(unit * times[:, None, None], (60, 1, 12))
    timed = np.concatenate([rows, right] if first else [right, rows], axis=1)
    recording = Recording.load(stored(tmp_path, np.ascontiguousarray(timed.transpose(axes))))
    assert np.array_equal(recording.positions, right.transpose(0, 2, 1))
    np.testing.assert_allclose(recording.times, times - 5.0, atol=1e-6)
    assert recording.mends[-1].startswith(f"the row of number {0 if first else 3} beside its coordinates")
    rows = rows[::-1]  # which do not rise
    with pytest.raises(RecordingError, match="must have the shape"):
        Recording.load(stored(tmp_path, np.concatenate([right, rows], axis=1)))


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", ["positions", "Markers", "x"])
def test_a_dict_with_markers_is_read(tmp_path: Path, name: str, protocol: int) -> None:
    times = np.array([3.0, 3.01, 3.03, 3.04, 3.05])
    beside_them = {"names": list("abcdef"), "time": times, "note": "first", "forces": np.zeros((5, 3))}
    recording = Recording.load(stored(tmp_path, {name: FRAMES, **beside_them}, protocol))
    assert np.array_equal(recording.positions, POSITIONS) and recording.mends == []
    np.testing.assert_allclose(recording.times, times - 3.0)
    rated = Recording.load(stored(tmp_path, {name: POSITIONS.transpose(0, 2, 1), "fps": 240}, protocol))
    np.testing.assert_allclose(rated.times, np.arange(5) / 240)


def test_times_and_markers_of_a_dict_that_are_wrong_are_refused(tmp_path: Path) -> None:
    for times in (np.arange(4.0), np.array([0.0, 1.0, 1.0, 2.0, 3.0])):
        with pytest.raises(RecordingError, match="must be 5 rising times, one for each frame"):
            Recording.load(stored(tmp_path, {"positions": FRAMES, "time": times}))
    with pytest.raises(RecordingError, match="entry 0"):
        Recording.load(stored(tmp_path, {"positions": [[[1.0, 2.0], [3.0], [4.0]]] * 5}))
    silent = Recording.load(stored(tmp_path, {"positions": FRAMES, "rate": None}))
    np.testing.assert_allclose(silent.times, np.arange(5) / 100)


def test_frames_that_hold_nothing_show_no_marker(tmp_path: Path) -> None:
    for nothing in (None, [], np.zeros((3, 0))):
        recording = Recording.load(stored(tmp_path, [FRAMES[0], nothing, *FRAMES[2:]]))
        assert np.isnan(recording.positions[1]).all() and np.array_equal(recording.positions[2:], POSITIONS[2:])
        assert recording.mends[0] == "1 of 5 frames hold nothing: no marker is seen there"
    rows = [[[None if np.isnan(x) else x for x in row] for row in frame.tolist()] for frame in lost(2)[:4]]
    assert np.isnan(Recording.load(stored(tmp_path, [*rows, FRAMES[4].tolist()])).positions[:4, 2]).all()


def test_a_marker_that_is_never_seen_is_left_out(tmp_path: Path) -> None:
    recording = Recording.load(stored(tmp_path, lost(2)))
    assert recording.markers == ("m0", "m1", "m3", "m4", "m5") and recording.clamped == (0, 1, 3, 4)
    assert "m2 of 6 markers is never seen: left out" in recording.mends


def test_a_rate_that_is_assumed_is_told(tmp_path: Path) -> None:
    path = stored(tmp_path, FRAMES)
    (said,) = Recording.load(path).mends
    assert said.startswith("no rate is told: 100 frames per second are assumed")
    assert Recording.load(beside(path, rate=100)).mends == []
    path.with_suffix(".json").unlink()
    folder = path.parent / "train"
    folder.mkdir()
    beside(folder, rate=50, units="mm", markers=6, name="all of them")  # of these, what can hold for all files
    other = Recording.load(path.rename(folder / path.name))
    assert other.times[1] == 0.02 and other.mends == [] and other.name == "motion"
    np.testing.assert_allclose(other.positions, 1e-3 * POSITIONS)
    assert Recording.load(beside(folder / path.name, rate=25)).times[1] == 0.04  # its own counts


def beside(path: Path, **content: object) -> Path:
    path.with_suffix(".json").write_text(json.dumps(content))
    return path


def test_the_json_replaces_what_is_assumed(tmp_path: Path) -> None:
    path = beside(
        stored(tmp_path, FRAMES),
        units="mm",
        rate=120,
        clamped=["a", "f"],
        markers=list("abcdef"),
        gravity=[0, -9.81, 0],
        name="rope 1",
    )
    recording = Recording.load(path)
    assert np.array_equal(recording.positions, POSITIONS * 1e-3)
    assert np.array_equal(recording.times, np.arange(5) / 120)
    assert (recording.clamped, recording.name, recording.markers) == ((0, 5), "rope 1", tuple("abcdef"))
    assert recording.gravity.tolist() == [0, -9.81, 0] and recording.metadata == {}
    assert Recording.load(beside(path, clamped=[])).clamped == ()
    assert Recording.load(beside(path, clamped="by the robots")).clamped == (0, 1, 4, 5)


@pytest.mark.parametrize("markers", [1, 2, 3, 4])
def test_few_markers_are_all_in_a_grip_unless_the_json_says_other(tmp_path: Path, markers: int) -> None:
    path = stored(tmp_path, [frame[:, :markers] for frame in FRAMES])
    assert Recording.load(path).clamped == tuple(range(markers))
    assert Recording.load(beside(path, clamped=[0])).clamped == (0,)


@pytest.mark.parametrize("rate", [0, -100, True, "100", None, float("inf"), float("nan")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate: object) -> None:
    with pytest.raises(RecordingError, match="rate: must be a positive number"):
        Recording.load(beside(stored(tmp_path, FRAMES), rate=rate))


def test_a_rate_beside_a_file_with_times_is_metadata(tmp_path: Path) -> None:
    path = tmp_path / "motion.npz"
    Recording(POSITIONS, np.arange(5.0), metadata={"rate": 7}).save(path)
    assert Recording.load(path).metadata == {"rate": 7} and Recording.load(path).times[-1] == 4.0
    with pytest.raises(RecordingError, match="reserved key"):
        Recording.load(path).save(path.with_suffix(".pkl"))


@pytest.mark.parametrize("times", [[0.0, 0.01, 0.03], [1.0, 1.01, 1.02], [-0.02, -0.01, 0.0], [0.0, 1e-320, 2e-320]])
def test_times_that_the_layout_cannot_tell_are_not_written(tmp_path: Path, times: list[float]) -> None:
    with pytest.raises(RecordingError, match="times: must run evenly from 0 s"):
        Recording(POSITIONS[:3], times).save(tmp_path / "a.pkl")
    with pytest.raises(RecordingError, match="times: must run evenly from 0 s"):
        Recording(POSITIONS[:1], [0.5]).save(tmp_path / "a.pkl")
    assert list(tmp_path.iterdir()) == []
