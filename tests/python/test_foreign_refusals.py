"""Exceptions of the libraries below a reader: each ends as an error that names the file, and none as a traceback."""

from __future__ import annotations

import io
import tokenize
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli.app import app
from typer.testing import CliRunner

OPEN = b"{'descr': '<f8', 'fortran_order': False, 'shape': (4, 5, 3"  # NumPy's tokenizer raises TokenError on it


def archive(header: bytes, members: tuple[str, ...]) -> bytes:
    """An .npz whose members have this header."""
    text = header + b" " * (-(len(header) + 11) % 64) + b"\n"
    member = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(4 * 5 * 3 * 8)
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as packed:
        for name in members:
            packed.writestr(f"{name}.npy", member)
    return made.getvalue()


READERS: dict[str, tuple[Callable[[Path], object], tuple[str, ...]]] = {
    "recording": (sb.Recording.load, ("positions", "times", "markers")),
    "tool": (sb.Tool.load, ("times", "positions", "quaternions")),
    "forces": (sb.ForceRecording.load, ("times", "forces")),
}


def test_numpy_raises_what_is_not_its_own() -> None:
    with pytest.raises(tokenize.TokenError):
        np.load(io.BytesIO(archive(OPEN, ("times",))))["times"]


@pytest.mark.parametrize("reader", READERS)
def test_a_header_that_does_not_end_is_refused_by_the_files_name(reader: str, tmp_path: Path) -> None:
    read, members = READERS[reader]
    path = tmp_path / "take.npz"
    path.write_bytes(archive(OPEN, members))
    with pytest.raises(sb.InputError, match=r"take\.npz"):
        read(path)


def test_the_command_line_tells_it_without_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "take.npz"
    path.write_bytes(archive(OPEN, ("positions", "times", "markers")))
    found = CliRunner().invoke(app, ["info", str(path)])
    assert found.exit_code == 2 and isinstance(found.exception, SystemExit)
    assert "take.npz" in found.output.replace("\n", "") and "Traceback" not in found.output
