"""The air around the cloths of a configuration."""

from __future__ import annotations

from ..errors import ConfigError
from ..scene import Scene
from .errors import located
from .scene_schema import SceneSection


def add_winds(scene: Scene, section: SceneSection) -> None:
    """Let air act on the cloths that have a coefficient for it, in the scene's wind (`Scene.add_air`).

    Raises:
        ConfigError: times that do not increase, or as many velocities as do not match them.
    """
    wind = {} if section.wind is None else {"wind": section.wind.velocity, "times": section.wind.times}
    for described in section.cloth:
        if not described.in_air:
            continue
        cloth = scene.cloths[described.name]
        normal, tangential = described.air_normal or 0.0, described.air_tangential or 0.0
        with located("scene"):
            scene.add_air(cloth.particles[cloth.mesh.triangles], normal, tangential, name=cloth.name, **wind)


def check_still(path: str, section: SceneSection) -> None:
    """No wind may blow at the start of a scene of which the key at `path` wants the equilibrium.

    Raises:
        ConfigError: one blows.
    """
    if section.wind is None:
        return
    velocity = section.wind.velocity
    first = velocity[0] if isinstance(velocity[0], list) else velocity
    if any(first):
        fix = "give scene.wind times and let it start at zero, or leave the key out"
        raise ConfigError(path, "asks for a state of rest, and a wind blows", first, fix)
