"""What holds an end of a rope or rod in a configuration: markers of the recording, or a tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays.smoothing import smoothed
from ..arrays.types import Array
from ..errors import ConfigError
from ..objects.grip import Grip
from ..objects.rope import Rope
from ..objects.tool import Tool
from ..scene.body import BodyPoint
from ..scene.scene import Scene
from . import rope_schema as schema
from .bodies import named_body
from .errors import located
from .moment import Moment
from .tools import tool_named


@dataclass(frozen=True, eq=False)
class Led:
    """An end that follows one marker: its place is driven, its direction is free, or that of a clamp.

    Attributes:
        times: (frames,) s.
        motion: (frames, 1, 3) m, of the marker.
        markers: its name.
        offset: (3,) m, from the marker to the end.
        smoothing: s.
    """

    times: Array
    motion: Array
    markers: tuple[str, ...]
    offset: Array
    smoothing: float

    @property
    def place(self) -> Array:
        """(3,) m, of the end at the scene's start."""
        return np.asarray(self._smooth[0, 0] + self.offset)

    @property
    def _smooth(self) -> Array:
        if self.smoothing > 0 and len(self.times) > 1:
            return smoothed(self.times, self.motion, self.smoothing)[0]
        return self.motion

    def drive(self, scene: Scene, node: int) -> None:
        """Give the end its motion; as recorded, so that a fit can allow for the marker's noise, or smoothed."""
        if self.smoothing > 0:
            scene.drive([node], self.times, self._smooth + self.offset)
        else:
            scene.follow([node], self.times, self.motion + self.offset, self.markers)


def held_end(
    path: str,
    section: schema.RopeGrip,
    moment: Moment | None,
    tools: Mapping[str, Tool],
    place: Array | None,
    direction: Array | None,
) -> Grip | Led:
    """What holds an end.

    Args:
        path: of the grip, for errors.
        tools: of the scene, by name.
        place, direction: (3,) of the end as placed, for grips that do not say theirs; None where it is not known.

    Raises:
        ConfigError: no recording, unknown markers or tools, gaps, markers of no rigid piece, or a place or direction
            that is not known.
    """
    if section.markers is None:
        return _on_tool(path, section, tool_named(f"{path}.tool", section.tool or "", tools), place, direction)
    if moment is None:
        raise ConfigError(f"{path}.markers", "need a recording", section.markers, "add a [[recording]], or a tool")
    with located(f"{path}.markers"):
        times, motion, names = moment.followed(section.markers)
    if len(names) == 1:
        return Led(times, motion, names, np.array(section.offset), section.smoothing)
    with located(path):
        if len(names) == 2:
            # at the end the rope passes the inner marker first, and is free up to it
            grip = Grip.from_markers(times, motion[:, 0], motion[:, 1], end=section.at == "end")
        else:
            at = _known(path, "position", section.position, place)
            grip = Grip.from_body(times, motion, at, _known(path, "direction", section.direction, direction))
        grip = grip.smoothed(section.smoothing)
        return Grip.fixed(grip.position[0], grip.direction[0], grip.director[0]) if moment.static else grip


def end_on_body(path: str, section: schema.RopeGrip, scene: Scene, place: Array | None) -> BodyPoint:
    """The point of a body that holds an end; `place` (3,) m of the end as placed, where it is known.

    Raises:
        ConfigError: no such body, or a place that is not known.
    """
    body = named_body(f"{path}.body", section.body or "", scene)
    at = section.position
    if at is None:
        origin, frame = body.pose(scene.nodes)
        at = ((_known(path, "position", None, place) - origin) @ frame).tolist()
    with located(path):
        return body.point(at, section.direction)


def place_of(held: Grip | Led | BodyPoint) -> Array:
    """(3,) m, where an end is held at the scene's start."""
    if isinstance(held, BodyPoint):
        return held.at_start()[0]
    return held.place if isinstance(held, Led) else held.position[0]


def hold_led(scene: Scene, rope: Rope, ends: Mapping[str, Grip | Led | BodyPoint]) -> None:
    """Drive the ends of a built rope that follow one marker."""
    for end, held in ends.items():
        if isinstance(held, Led):
            held.drive(scene, int(rope.particles[0 if end == "start" else -1]))


def _on_tool(path: str, section: schema.RopeGrip, tool: Tool, place: Array | None, direction: Array | None) -> Grip:
    if tool.flex is not None:
        fix = "leave out `flex` of the tool, or let the end ride on it by [[scene.drive]]"
        raise ConfigError(f"{path}.tool", "bends, which a grip of a rope does not follow", section.tool, fix)
    offset, along = section.position, section.direction
    if offset is None:
        offset = tool.held(_known(path, "position", None, place)[None])[0].tolist()
    if along is None:
        origin = np.zeros(3) if place is None else place
        ends = np.stack([origin, origin + _known(path, "direction", None, direction)])
        along = np.diff(tool.held(ends), axis=0)[0].tolist()
    director = np.eye(3)[int(np.argmin(np.abs(along)))]
    with located(path):
        poses = (tool.times, tool.positions, tool.quaternions)
        return Grip.from_poses(*poses, along, director, offset, tool.frame).smoothed(section.smoothing)


def _known(path: str, key: str, given: list[float] | None, placed: Array | None) -> Array:
    if given is not None:
        return np.array(given)
    if placed is None:
        fix = f'give the {key}, or points = "recording" with markers on the rope'
        raise ConfigError(f"{path}.{key}", "is missing, and nothing says how the rope lies at its start", None, fix)
    return placed
