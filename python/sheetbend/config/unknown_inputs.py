"""Forces and a wind of a configuration that a fit finds."""

from __future__ import annotations

from collections.abc import Callable

from ..objects.over_time import add_unknown_force, add_unknown_wind
from ..objects.rope import Rope
from ..scene.body import BodyPoint
from ..scene.scene import Scene
from .bodies import named_body
from .errors import located, of_name
from .moment import Moment
from .scene_schema import SceneSection, UnknownForce, UnknownWind


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
