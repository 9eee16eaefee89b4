"""The air around the cloths of a configuration."""

from __future__ import annotations

from ..scene.scene import Scene
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
