"""What of the scene's description one recording shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import ConfigError
from . import schema
from .cloth_schema import MarkerGrid
from .rope_schema import RopeHere
from .scene_schema import SceneSection

OPTIONAL = ("cloth", "particles", "constraints", "point_mass", "force", "contact")
"""Lists of the scene that a recording can leave out by name."""


def ropes_shown(config: schema.Config, section: schema.RecordingSection, path: str) -> list[str]:
    """Names of the ropes that a recording shows.

    Raises:
        ConfigError: one is no rope of the scene.
    """
    every = [rope.name for _, rope in config.scene.strands]
    unknown = [name for name in section.ropes or () if name not in every]
    if unknown:
        raise ConfigError(
            f"{path}.ropes", "name no rope of the scene", unknown, f"name some of: {', '.join(every) or 'none'}"
        )
    return every if section.ropes is None else section.ropes


def without(scene: SceneSection, names: list[str], path: str) -> SceneSection:
    """The scene's description less what a recording leaves out.

    Raises:
        ConfigError: one is nothing that can be left out.
    """
    every = {part.name for key in OPTIONAL for part in getattr(scene, key) if part.name} | set(scene.quantities)
    unknown = [name for name in names if name not in every]
    if unknown:
        fix = f"name some of: {', '.join(sorted(every)) or 'none'}"
        raise ConfigError(f"{path}.leave_out", "name nothing that can be left out", unknown, fix)
    kept = {key: [part for part in getattr(scene, key) if part.name not in names] for key in OPTIONAL}
    quantities = {name: q for name, q in scene.quantities.items() if name not in names}
    return scene.model_copy(update={**kept, "quantities": quantities})


def with_grids(scene: SceneSection, grids: Mapping[str, MarkerGrid], path: str) -> SceneSection:
    """The scene's description with a recording's own grids of markers.

    Raises:
        ConfigError: one belongs to no cloth of the scene.
    """
    unknown = set(grids) - {cloth.name for cloth in scene.cloth}
    if unknown:
        fix = f"name some of: {', '.join(cloth.name for cloth in scene.cloth) or 'none'}"
        raise ConfigError(f"{path}.grids", "name no cloth of the scene", sorted(unknown), fix)
    cloths = [c.model_copy(update={"grid": grids[c.name]}) if c.name in grids else c for c in scene.cloth]
    return scene.model_copy(update={"cloth": cloths})


def with_own_markers(scene: SceneSection, here: Mapping[str, RopeHere], path: str) -> SceneSection:
    """The scene's description with a recording's own markers and grips of ropes and rods.

    Raises:
        ConfigError: one is no rope or rod of the scene.
    """
    strands = [strand.name for _, strand in scene.strands]
    unknown = set(here) - set(strands)
    if unknown:
        fix = f"name some of: {', '.join(strands) or 'none'}"
        raise ConfigError(f"{path}.here", "names no rope of the scene", sorted(unknown), fix)
    return scene.model_copy(
        update={
            "rope": [rope.model_copy(update=_own(here.get(rope.name))) for rope in scene.rope],
            "rod": [rod.model_copy(update=_own(here.get(rod.name))) for rod in scene.rod],
        }
    )


def _own(here: RopeHere | None) -> dict[str, Any]:
    given = {} if here is None else {"markers": here.markers, "grip": here.grip}
    return {key: part for key, part in given.items() if part is not None}
