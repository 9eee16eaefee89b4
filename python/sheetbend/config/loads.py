"""What pushes the things in the scene of a configuration: forces and winds, given or to be found by a fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import ConfigError
from ..objects.over_time import add_unknown_force, add_unknown_wind
from ..objects.rope import Rope
from ..quantities.expression import expressions, vector
from ..scene.body import BodyPoint
from ..scene.body_force import push_point
from ..scene.scene import Scene
from .bodies import named_body
from .errors import located, of_name
from .moment import Moment
from .scene_schema import Force, SceneSection, UnknownForce, UnknownWind


def add_forces(scene: Scene, forces: Sequence[Force], find: Callable[[str, str], int]) -> None:
    """Forces, plain or made of named quantities.

    Args:
        find: the particle of a reference, after its place in the file.

    Raises:
        ConfigError: an unknown particle or body, or factors that do not match the times.
    """
    for i, force in enumerate(forces):
        path = f"scene.force[{i}]"
        factors = np.ones(len(force.times)) if force.factors is None else np.array(force.factors)
        if len(factors) != len(force.times):
            raise ConfigError(f"{path}.factors", "do not match the times", len(factors), f"give {len(force.times)}")
        which = [find(f"{path}.particles", r) for r in force.particles]
        point = None if force.body is None else named_body(f"{path}.body", force.body, scene).point(force.point)
        with located(path):
            whole = expressions(force.force)
            if force.name is not None:
                size = float(np.linalg.norm(force.force)) or 1.0
                names = [f"{force.name}_{axis}" for axis in "xyz"]
                for name, value in zip(names, force.force, strict=True):
                    scene.add_quantity(name, value, "N", positive=False, scale=size)
                whole = vector(names)
            over_time = whole * factors[:, None]
            if point is not None:
                push_point(scene.forces, point, over_time, force.times)
                continue
            scene.add_force(which, np.zeros(3), force.times)
            scene.forces.push(which, np.repeat(over_time[:, None], len(which), axis=1), force.times)


def add_winds(scene: Scene, section: SceneSection) -> None:
    """Set the scene's wind, and let air act on the cloths that have a coefficient for it (`Scene.add_air`).

    Raises:
        ConfigError: times that do not increase, as many velocities as do not match them, or a wind that blows on
            nothing.
    """
    if section.wind is not None:
        with located("scene"):
            scene.set_wind(section.wind.velocity, section.wind.times)
    for described in section.cloth:
        if not described.in_air:
            continue
        cloth = scene.cloths[described.name]
        normal, tangential = described.air_normal or 0.0, described.air_tangential or 0.0
        with located("scene"):
            scene.add_air(cloth.particles[cloth.mesh.triangles], normal, tangential, name=cloth.name)
    if section.wind is not None:
        with located("scene"):
            scene.air.expect_blown(scene.has_drag)


def add_unknown_inputs(
    scene: Scene, section: SceneSection, moment: Moment | None, find: Callable[[str, str], int]
) -> None:
    """Add them to the scene of a motion; an equilibrium, and a scene without a recording or a duration, has none.

    Args:
        find: the particle of a reference, after its place in the file.

    Raises:
        ConfigError: an unknown particle, rope or body, or numbers that do not suit.
    """
    for i, force in enumerate(section.unknown_force):
        path = f"scene.unknown_force[{i}]"
        duration = _duration(force, moment)
        if duration is None:
            continue
        on: BodyPoint | Rope | list[int]
        if force.body is not None:
            on = named_body(f"{path}.body", force.body, scene).point(force.point)
        elif force.rope is not None:
            on = of_name(f"{path}.rope", "rope of the scene", force.rope, scene.ropes)
        else:
            on = [find(f"{path}.particles", r) for r in force.particles]
        with located(path, force.name):
            add_unknown_force(scene, on, scale=force.scale, spacing=force.spacing, duration=duration, name=force.name)
    wind = section.unknown_wind
    if wind is not None and (duration := _duration(wind, moment)) is not None:
        with located("scene.unknown_wind", wind.name):
            add_unknown_wind(scene, scale=wind.scale, spacing=wind.spacing, duration=duration, name=wind.name)


def _duration(given: UnknownForce | UnknownWind, moment: Moment | None) -> float | None:
    """Of an input, s; None where there is none."""
    if moment is None:
        return given.duration
    if moment.static:
        return None
    return given.duration or float(moment.recording.times[-1]) - moment.t0
