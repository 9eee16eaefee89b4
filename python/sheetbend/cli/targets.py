"""The files that a command will write, checked before any work starts: none of them is one that it has read, none lies
outside its folder, no two are the same."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..errors import ConfigError
from ..files.door import noted
from ..files.names import folded


def check_targets(option: str, folder: Path, files: Iterable[Path]) -> None:
    """Refuse files that must not be written, once all inputs are read (`door.noted`). Links are followed.

    Args:
        option: that chose the folder, for errors.
        folder: must hold the files; it need not exist yet.
        files: what will be written.

    Raises:
        ConfigError: a file was read by this command, lies outside the folder through a link, is a folder, or has the
            name of another one (where case does not count).
    """
    inputs = {_resolved(option, path) for path in noted()}
    same = {key for key in map(_identity, inputs) if key is not None}
    inside = _resolved(option, folder)
    taken: dict[str, Path] = {}
    for file in files:
        target = _resolved(option, file)
        if target in inputs or _identity(target) in same:
            fix = "give another folder with --output, or another file; inputs are never written over"
            raise ConfigError(option, "would write over a file that was read", str(file), fix)
        if not target.is_relative_to(inside):
            raise ConfigError(option, "would write outside its folder, through a link", str(file), "remove the link")
        if target.is_dir():
            raise ConfigError(option, "would write a file where a folder is", str(file), "move the folder away")
        other = taken.setdefault(folded(str(target)), file)
        if other is not file:
            fix = "give recordings, ropes and cloths names that differ in more than case"
            raise ConfigError(option, f"would write two files of one name, {other}", str(file), fix)


def _resolved(option: str, path: Path) -> Path:
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:  # a circle of links; a name that no file can have
        raise ConfigError(option, "is not a path", str(path), "give another one") from error


def _identity(path: Path) -> tuple[int, int] | None:
    """Device and inode of a file, whatever it is called; None where there is no file."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
