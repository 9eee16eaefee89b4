"""All recordings of a folder, as data sets come: one file per motion, in folders such as train and eval."""

from __future__ import annotations

from pathlib import Path

from ...errors import RecordingError
from ..recording import Recording
from . import FORMATS
from .natural import by_number

NOTES = ".txt"
"""Files of this suffix are tables or notes: in a folder they count as recordings only where the pattern names it."""


def read_recordings(
    folder: str | Path,
    pattern: str = "*",
    units: str | None = None,
    refused: dict[str, RecordingError] | None = None,
) -> list[Recording]:
    """Read every recording in a folder, in the order of the file names; numbers in names count by size (9 before 10).

        train = sb.read_recordings("ropes/train")
        unseen = sb.read_recordings("ropes/eval", "*.pkl")

    Args:
        folder: where the files lie. Files that no reader knows, such as the JSON beside a recording, are left out.
        pattern: which files, as for `Path.glob`; "*/*" looks one folder below. Files that end in .txt are read only
            where the pattern does, too.
        units: length unit of the files, as for `Recording.load`.
        refused: where given, gets the errors of files that cannot be read, by file name, and the others are read.

    Returns:
        As `Recording.load` reads them, each name once.

    Raises:
        RecordingError: the folder does not exist or holds no recording of that pattern, two recordings have the same
            name, or a file is refused (which is named): all of them where `refused` is given.
    """
    root = Path(folder)
    if not root.is_dir():
        raise RecordingError("folder", "is no folder", str(folder), "give the folder that holds the files")
    if not isinstance(pattern, str) or not pattern or Path(pattern).is_absolute():
        raise RecordingError("pattern", "is no pattern of names", pattern, "give such as '*.csv'")
    known = [suffix for suffix in FORMATS if suffix != NOTES or pattern.lower().endswith(NOTES)]
    files = sorted((p for p in root.glob(pattern) if p.is_file() and p.suffix.lower() in known), key=by_number)
    if not files:
        inside = sorted(p.name + "/" * p.is_dir() for p in root.iterdir())
        fix = f"give the folder of the files and a pattern that they match; files end in {' or '.join(known)}"
        raise RecordingError(f"{folder}", f"holds no recording that matches {pattern!r}", inside, fix)
    first: dict[str, Path] = {}
    found = []
    for file in files:
        try:
            recording = _load(file, units)
        except RecordingError as error:
            if refused is None:
                raise
            refused[file.name] = error
            continue
        other = first.setdefault(recording.name, file)
        if other is not file:
            fix = "narrow the pattern, or give one of them another name in its JSON"
            raise RecordingError(str(file), f"has the name of {other}", recording.name, fix)
        found.append(recording)
    if not found and refused:
        raise next(iter(refused.values()))
    return found


def _load(file: Path, units: str | None) -> Recording:
    try:
        return Recording.load(file, units)
    except RecordingError as error:
        if str(file) not in error.field:
            error.add_note(f"in {file}")
        raise
