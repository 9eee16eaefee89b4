"""Files that get their names only when they are whole."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.files.whole import UnwrittenError, write_text, written


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_a_file_appears_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    with written(path) as beside:
        beside.write_text("new")
        assert beside.suffix == ".json" and beside.parent == tmp_path and not path.exists()
    assert path.read_text() == "new" and names(tmp_path) == ["fit.json"]


def test_its_permissions_are_those_of_any_file(tmp_path: Path) -> None:
    (tmp_path / "plain.txt").write_text("")
    write_text(tmp_path / "whole.txt", "")
    assert (tmp_path / "whole.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_the_earlier_file_stays_when_the_work_is_stopped(error: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    path.write_text("earlier")

    def half() -> None:
        with written(path) as beside:
            beside.write_text("ha")
            raise error

    with pytest.raises(error):
        half()
    assert path.read_text() == "earlier" and names(tmp_path) == ["fit.json"]


def test_the_earlier_file_stays_when_the_disk_is_full(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk."""
    code = """
    import resource, sheetbend as sb
    from sheetbend.files.whole import write_text
    write_text("report.txt", "earlier")
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
    try:
        write_text("report.txt", 100_000 * "x")
    except sb.InputError as error:
        print(error)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "report.txt: cannot be written: File too large; the earlier file is kept" in done.stdout
    assert (tmp_path / "report.txt").read_text() == "earlier" and names(tmp_path) == ["report.txt"]


def test_a_killed_process_leaves_the_earlier_file(tmp_path: Path) -> None:
    code = """
    import os, signal
    from sheetbend.files.whole import write_text, written
    write_text("fit.json", "earlier")
    with written("fit.json") as beside:
        beside.write_text("ha")
        os.kill(os.getpid(), signal.SIGKILL)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], cwd=tmp_path, check=False)
    assert (tmp_path / "fit.json").read_text() == "earlier"


def test_folders_that_are_not_there_and_folders_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "no" / "fit.json", tmp_path):
        with pytest.raises(UnwrittenError, match="cannot be written"):
            write_text(path, "new")
    assert names(tmp_path) == []


def test_a_device_is_written_to_directly() -> None:
    write_text("/dev/null", "new")
    assert not Path("/dev/null").is_file()
    with pytest.raises(UnwrittenError, match="No space left"):
        write_text("/dev/full", "new")


def test_a_link_becomes_a_file_and_what_it_points_to_stays(tmp_path: Path) -> None:
    (tmp_path / "input.csv").write_text("measured")
    os.symlink("input.csv", tmp_path / "report.txt")
    write_text(tmp_path / "report.txt", "new")
    assert (tmp_path / "input.csv").read_text() == "measured"
    assert not (tmp_path / "report.txt").is_symlink()


def test_results_are_written_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "fit.json"
    path.write_text("earlier")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    result = sb.FitResult(
        estimates=(), recordings=(), cost=1.0, rows=1, optimizer="scipy", iterations=1, seconds=1.0, converged=True
    )
    with pytest.raises(UnwrittenError, match="No space left on device"):
        result.save(path)
    assert path.read_text() == "earlier" and names(tmp_path) == ["fit.json"]


@pytest.mark.parametrize("suffix", ["npz", "csv", "pkl"])
def test_a_recording_that_cannot_be_written_keeps_the_earlier_one(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"motion.{suffix}"
    recording = sb.Recording(positions=np.zeros((3, 12, 3)), times=np.arange(3) / 100, name="motion")
    recording.save(path)
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sheetbend.files.whole._on_disk", full)
    with pytest.raises(UnwrittenError, match="the earlier file is kept"):
        recording.save(path)
    assert path.read_bytes() == before and not [name for name in names(tmp_path) if name.startswith(".")]
