"""The door of every file that is read: whatever a file makes a reader raise ends as an error of the package, what a
file may ask for is bounded, and commands learn what was read, so that they never write over it."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ..errors import InputError, RecordingError, SheetbendError
from .memory import in_words

ROOM = 2**27
"""Bytes that the arrays of any file may take."""
EXPANSION = 50
"""Where they take more than `ROOM`: at most so many times the size of the file."""

_read: ContextVar[set[Path] | None] = ContextVar("files that were read", default=None)


@contextmanager
def noting() -> Iterator[None]:
    """Keep the paths of all files that are read inside, for `noted`."""
    token = _read.set(set())
    try:
        yield
    finally:
        _read.reset(token)


def noted() -> frozenset[Path]:
    """What has been read inside the `noting` that is open."""
    return frozenset(_read.get() or ())


def note(path: str | Path) -> None:
    """Tell `noting` of a file that is read, or would be if it existed."""
    found = _read.get()
    if found is not None:
        found.add(Path(path))


def check_file(path: Path, error: type[InputError] = RecordingError, wanted: str = "a path") -> None:
    """Refuse a path at which there is no file; the fix names one beside it that is spelled alike.

    Args:
        path: of a file that is to be read.
        error: the class of what is raised.
        wanted: what to give instead, where no file is spelled alike.

    Raises:
        InputError: of the class `error`.
    """
    if path.is_file():
        return
    beside = [file.name for file in path.parent.iterdir()] if path.parent.is_dir() else []
    near = [] if path.is_dir() else difflib.get_close_matches(path.name, beside, n=1)
    fix = f"did you mean {path.with_name(near[0])}?" if near else f"give {wanted}; relative paths start at {Path.cwd()}"
    raise error(str(path), "is a folder" if path.is_dir() else "is not a file", str(path), fix)


@contextmanager
def reading(path: str | Path, error: type[InputError] = RecordingError) -> Iterator[None]:
    """Read a file inside: what is not an error of the package becomes one, which names the file.

    The exception itself is its cause, so that mistakes of the reader stay visible in a traceback.

    Raises:
        InputError: of the class `error`.
    """
    note(path)
    try:
        yield
    except (SheetbendError, Warning):  # a warning that the caller made an error stays what it is
        raise
    except Exception as problem:
        words, fix = _reason_and_fix(problem)
        raise error(str(path), words, _short(problem), fix) from problem


def bounded_bytes(path: Path, most: int, error: type[InputError] = RecordingError) -> bytes:
    """The content of a file that must be small; to be called inside `reading`.

    Raises:
        OSError: it cannot be read.
        InputError: of the class `error`, it is larger than `most` bytes.
    """
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise error(str(path), f"is larger than {in_words(most)}", "more", "give a smaller file of its kind")
    return content


def check_room(path: Path, what: str, size: int, in_file: int | None = None) -> None:
    """Refuse what would take more memory than `ROOM`, and more than `EXPANSION` times the size of its file.

    Args:
        what: that takes so much, for the error: "positions of 3 frames and 2 markers".
        size: bytes that it would take.
        in_file: size of the file (all its files), bytes; looked up when left out.

    Raises:
        RecordingError: it would take more.
    """
    most = max(ROOM, EXPANSION * (path.stat().st_size if in_file is None else in_file))
    if size > most:
        limit = f"{in_words(ROOM)}, or {EXPANSION} times the size of the file"
        fix = "cut it into pieces, or make the arrays yourself and give them to sheetbend.Recording"
        raise RecordingError(str(path), f"holds {what}, which is more than {limit}", in_words(size), fix)


def _reason_and_fix(problem: Exception) -> tuple[str, str]:
    """What is wrong with the file, and the fix."""
    if isinstance(problem, MemoryError):
        return "asks for more memory than there is", "cut it into pieces, or export it again if it is damaged"
    if isinstance(problem, RecursionError):
        return "is nested too deeply", "write it without so many brackets"
    if isinstance(problem, UnicodeError):
        return "is not text in the encoding that it should have", "save it as UTF-8"
    if isinstance(problem, OSError):
        return f"cannot be read: {problem.strerror or problem}", "check that it is there and may be read"
    return (
        "is damaged, or not what its reader takes it for",
        "export it again; if others read it, report it with the file",
    )


def _short(problem: Exception) -> str:
    return f"{type(problem).__name__}: {problem}"[:200]
