"""All recordings of a folder, as data sets come: one file per motion, in folders such as train and eval."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import RecordingError
from ..recording import Recording
from . import ELSEWHERE, FORMATS, sidecar, told_unit
from .natural import by_number

NOTES = ".txt"
"""Files of this suffix are tables or notes: in a folder they count as recordings only where the pattern names it."""
MOST_NAMED = 6  # folders beside one that is missing
FOREIGN = ("__MACOSX", "__pycache__")
"""Folders that other programs leave behind."""


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
        folder: the folder of the files, or one file. If the folder holds no recording, but a single folder below it
            does, that one is read. Files that no reader knows, such as the JSON beside a recording, are left out.
        pattern: which files, as for `Path.glob`; "*/*" looks one folder below. Files that end in .txt are read only if
            the pattern also ends in .txt.
        units: length unit of the files, as for `Recording.load`.
        refused: if given, a file that cannot be read does not stop the others. The errors are stored here by the path
            of the file in the folder, such as "monday/00.pkl", also those of other kinds of files that laboratories use
            (`ELSEWHERE`), such as .mat.

    Returns:
        The recordings, as `Recording.load` reads them. If files in several folders have the same name, the name of the
        folder is put before it, such as monday_00.

    Raises:
        RecordingError: the folder does not exist or holds no recording of that pattern, two recordings have the same
            name, or a file is refused (which is named): all of them where `refused` is given.
    """
    root = Path(folder)
    if not isinstance(pattern, str) or not pattern or Path(pattern).is_absolute():
        raise RecordingError("pattern", "is not a pattern of names", pattern, "give such as '*.csv'")
    if not isinstance(refused, dict | None):
        raise RecordingError("refused", "must be a dict", refused, "give an empty one")
    known = _known(pattern)
    files, others = _files(root, pattern, known)
    errors = {_within(root, file): _of_another_kind(file) for file in others}
    if refused is not None:
        refused.update(errors)
    if not files and errors:
        raise next(iter(errors.values()))
    if not files:
        inside = sorted(p.name + "/" * p.is_dir() for p in root.iterdir())
        fix = 'give the folder of the files and a pattern that they match ("*/*" looks into its folders); files end in '
        fix += " or ".join(known)
        raise RecordingError(f"{folder}", f"holds no recording that matches {pattern!r}", inside, fix)
    stems = Counter(file.stem for file in files)
    below = files[0] != root and files[0] not in root.glob(pattern)
    first: dict[str, Path] = {}
    found = []
    for file in files:
        try:
            recording = _load(file, units)
        except RecordingError as error:
            if refused is None:
                raise
            refused[_within(root, file)] = error
            continue
        if below:
            said = f"is read from {file.parent.relative_to(root)}, below the folder that is given"
            recording = replace(recording, metadata={**recording.metadata, "mended": [*recording.mends, said]})
        if recording.name == file.stem and stems[file.stem] > 1 and file.parent != root:
            recording = replace(recording, name="_".join(file.relative_to(root).with_suffix("").parts))
        other = first.setdefault(recording.name, file)
        if other is not file:
            fix = "narrow the pattern, or give one of them another name in its JSON"
            raise RecordingError(str(file), f"has the name of {other}", recording.name, fix)
        found.append(recording)
    if not found and refused:
        raise next(iter(refused.values()))
    return found


def _files(root: Path, pattern: str, known: Sequence[str]) -> tuple[list[Path], list[Path]]:
    """Recordings and files of known kinds that are not read, which match the pattern, in order; where the folder holds
    neither, those of the only folder below it that does. Hidden files are nobody's recordings."""
    if root.is_file():
        return [root], []
    if not root.is_dir():
        beside = sorted(p.name for p in root.parent.iterdir() if p.is_dir()) if root.parent.is_dir() else []
        fix = "give the folder that holds the files" + (
            f"; {root.parent.name} holds {', '.join(beside[:MOST_NAMED])}" if beside else ""
        )
        raise RecordingError("folder", "is not a folder", str(root), fix)
    for own in (pattern, f"**/{pattern}"):
        matching = sorted(
            (p for p in root.glob(own) if p.is_file() and not _hidden(p.relative_to(root))), key=by_number
        )
        files = [p for p in matching if p.suffix.lower() in known]
        others = [p for p in matching if p.suffix.lower() in ELSEWHERE]
        if (files or others) and (own == pattern or len({p.parent for p in matching}) == 1):
            return files, others
    return [], []


def units_told(folder: str | Path, pattern: str, refused: Container[str]) -> bool:
    """Whether every file that `read_recordings` reads there, or a JSON beside it, tells its length unit. That of .npz,
    which is m unless a JSON says another, is not told by the file: anybody may have written it.

    Args:
        refused: files that do not count, as `read_recordings` names them.
    """
    root = Path(folder)
    files = (f for f in _files(root, pattern, _known(pattern))[0] if _within(root, f) not in refused)
    return all((sidecar.beside(f).get("units") if f.suffix.lower() == ".npz" else told_unit(f)) for f in files)


def _known(pattern: str) -> list[str]:
    """Suffixes of recordings."""
    return [suffix for suffix in FORMATS if suffix != NOTES or pattern.lower().endswith(NOTES)]


def _within(root: Path, file: Path) -> str:
    """The path of a file in a folder, which may be the file itself."""
    return file.name if file == root else file.relative_to(root).as_posix()


def _of_another_kind(file: Path) -> RecordingError:
    return RecordingError(str(file), "is of a kind that is not read", file.suffix, ELSEWHERE[file.suffix.lower()])


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") or part in FOREIGN for part in path.parts)


def _load(file: Path, units: str | None) -> Recording:
    try:
        return Recording.load(file, units)
    except RecordingError as error:
        if str(file) not in error.field:
            error.add_note(f"in {file}")
        raise
