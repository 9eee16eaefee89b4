"""Folders for results: writable, with room, and written to by one process at a time."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import ConfigError
from ..files.whole import UnwrittenError

ROOM = 4_000_000  # bytes that must be there before work starts: what a fit writes besides figures and movies
LOCK = ".running"


def made(option: str, folder: Path) -> Path:
    """The folder, made with its parents, and known to take files before any work starts.

    Raises:
        ConfigError: it is a file, nothing can be written there, or the disk is full; it names the option.
    """
    if folder.exists() and not folder.is_dir():
        raise ConfigError(option, "is a file", str(folder), "give a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder, buffering=0) as trial:
            os.posix_fallocate(trial.fileno(), 0, ROOM)
            return folder
    except OSError as error:
        fix = f"give a folder that you may write to, with room for {ROOM // 1_000_000} MB"
        raise ConfigError(option, f"cannot be written to: {error.strerror}", str(folder), fix) from error


def made_again(folder: Path) -> str | None:
    """Make the folder of a finished fit again if it was removed while the fit ran, and say so; None if it is there.

    Raises:
        UnwrittenError: it cannot be made.
    """
    if folder.is_dir():
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnwrittenError(folder, error) from error
    return f"{folder} was removed while the fit ran, and is made again"


@contextmanager
def alone(option: str, folder: Path) -> Iterator[None]:
    """Refuses a second process that writes to the same folder; the lock ends with the process that holds it, however
    that ends.

    Raises:
        ConfigError: another process holds it; it names the option.
    """
    path = folder / LOCK
    handle = _locked(path)
    if handle is None:
        fix = "wait for that run, or give another folder"
        raise ConfigError(option, "is written to by another run of sheetbend", str(folder), fix)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)  # while the lock is held: who waits for this file then finds it gone
        os.close(handle)


def _locked(path: Path) -> int | None:
    """The open file, or None where another process holds it."""
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and path.stat().st_ino == os.fstat(handle).st_ino:
                return handle
        except BlockingIOError:
            os.close(handle)
            return None
        os.close(handle)  # the run that held it removed it in the meantime
