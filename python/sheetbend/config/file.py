"""Reading configuration files."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import ConfigError
from .build import Study, build
from .errors import from_validation
from .gripped_schema import GrippedConfig
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
    """The checked content of a configuration file with a scene, before anything is built.

    Raises:
        ConfigError: as `load`, or the file is one of ropes between grips.
    """
    config = parse_any(path)
    if isinstance(config, GrippedConfig):
        fix = "use `sheetbend fit`, `sheetbend check` or `sheetbend info`"
        raise ConfigError("gripped_rope", "takes the place of a scene: here is none to build", str(path), fix)
    return config


def parse_any(path: str | Path) -> Config | GrippedConfig:
    """The checked content of a configuration file of either kind: with [[gripped_rope]], or with a scene.

    Raises:
        ConfigError: as `load`.
    """
    data = _content(Path(path))
    model = GrippedConfig if "gripped_rope" in data else Config
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise from_validation(error, model) from error


def _content(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise ConfigError(str(path), "is no file", str(path), "give the path of a configuration, such as my.toml")
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), f"is no valid TOML: {error}", path.name, "correct that line") from error
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "is no UTF-8 text", path.name, "save it as UTF-8") from error
