"""Folders of recordings: all of them, once, in order, and errors that say which file or folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

X, T = np.arange(36.0).reshape(2, 6, 3), [0.0, 0.01]


def dataset(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        sb.Recording(X, T, name=path.stem, clamped=[0, 1, 4, 5]).save(path)
    return folder


def test_train_and_eval_are_read_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    dataset(tmp_path / "train", "100.pkl", "9.pkl", "10.pkl", "9b.pickle")
    dataset(tmp_path / "eval", "2.npz", "1.csv")
    (tmp_path / "train" / "readme.txt").write_text("not a recording")
    train, unseen = (sb.read_recordings(tmp_path / part) for part in ("train", "eval"))
    assert [r.name for r in train] == ["9", "9b", "10", "100"]
    assert [r.name for r in unseen] == ["1", "2"]
    assert all(r.clamped == (0, 1, 4, 5) and np.array_equal(r.positions, X) for r in [*train, *unseen])


def test_the_pattern_and_the_units_are_used(tmp_path: Path) -> None:
    dataset(tmp_path, "a.npz", "b.csv", "rope/c.npz")
    assert [r.name for r in sb.read_recordings(str(tmp_path), "*.csv")] == ["b"]
    assert [r.name for r in sb.read_recordings(tmp_path, "**/*.npz")] == ["a", "c"]
    assert [r.name for r in sb.read_recordings(tmp_path, "*/*")] == ["c"]
    (tmp_path / "a.json").unlink()
    assert np.array_equal(sb.read_recordings(tmp_path, "a*", units="mm")[0].positions, X * 1e-3)


def test_a_table_that_ends_in_txt_is_read_where_the_pattern_says_so(tmp_path: Path) -> None:
    dataset(tmp_path, "swing.csv")
    (tmp_path / "swing.csv").rename(tmp_path / "swing.txt")
    (tmp_path / "swing.json").unlink()
    assert [r.name for r in sb.read_recordings(tmp_path, "*.txt")] == ["swing"]
    with pytest.raises(sb.RecordingError, match="holds no recording"):
        sb.read_recordings(tmp_path)


def test_recordings_without_a_name_take_that_of_their_file(tmp_path: Path) -> None:
    for name in ("swing.npz", "fall.csv"):
        sb.Recording(X, T).save(tmp_path / name)
    assert [r.name for r in sb.read_recordings(tmp_path)] == ["fall", "swing"]


def test_a_folder_without_recordings_is_refused(tmp_path: Path) -> None:
    with pytest.raises(sb.RecordingError, match=r"folder: is no folder .*nowhere"):
        sb.read_recordings(tmp_path / "nowhere")
    with pytest.raises(sb.RecordingError, match=r"holds no recording that matches '\*' \(got \[\]\)"):
        sb.read_recordings(tmp_path)
    dataset(tmp_path, "train/1.pkl")
    (tmp_path / "notes.txt").touch()
    with pytest.raises(
        sb.RecordingError, match=r"got \['notes.txt', 'train/'\]\).*\.npz or \.csv or .*\.c3d or .*\.pkl"
    ):
        sb.read_recordings(tmp_path)
    with pytest.raises(sb.RecordingError, match=r"matches '\*\.csv' \(got \['1.json', '1.pkl'\]"):
        sb.read_recordings(tmp_path / "train", "*.csv")


def test_a_name_that_comes_twice_is_refused(tmp_path: Path) -> None:
    dataset(tmp_path, "rope1/5.pkl", "rope2/5.pkl", "rope3/5.npz", "rope3/5.csv")
    with pytest.raises(sb.RecordingError, match=r"rope2.5\.pkl: has the name of .*rope1.5\.pkl \(got '5'\)"):
        sb.read_recordings(tmp_path, "*/*.pkl")
    with pytest.raises(sb.RecordingError, match=r"5\.npz: has the name of .*5\.csv"):
        sb.read_recordings(tmp_path / "rope3")


@pytest.mark.parametrize("content", [b"", b"cos\nsystem\n(tR.", b"](e.", b"time,a_x\n"])
def test_a_file_that_is_refused_is_named(tmp_path: Path, content: bytes) -> None:
    dataset(tmp_path, "1.pkl", "2.pkl")
    (tmp_path / "2.pkl").write_bytes(content)
    with pytest.raises(sb.RecordingError) as caught:
        sb.read_recordings(tmp_path)
    assert str(tmp_path / "2.pkl") in str(caught.value) and not hasattr(caught.value, "__notes__")


def test_a_field_that_is_refused_names_its_file_too(tmp_path: Path) -> None:
    dataset(tmp_path, "1.npz", "2.npz")
    (tmp_path / "2.json").write_text('{"units": "furlong"}')
    with pytest.raises(sb.RecordingError, match="units: names no known length unit") as caught:
        sb.read_recordings(tmp_path)
    assert caught.value.__notes__ == [f"in {tmp_path / '2.npz'}"]
