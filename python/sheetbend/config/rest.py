"""What a state of rest asks of the scene of a configuration."""

from __future__ import annotations

import numpy as np

from ..errors import ConfigError
from ..scene.scene import Scene
from .cloth_schema import Cloth
from .scene_schema import SceneSection


def check_rest(path: str, section: SceneSection, scene: Scene) -> None:
    """A scene of which the key at `path` wants the equilibrium must have one that `sb.equilibrium` can find.

    Raises:
        ConfigError: a wind blows at its start, a pressure ends at a free rim, or there are contacts.
    """
    if scene.contacts.contacts:
        names = [contact.name for contact in scene.contacts.contacts]
        fix = "let it come to rest in a motion, or leave the contact out for this recording (leave_out)"
        raise ConfigError(path, "asks for a state of rest, which is not found with contacts", names, fix)
    _check_still(path, section)
    for cloth in section.cloth:
        if cloth.pressure is not None:
            _check_rim(path, cloth, scene)


def _check_still(path: str, section: SceneSection) -> None:
    if section.wind is None or not any(cloth.in_air for cloth in section.cloth):
        return  # drag in a wind is a constant force
    velocity = section.wind.velocity
    first = velocity[0] if isinstance(velocity[0], list) else velocity
    if any(first):
        fix = "give scene.wind times and let it start at zero, or leave the key out"
        raise ConfigError(path, "asks for a state of rest, and a wind blows", first, fix)


def _check_rim(path: str, section: Cloth, scene: Scene) -> None:
    """A pressure has an energy on a closed surface and on one whose rim is held."""
    cloth = scene.cloths[section.name]
    rim = cloth.particles[np.unique(cloth.mesh.borders)]
    free = [int(particle) for particle in rim if particle not in scene.pinned and particle not in scene.boundary.driven]
    if free:
        problem = (
            f"asks for a state of rest, and the rim of {section.name}, which is under pressure, is free at vertices"
        )
        vertices = np.flatnonzero(np.isin(cloth.particles, free)).tolist()
        fix = "pin or grip all of its rim, or simulate with drag until the motion has died down"
        raise ConfigError(path, problem, vertices, fix)
