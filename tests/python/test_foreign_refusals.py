"""Exceptions of the libraries below a reader: each ends as an error that names the file, and none as a traceback."""

from __future__ import annotations

import tokenize
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from commands import run
from test_forged_files import archive, npy

OPEN = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 5, 3"  # NumPy's tokenizer raises TokenError on it


def written(folder: Path, *members: str) -> Path:
    """An .npz whose members have this header."""
    return archive(folder / "take.npz", **dict.fromkeys(members, npy(np.zeros((4, 5, 3)), OPEN)))


READERS: dict[str, tuple[Callable[[Path], object], tuple[str, ...]]] = {
    "recording": (sb.Recording.load, ("positions", "times", "markers")),
    "tool": (sb.Tool.load, ("times", "positions", "quaternions")),
    "forces": (sb.ForceRecording.load, ("times", "forces")),
}


def test_numpy_raises_what_is_not_its_own(tmp_path: Path) -> None:
    with pytest.raises(tokenize.TokenError):
        np.load(written(tmp_path, "times"))["times"]


@pytest.mark.parametrize("reader", READERS)
def test_a_header_that_does_not_end_is_refused_by_the_files_name(reader: str, tmp_path: Path) -> None:
    read, members = READERS[reader]
    with pytest.raises(sb.InputError, match=r"take\.npz"):
        read(written(tmp_path, *members))


def test_the_command_line_tells_it_without_a_traceback(tmp_path: Path) -> None:
    found = run("info", written(tmp_path, "positions", "times", "markers"))
    assert found.exit_code == 2 and isinstance(found.exception, SystemExit)
    assert "take.npz" in found.output.replace("\n", "") and "Traceback" not in found.output
