"""Reading configuration files."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import ConfigError
from ..files.door import bounded_bytes, check_file, reading
from ..files.json_file import check_depth
from ..files.names import steering
from ..recording.io import FORMATS
from .build import Study, build
from .errors import from_validation
from .fabric_file import with_fabric_files
from .gripped_schema import GrippedConfig
from .schema import Config

LARGEST = 2**22
"""Bytes of a configuration."""
LONGEST_LINE = 200  # characters of a line in which slips are looked for
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
_MANY_PARTS = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{50}}")


def load(path: str | Path, finer: int = 1) -> Study:
    """Read, check and build a configuration; `finer` multiplies the segments of ropes and the cells of cloths.

    Raises:
        ConfigError: the file is missing, no TOML, larger than `LARGEST`, or a key is unknown, missing or wrong; more
            problems are in its notes.
    """
    path = Path(path)
    with reading(path, ConfigError):
        return build(parse(path), path.parent, finer)


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
    with reading(path, ConfigError):
        data = with_fabric_files(content(Path(path)), Path(path).parent, content)
        model = GrippedConfig if "gripped_rope" in data else Config
        try:
            return model.model_validate(data)
        except ValidationError as error:
            raise from_validation(error, model) from error


def content(path: Path) -> dict[str, Any]:
    """A TOML file as plain data.

    Raises:
        ConfigError: it is missing, no TOML, or larger than `LARGEST`, or a text in it would steer a terminal.
    """
    check_file(path, ConfigError, "the path of a configuration, such as my.toml")
    if path.suffix.lower() in FORMATS:
        fix = f"write a configuration for it first, with `sheetbend new {path.name}`"
        raise ConfigError(str(path), "is a recording, not a configuration", path.name, fix)
    try:
        text = bounded_bytes(path, LARGEST, ConfigError).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "is not UTF-8 text", path.name, "save it as UTF-8") from error
    if _MANY_PARTS.search(text):  # which the parser takes time for that grows as their square
        fix = "write tables, as docs/configuration.md shows them"
        raise ConfigError(str(path), "holds a key of very many parts", path.name, fix)
    try:
        found = tomllib.loads(text)
    except UnicodeError:
        raise
    except ValueError as error:  # tomllib's own is one, and so is that of a number of too many digits
        line = _line_of(text, str(error))
        raise ConfigError(str(path), f"is not valid TOML: {error}", line or path.name, _mended(line)) from error
    check_depth(path, found, ConfigError)
    _check_texts(found)
    return found


def _line_of(text: str, problem: str) -> str:
    """The line that a problem of the parser names, at most `LONGEST_LINE` of it; "" where it names none."""
    told = re.search(r"at line (\d+)", problem)
    lines = text.split("\n")
    return lines[int(told[1]) - 1].strip()[:LONGEST_LINE] if told and int(told[1]) <= len(lines) else ""


def _mended(line: str) -> str:
    """How to mend a line that is no TOML, for the slips that people make."""
    if "\\" in line:
        return "write / in place of \\ in a path, or put it in 'single quotes'"
    if re.match(r"[\w.-]+\s*=\s*[-+]?\d+,\d", line):
        return "write a point as decimal mark, or a list in [brackets]"
    if re.match(r"[\w.-]+\s*=\s*[A-Za-z]", line):
        return "write true or false, or put text in quotes"
    if re.match(r"[\w.-]+\s*=\s*[-+.\deE]+\s*[A-Za-z%]", line):
        return "write the number without its unit"
    if line and "=" not in line and not line.startswith("["):
        return "write key = value"
    return "correct that line"


def _check_texts(found: Any, key: str = "") -> None:
    """Refuse texts that would steer a terminal where they are printed.

    Raises:
        ConfigError: a key or a value holds a control character; it names the key.
    """
    if isinstance(found, str) and steering(found, "\n\t"):
        raise ConfigError(key or "a key", "holds a control character", found, "use characters that print")
    if isinstance(found, dict):
        for name, part in found.items():
            _check_texts(name, key)
            _check_texts(part, f"{key}.{name}" if key else name)
    if isinstance(found, list):
        for i, part in enumerate(found):
            _check_texts(part, f"{key}[{i}]")
