"""Folders of recordings: all of them, once, in order, and errors that say which file or folder."""

from __future__ import annotations

import shutil
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
    dataset(tmp_path / "rope", "train/1.pkl", "test/1.pkl")
    with pytest.raises(sb.RecordingError, match=r"folder: is not a folder .*eval.* rope holds test, train"):
        sb.read_recordings(tmp_path / "rope" / "eval")
    shutil.rmtree(tmp_path / "rope")
    with pytest.raises(sb.RecordingError, match=r"holds no recording that matches '\*' \(got \[\]\)"):
        sb.read_recordings(tmp_path)
    dataset(tmp_path, "train/1.pkl", "eval/1.pkl")
    (tmp_path / "notes.txt").touch()
    with pytest.raises(
        sb.RecordingError, match=r"got \['eval/', 'notes.txt', 'train/'\]\).*\.npz or \.csv or .*\.c3d or .*\.pkl"
    ):
        sb.read_recordings(tmp_path)
    with pytest.raises(sb.RecordingError, match=r"matches '\*\.csv' \(got \['1.json', '1.pkl'\]"):
        sb.read_recordings(tmp_path / "train", "*.csv")


def test_a_name_that_comes_twice_is_refused(tmp_path: Path) -> None:
    dataset(tmp_path, "rope1/5.pkl", "rope2/5.pkl", "rope3/5.npz", "rope3/5.csv")
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


def test_names_that_come_in_several_folders_begin_with_those(tmp_path: Path) -> None:
    dataset(tmp_path, "rope1/5.pkl", "rope2/5.pkl", "rope2/6.pkl")
    for path in tmp_path.glob("*/*.json"):  # which name their recordings
        path.write_text('{"rate": 100}')
    assert [r.name for r in sb.read_recordings(tmp_path, "*/*.pkl")] == ["rope1_5", "rope2_5", "6"]


def test_the_only_folder_below_is_looked_into(tmp_path: Path) -> None:
    dataset(tmp_path, "deep/down/5.pkl", "__MACOSX/5.pkl", ".trash/7.pkl")
    (tmp_path / "deep" / "._5.pkl").touch()
    (one,) = sb.read_recordings(tmp_path)
    assert one.name == "5" and one.mends[-1] == f"is read from {Path('deep/down')}, below the folder that is given"
    assert [r.name for r in sb.read_recordings(tmp_path / "deep" / "down" / "5.pkl")] == ["5"]


def test_hidden_files_are_no_recordings_and_files_of_laboratories_are_named(tmp_path: Path) -> None:
    dataset(tmp_path, "1.pkl")
    for name in (".DS_Store", "._1.pkl", "README", "2.pkl.gz", "all.mat"):
        (tmp_path / name).write_bytes(b"not a recording")
    refused: dict[str, sb.RecordingError] = {}
    assert [r.name for r in sb.read_recordings(tmp_path, refused=refused)] == ["1"]
    assert sorted(refused) == ["2.pkl.gz", "all.mat"] and "gunzip" in refused["2.pkl.gz"].fix
    assert [r.name for r in sb.read_recordings(tmp_path)] == ["1"]
    (tmp_path / "1.pkl").unlink()
    with pytest.raises(sb.RecordingError, match=r"2\.pkl\.gz: is of a kind that is not read .*gunzip"):
        sb.read_recordings(tmp_path)


def test_refused_files_of_one_name_in_two_folders_are_both_told(tmp_path: Path) -> None:
    dataset(tmp_path, "a/1.npz", "b/2.npz")
    for name in ("a/0.csv", "b/0.csv"):
        (tmp_path / name).write_text("nothing")
    (tmp_path / "a" / "x.mat").write_text("nothing")
    (tmp_path / "b" / "x.mat").write_text("nothing")
    refused: dict[str, sb.RecordingError] = {}
    assert [r.name for r in sb.read_recordings(tmp_path, "*/*", refused=refused)] == ["1", "2"]
    assert sorted(refused) == ["a/0.csv", "a/x.mat", "b/0.csv", "b/x.mat"]


@pytest.mark.parametrize("text", ['{"units": ', "[1]"])
def test_a_malformed_json_beside_a_folder_is_told_as_that_of_the_folder(tmp_path: Path, text: str) -> None:
    dataset(tmp_path / "train", "a.npz")
    (tmp_path / "train.json").write_text(text)
    with pytest.raises(sb.RecordingError, match=r"train\.json: is read as the JSON of the folder train and .*move it"):
        sb.Recording.load(tmp_path / "train" / "a.npz")
