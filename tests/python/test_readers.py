"""Files of recordings: round trips, both CSV layouts, the JSON beside, and every way a file can be wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sheetbend.errors import RecordingError
from sheetbend.files.names import flaw
from sheetbend.recording import io
from sheetbend.recording.recording import Recording

in_one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
coordinates = st.floats(-1e6, 1e6)
names = st.text(st.characters(codec="utf-8"), min_size=1, max_size=8).filter(
    lambda name: name.isprintable() and name == name.strip()
)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)
reserved = {"units", "name", "markers", "clamped", "gravity", "arrays"}


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    frames, markers = draw(st.integers(1, 6)), draw(st.integers(1, 4))
    times = sorted(draw(st.lists(coordinates, min_size=frames, max_size=frames, unique=True)))
    sample = st.just((np.nan,) * 3) | st.tuples(coordinates, coordinates, coordinates)
    first = draw(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=markers, max_size=markers))
    rest = draw(st.lists(sample, min_size=(frames - 1) * markers, max_size=(frames - 1) * markers))
    return Recording(
        positions=np.array(first + rest).reshape(frames, markers, 3),
        times=times,
        markers=draw(st.lists(names, min_size=markers, max_size=markers, unique=True)),
        clamped=draw(st.lists(st.integers(0, markers - 1), unique=True)),
        name=draw(names.filter(lambda name: flaw(name) is None)),
        gravity=draw(st.none() | st.tuples(coordinates, coordinates, coordinates)),
        metadata=draw(st.dictionaries(st.text().filter(lambda key: key not in reserved), json_values, max_size=3)),
    )


def assert_same(one: Recording, other: Recording) -> None:
    assert np.array_equal(one.positions, other.positions, equal_nan=True)
    assert np.array_equal(one.times, other.times)
    assert (one.markers, one.name, one.metadata) == (other.markers, other.name, other.metadata)
    assert one.clamped == other.clamped
    assert (one.gravity is None) == (other.gravity is None)
    assert one.gravity is None or np.array_equal(one.gravity, other.gravity)


@pytest.mark.slow
@in_one_folder
@given(recording=recordings(), suffix=st.sampled_from([".npz", ".csv", ".CSV", ".NPZ"]))
def test_saving_and_loading_give_the_same_bits(tmp_path: Path, recording: Recording, suffix: str) -> None:
    path = tmp_path / f"same{suffix}"
    recording.save(path)
    assert sorted(file.name for file in tmp_path.iterdir() if file.suffix == suffix) == [path.name]
    assert_same(Recording.load(path), recording)


@in_one_folder
@given(recording=recordings(), delimiter=st.sampled_from(",;\t"), seed=st.integers(0, 99))
def test_long_layout_reads_like_the_recording(tmp_path: Path, recording: Recording, delimiter, seed) -> None:
    """Rows in any order, unseen samples left out or empty; marker order is that of first mention."""
    plain = Recording(recording.positions, recording.times)
    rows = [
        delimiter.join([repr(t), marker, *("" if np.isnan(c) else repr(c) for c in x.tolist())])
        for t, frame in zip(plain.times.tolist(), plain.positions, strict=True)
        for marker, x in zip(plain.markers, frame, strict=True)
    ]
    first, rest = rows[: len(plain.markers)], rows[len(plain.markers) :]
    np.random.default_rng(seed).shuffle(rest)
    path = tmp_path / "long.csv"
    path.write_text("\n".join([delimiter.join(["time", "marker", "x", "y", "z"]), *first, *rest]))
    got = Recording.load(path)
    seen_frames = np.isin(plain.times, got.times)
    assert np.array_equal(got.positions, plain.positions[seen_frames], equal_nan=True)
    assert got.markers == plain.markers


# ---- CSV ------------------------------------------------------------------------------------------------


def csv_file(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_wide_csv_as_people_write_it(tmp_path: Path, delimiter: str) -> None:
    text = (
        "\ufeff# exported by hand; gaps are empty, or nan\r\n"
        "\r\n"
        "time, tip_x, tip_y, tip_z, left_grip_x, left_grip_y, left_grip_z\r\n"
        "0.0, 1, 2, 3, 4, 5, 6\r\n"
        "# lost once\r\n"
        "0.5, , , , nan, NaN, nan\r\n"
        "2.5, 1e-3, -2, +3.25, 4, 5, 6\r\n"
    )
    recording = Recording.load(csv_file(tmp_path, text.replace(",", delimiter)))
    assert recording.markers == ("tip", "left_grip")
    assert recording.times.tolist() == [0.0, 0.5, 2.5]
    assert recording.mask.tolist() == [[True, True], [False, False], [True, True]]
    assert recording.positions[2, 0].tolist() == [1e-3, -2.0, 3.25]
    assert recording.name == "table"


def test_long_csv_columns_go_by_name(tmp_path: Path) -> None:
    text = "time,z,marker,x,y\n0,3,a,1,2\n1,6,b,4,5\n"
    recording = Recording.load(csv_file(tmp_path, text))
    assert recording.markers == ("a", "b")
    assert recording.positions[0, 0].tolist() == [1.0, 2.0, 3.0]
    assert recording.mask.tolist() == [[True, False], [False, True]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,1,2,3\n", "line 1: must be a header whose first column is time"),
        ("when,a_x,a_y,a_z\n0,1,2,3\n", "line 1: must be a header"),
        ("time a_x a_y a_z\n0 1 2 3\n", "line 1: must be a header"),
        ("# nothing\n\n", "holds no header"),
        ("time,a_x,a_y,a_z\n", "no rows"),
        ("time,a_x,a_y,b_x,b_z\n0,1,2,3,4\n", "line 1: has only x and y of a marker"),
        ("time,a_x,a_z,a_y\n0,1,2,3\n", r"line 1: must have the column 'a_y' there \(got 'a_z'\)"),
        ("time,a,b,c\n0,1,2,3\n", r"line 1: must have the column 'a_x' there \(got 'a'\). Fix: name the columns"),
        ("time,a_x,a_y,a_z\n0,lost,lost,lost\n", r"line 2: holds a cell that is not a number .*an empty cell or nan"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n1,1,2\n", r"line 3: must have 4 cells, like the header \(got 3\)"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n1,1,2,3,4\n", "line 3: must have 4 cells"),
        ("#\ntime,a_x,a_y,a_z\n0,1,2,3\n\n1,one,2,3\n", r"line 5: holds a cell that is not a number .*'one'"),
        ("time;a_x;a_y;a_z\n0;1,5;2.5;3\n", "line 2: holds a cell that is not a number .*point"),
        ("time,a_x,a_y,a_z\n0,1_0,2,3\n", r"line 2: .* not a number .*1_0"),
        ("time,a_x,a_y,a_z\n0,inf,2,3\n", "line 2: holds an infinite number"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n,1,2,3\n", "line 3: must have a time later"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n-1,1,2,3\n", r"line 3: must have a time later .*'-1'"),
        ("time,a_x,a_y,a_z\n0,1,2,3\n0,1,2,4\n", "line 3: must have a time later"),
        ("time,a_x,a_y,a_z\n0,1,,3\n", "some coordinates only"),
        ("time,a_x,a_y,a_z\n0,,,\n", "never seen"),
        ("time,a_x,a_y,a_z,a_x,a_y,a_z\n0,1,2,3,1,2,3\n", "twice"),
        ('time,a_x,a_y,a_z\n0,"1,2,3\n', "line 2: is malformed"),
        ("time,marker,x,y,z\n0,a,1,2,3\n0,a,1,2,3\n", "line 3: repeats marker 'a' at the time of line 2"),
        ("time,marker,x,y,z\n,a,1,2,3\n", "line 2: must have a time"),
        ("time,marker,x,y,z\n0,,1,2,3\n", "no name"),
        ("time,marker,x,y\n0,a,1,2\n", "line 1: must have"),
    ],
)
def test_bad_csv_is_refused_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words) as caught:
        Recording.load(csv_file(tmp_path, text))
    assert "Fix: " in str(caught.value)


def test_csv_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "picture.csv"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    with pytest.raises(RecordingError, match="not UTF-8 text"):
        Recording.load(path)


# ---- NPZ ------------------------------------------------------------------------------------------------

X, T = np.arange(24.0).reshape(4, 2, 3), np.arange(4.0)


def npz_file(folder: Path, **arrays: object) -> Path:
    path = folder / "data.npz"
    np.savez(path, **arrays)
    return path


def test_npz_reads_its_keys_and_leaves_others(tmp_path: Path) -> None:
    path = npz_file(tmp_path, positions=X.astype(np.float32), times=T, clamped=np.array([1]), angles=T)
    recording = Recording.load(path)
    assert np.array_equal(recording.positions, X) and recording.clamped == (1,)
    assert Recording.load(npz_file(tmp_path, positions=X, times=T)).clamped == ()
    assert Recording.load(npz_file(tmp_path, positions=X, times=T, clamped=np.array([]))).clamped == ()


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        (
            {"x": X, "t": T},
            r"lacks positions and times \(got \['t', 'x'\]\).*positions \(frames, markers, 3\)",
        ),
        ({"positions": X}, r"lacks times \(got \['positions'\]\)"),
        ({}, r"lacks positions and times \(got \[\]\)"),
        ({"positions": X[:0], "times": T[:0]}, "at least one frame"),
        ({"positions": X, "times": T[:3]}, "one entry per frame, 4"),
        ({"positions": X, "times": T[::-1]}, "runs backwards"),
        ({"positions": X.astype(str), "times": T}, "positions: must be real numbers"),
        ({"positions": X, "times": T, "clamped": np.array([2])}, "clamped: is out of range"),
        (
            {"positions": X, "times": T, "clamped": np.array([0.5])},
            "clamped: must hold marker names or indices",
        ),
        (
            {"positions": np.array([X, None], dtype=object), "times": T},
            "positions: cannot be read.*plain numeric",
        ),
    ],
)
def test_bad_npz_is_refused(tmp_path: Path, arrays: dict, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(npz_file(tmp_path, **arrays))


def test_npz_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "data.npz"
    path.write_text("time,a_x,a_y,a_z\n")
    with pytest.raises(RecordingError, match="not an NPZ archive"):
        Recording.load(path)
    with path.open("wb") as file:
        np.save(file, X)
    with pytest.raises(RecordingError, match=r"single array \(NPY\)"):
        Recording.load(path)


@in_one_folder
@given(data=st.data())
def test_damaged_npz_is_refused_or_reads_the_same(tmp_path: Path, data: st.DataObject) -> None:
    """Truncation or one changed byte: never another exception, never other numbers."""
    path = tmp_path / "data.npz"
    Recording(X, T, clamped=[0]).save(path)
    content = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(1, len(content) - 1))]
    else:
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    try:
        recording = Recording.load(path)
    except RecordingError:
        return
    assert np.array_equal(recording.positions, X) and np.array_equal(recording.times, T)


# ---- any file -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_missing_and_empty_files_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"nothing{suffix}"
    with pytest.raises(RecordingError, match=rf"nothing{suffix}: is not a file"):
        Recording.load(path)
    path.touch()
    with pytest.raises(RecordingError, match=r"is empty .*0 bytes"):
        Recording.load(path)
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    with pytest.raises(RecordingError, match=rf"folder{suffix}: is a folder"):
        Recording.load(folder)


def test_a_name_that_is_spelled_wrong_is_mended(tmp_path: Path) -> None:
    (tmp_path / "take_1.csv").write_text("time,a_x,a_y,a_z\n0,1,2,3\n")
    with pytest.raises(RecordingError, match=r"tkae_1.csv: is not a file .*Fix: did you mean .*take_1.csv\?"):
        Recording.load(tmp_path / "tkae_1.csv")
    with pytest.raises(RecordingError, match="Fix: give a path; relative paths start at "):
        Recording.load(tmp_path / "nowhere" / "take_1.csv")


def test_unknown_suffix_and_folder_are_refused(tmp_path: Path) -> None:
    for name in ("motion.xyz", "motion"):
        with pytest.raises(RecordingError, match=r"suffix that no reader knows .*\.npz or \.csv"):
            Recording.load(tmp_path / name)
        with pytest.raises(RecordingError, match="suffix"):
            Recording(X, T).save(tmp_path / name)
    with pytest.raises(RecordingError, match="folder that does not exist"):
        Recording(X, T).save(tmp_path / "none" / "motion.npz")


@pytest.mark.parametrize("between", [":", ".", "_", " "])
@pytest.mark.parametrize("begin", ["t", "frame,time", "Frame,Time (s)", "Frame#,t"])
def test_headers_as_motion_capture_writes_them(tmp_path: Path, between: str, begin: str) -> None:
    """`M01:X`, a column of frames before the time, and `t` were refused."""
    names = [f"arm:M0{k}{between}{axis}" for k in (1, 2) for axis in "XYZ"]
    count = begin.count(",")
    rows = [",".join([*["7"] * count, f"0.{k}", *(f"{k}.{c}" for c in range(6))]) for k in range(3)]
    (tmp_path / "take.csv").write_text("\n".join([",".join([begin, *names]), *rows]))
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("arm:M01", "arm:M02") and got.times.tolist() == [0.0, 0.1, 0.2]
    assert got.positions[1].ravel().tolist() == [1.0, 1.1, 1.2, 1.3, 1.4, 1.5]


def test_frames_without_a_time_are_refused(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("frame,a_x,a_y,a_z\n0,1,2,3\n")
    with pytest.raises(RecordingError, match="first column is time"):
        Recording.load(tmp_path / "take.csv")


TRC = (
    "PathFileType\t4\t(X/Y/Z)\ttake.trc\t\r\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\r\n"
    "100.00\t100.00\t3\t2\tmm\t100.00\t1\t3\r\n"
    "Frame#\tTime\thand\t\t\ttip\t\t\r\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\r\n"
    "\r\n"
    "1\t0.00\t1\t2\t3\t4\t5\t6\t\r\n"
    "2\t0.01\t1.5\t2\t3\r\n"
    "3\t0.02\t2\t2\t3\t4\t5\t7\r\n"
)


def test_a_trc_file(tmp_path: Path) -> None:
    (tmp_path / "take.trc").write_text(TRC, newline="")
    got = Recording.load(tmp_path / "take.trc")
    assert got.markers == ("hand", "tip") and got.times.tolist() == [0.0, 0.01, 0.02] and got.gravity is None
    assert got.positions[2].tolist() == [[0.002, 0.002, 0.003], [0.004, 0.005, 0.007]]
    assert got.mask.tolist() == [[True, True], [True, False], [True, True]]
    with pytest.raises(RecordingError, match="differ from the file's, mm"):
        Recording.load(tmp_path / "take.trc", units="m")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("PathFileType", "Path", "is not a TRC file"),
        ("\tmm\t", "\tinch\t", "line 3: names no length unit"),
        ("Frame#", "Index", "line 4: must begin with Frame#"),
        ("hand\t\t\ttip", "hand\t\ttip\t", "line 4: must name a marker in every third column"),
        ("X2\tY2", "Y2\tX2", "line 5: must name the axes"),
        ("1.5", "1,5", "line 8: holds a cell that is not a number"),
        ("5\t7", "5\t7\t8", "line 9: must have at most 8 cells"),
    ],
)
def test_a_damaged_trc_file_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "take.trc").write_text(TRC.replace(old, new), newline="")
    with pytest.raises(RecordingError, match=words):
        Recording.load(tmp_path / "take.trc")


def test_a_format_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Constant:
        @staticmethod
        def read(path: Path) -> Recording:
            return Recording(X, T)

    monkeypatch.setitem(io.FORMATS, ".fixed", Constant)
    path = tmp_path / "a.fixed"
    path.write_text("anything")
    assert np.array_equal(Recording.load(path, units="mm").positions, X * 1e-3)


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
@pytest.mark.parametrize("clamped", [[0, 1, 4, 5], ["m0", "m1", "m4", "m5"]])
def test_driven_markers_of_a_rope_come_from_the_json_of_either_format(
    tmp_path: Path, suffix: str, clamped: list[object]
) -> None:
    """(frames, markers, 3) with the indices of the markers that the two grips drive."""
    path = tmp_path / f"rope{suffix}"
    x = np.random.default_rng(1).normal(size=(3, 6, 3))
    Recording(x, [0.0, 0.01, 0.02]).save(path)
    assert Recording.load(path).clamped == ()
    path.with_suffix(".json").write_text(json.dumps({"clamped": clamped}))
    recording = Recording.load(path)
    assert recording.clamped == (0, 1, 4, 5) and recording.free == (2, 3)
    assert np.array_equal(recording.positions, x)
    path.with_suffix(".json").write_text('{"clamped": [0, 1, -2, -1]}')
    with pytest.raises(RecordingError, match=r"clamped: is out of range for 6 markers \(got -2\).*0 to 5"):
        Recording.load(path)


# ---- the JSON beside ------------------------------------------------------------------------------------


def with_json(folder: Path, content: object, **arrays: object) -> Path:
    path = npz_file(folder, **{"positions": X, "times": T, **arrays})
    path.with_suffix(".json").write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_json_says_what_the_numbers_mean(tmp_path: Path) -> None:
    beside = {
        "units": "mm, s, N",
        "name": "swing 3",
        "markers": ["grip", "tip"],
        "clamped": ["grip"],
        "gravity": [0, 0, -9.81],
        "known": {"length": 0.3},
        "attribution": "Copyright (c) 2020 A Laboratory",
        "arrays": {"positions": [[4, 2, 3], "float64"]},
    }
    recording = Recording.load(with_json(tmp_path, beside))
    assert np.array_equal(recording.positions, X * 1e-3)
    assert (recording.name, recording.markers, recording.clamped) == ("swing 3", ("grip", "tip"), (0,))
    assert recording.gravity.tolist() == [0.0, 0.0, -9.81]
    kept = {"known": beside["known"], "attribution": beside["attribution"], "units_note": "mm, s, N"}
    assert recording.metadata == kept


@pytest.mark.parametrize(("units", "meters"), [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)])
def test_units_scale_lengths(tmp_path: Path, units: str, meters: float) -> None:
    path = with_json(tmp_path, {"units": units})
    assert np.array_equal(Recording.load(path).positions, X * meters)
    assert np.array_equal(Recording.load(path, units="cm").positions, X * 1e-2)  # the argument wins
    assert Recording.load(path).metadata == {}


def test_remarks_are_kept_and_the_file_rules(tmp_path: Path) -> None:
    beside = {"clamped": "both ends, to a few degrees", "markers": "51 points"}
    recording = Recording.load(with_json(tmp_path, beside, clamped=np.array([1, 0])))
    assert recording.clamped == (1, 0) and recording.markers == ("m0", "m1")
    assert recording.metadata == {f"{key}_note": text for key, text in beside.items()}
    agreeing = Recording.load(with_json(tmp_path, {"clamped": [0, "m1"]}, clamped=np.array([1, 0])))
    assert agreeing.clamped == (1, 0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "malformed JSON .*line 1 column 2"),
        ([1], "must be a JSON object"),
        ({"units": "inch"}, r"units: names no known length unit \(got 'inch'\).*m, cm, mm"),
        ({"units": "px of the image"}, "units: names no known length unit"),
        ({"units": 1}, "units: names no known length unit"),
        ({"markers": ["one"]}, "markers: must be one name per marker"),
        ({"markers": 7}, "markers: must be a list"),
        ({"clamped": [5]}, "clamped: is out of range"),
        ({"clamped": ["tip"]}, "clamped: names an unknown marker"),
        ({"clamped": 1}, "clamped: must be a list"),
        ({"gravity": 9.81}, "gravity: must be three finite numbers"),
        ({"name": 3}, "name: must be a non-empty string"),
    ],
)
def test_bad_json_is_refused(tmp_path: Path, content: object, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(with_json(tmp_path, content))


def test_json_that_disagrees_is_refused(tmp_path: Path) -> None:
    path = with_json(tmp_path, {"clamped": [0]}, clamped=np.array([1]))
    with pytest.raises(RecordingError, match=r"clamped: in the JSON differs .*got \[0\].*\[1\]"):
        Recording.load(path)
    table = csv_file(tmp_path, "time,a_x,a_y,a_z\n0,1,2,3\n")
    table.with_suffix(".json").write_text('{"markers": ["b"]}')
    with pytest.raises(RecordingError, match=r"markers: in the JSON differ .*\['b'\].*\['a'\]"):
        Recording.load(table)


def test_metadata_must_fit_the_json(tmp_path: Path) -> None:
    for metadata, words in (
        ({"units": "mm"}, "reserved key"),
        ({"density": np.ones(2)}, "cannot be written"),
    ):
        with pytest.raises(RecordingError, match=words):
            Recording(X, T, metadata=metadata).save(tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []
