"""Folders for results."""

from __future__ import annotations

import tempfile
from pathlib import Path

from ..errors import ConfigError


def made(option: str, folder: Path) -> Path:
    """The folder, made with its parents, and known to take files before any work starts.

    Raises:
        ConfigError: it is a file, or nothing can be written there; it names the option.
    """
    if folder.exists() and not folder.is_dir():
        raise ConfigError(option, "is a file", str(folder), "give a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        fix = "give a folder that you may write to"
        raise ConfigError(option, f"cannot be written to: {error.strerror}", str(folder), fix) from error
