"""Files that get their names only when they are whole: a killed process or a full disk leaves the earlier file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError


class UnwrittenError(InputError):
    """A file cannot be written; unlike other input errors also raised after the work, when a disk fills up."""

    def __init__(self, path: str | Path, error: OSError) -> None:
        kept = "; the earlier file is kept" if Path(path).is_file() else ""
        fix = "make room, or write to another folder"
        super().__init__(str(path), f"cannot be written: {error.strerror or error}{kept}", str(path), fix)


@contextmanager
def written(path: str | Path) -> Iterator[Path]:
    """Yields a path beside `path`, with the same suffix, for the content of a file; what was written there becomes
    `path` when the block ends, and is removed when it raises.

    A device or a pipe is written to directly.

    Raises:
        UnwrittenError: the operating system refuses (no room, no such folder, not allowed). The earlier file is kept.
    """
    path = Path(path)
    direct = path.exists() and not path.is_file() and not path.is_dir()
    beside = path if direct else path.parent / f".{path.stem}.{os.getpid()}{path.suffix}"
    try:
        yield beside
        if not direct:
            _on_disk(beside)
            os.replace(beside, path)
    except OSError as error:
        raise UnwrittenError(path, error) from error
    finally:
        if not direct:
            beside.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all.

    Raises:
        UnwrittenError: see `written`.
    """
    with written(path) as beside:
        beside.write_text(text, encoding="utf-8")


def _on_disk(path: Path) -> None:
    """Returns when the content would survive a loss of power."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
