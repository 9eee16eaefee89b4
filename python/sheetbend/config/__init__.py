"""Configurations: a TOML file in, experiments and parameters out. Needs pydantic (`pip install 'sheetbend[cli]'`)."""

from .build import Study, build, scene_alone
from .file import load, parse
from .schema import Config

__all__ = ["Config", "Study", "build", "load", "parse", "scene_alone"]
