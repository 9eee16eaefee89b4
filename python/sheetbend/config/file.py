"""Reading configuration files."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from ..errors import ConfigError
from .build import Study, build
from .errors import from_validation
from .schema import Config


def load(path: str | Path) -> Study:
    """Read, check and build a configuration.

    Raises:
        ConfigError: the file is missing, no TOML, or a key is unknown, missing or wrong; more problems are in its
            notes.
    """
    path = Path(path)
    return build(parse(path), path.parent)


def parse(path: str | Path) -> Config:
    """The checked content of a configuration file, before anything is built.

    Raises:
        ConfigError: as `load`.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigError(str(path), "is no file", str(path), "give the path of a configuration, such as my.toml")
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), f"is no valid TOML: {error}", path.name, "correct that line") from error
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "is no UTF-8 text", path.name, "save it as UTF-8") from error
    try:
        return Config.model_validate(data)
    except ValidationError as error:
        raise from_validation(error, Config) from error
