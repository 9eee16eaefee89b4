"""Configurations: a TOML file in, experiments and parameters out, or ropes between grips and how to fit them. Needs
pydantic (`pip install 'sheetbend[cli]'`)."""

from .build import Study, build, scene_alone
from .file import load, parse, parse_any
from .gripped_schema import GrippedConfig, GrippedRopeSection
from .schema import Config

__all__ = [
    "Config",
    "GrippedConfig",
    "GrippedRopeSection",
    "Study",
    "build",
    "load",
    "parse",
    "parse_any",
    "scene_alone",
]
